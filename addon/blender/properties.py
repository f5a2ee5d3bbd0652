"""What a person can choose, kept in the scene and saved with it.

Blender reads the annotations as values, so they are not postponed here.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty

from ..pipeline.settings import LAYOUTS, PASSES, PRECISIONS, STRUCTURES, Settings

STRUCTURE_TEXT = {
    "bih": ("BIH", "Bounding Interval Hierarchy: two clip planes a node. Quick to build and small"),
}
LAYOUT_TEXT = {
    "wide": ("Wide", "Records of eight boxes for the processor's vector unit: two to five times as fast to trace"),
    "compact": ("Compact", "Such records with rounded boxes: about a sixth of the memory, slower to trace"),
    "classic": ("Classic", "The 12-byte nodes of the paper, for study: slow to trace"),
}
PRECISION_TEXT = {
    "watertight": ("Watertight", "No ray slips through a shared edge or vertex; every hit and miss is decided exactly"),
    "exact": ("Exact", "The same hits, with distances and weights right to the last digit of double precision"),
    "fast": ("Fast", "Single precision: quicker to trace; now and then a ray slips through an edge"),
}
PASS_TEXT = {
    "combined": "Shaded picture",
    "depth": "Distance from the camera along the viewing axis; infinite where nothing is hit",
    "normal": "Unit normal in world space, facing the camera",
    "position": "Hit point in world space",
    "triangle": "Row of the triangle that is hit, -1 for none",
    "cost": "Nodes visited and triangles tested for the pixel: where the tree is slow",
}


class BihSettings(bpy.types.PropertyGroup):
    structure: EnumProperty(
        name="Structure",
        description="How triangles are arranged for tracing. It changes build time, trace time and memory; "
        "the picture stays the same",
        items=[(name, *STRUCTURE_TEXT[name]) for name in STRUCTURES],
    )
    layout: EnumProperty(
        name="Layout",
        description="How the tree is stored: for little trace time or for little memory. The picture stays the same",
        items=[(name, *LAYOUT_TEXT[name]) for name in LAYOUTS],
    )
    precision: EnumProperty(
        name="Precision",
        description="How hits are decided. More precision costs trace time, not memory, and leaves fewer wrong pixels",
        items=[(name, *PRECISION_TEXT[name]) for name in PRECISIONS],
    )
    leaf_size: IntProperty(
        name="Leaf Size",
        description="Most triangles in a leaf; 0 lets the structure choose. Larger leaves build faster and need less "
        "memory, smaller ones test fewer triangles for a ray; wide ones hold 8 at most. The picture stays the same",
        min=0,
        soft_max=64,
    )
    samples: IntProperty(
        name="Samples",
        description="Rays a pixel. Trace time grows in proportion, jagged edges become smooth; memory stays the same",
        min=1,
        default=1,
        soft_max=64,
    )
    shadows: BoolProperty(
        name="Shadows",
        description="Trace a ray to each light from what the camera sees: up to one more ray for each light and "
        "sample of time, no memory",
        default=True,
    )
    passes: EnumProperty(
        name="Passes",
        description="Pictures to keep beside Combined. Each takes 4 to 16 bytes of memory a pixel and hardly any time",
        items=[(name, name.capitalize(), PASS_TEXT[name], 1 << bit) for bit, name in enumerate(PASSES)],
        options={"ENUM_FLAG"},
        default=set(PASSES),
    )
    overlay_depth: IntProperty(
        name="Overlay Depth",
        description="Deepest level of the tree that the overlay picture shows. Each level may double the planes to "
        "draw, and so its time; the traced picture stays the same",
        min=0,
        default=Settings.overlay_depth,
        soft_max=16,
    )


def settings_of(scene: bpy.types.Scene) -> Settings:
    """The scene's choice as the pipeline takes it; where no pass is chosen, Combined."""
    chosen = scene.bih
    return Settings(
        structure=chosen.structure,
        layout=chosen.layout,
        precision=chosen.precision,
        leaf_size=chosen.leaf_size or None,
        threads=scene.render.threads if scene.render.threads_mode == "FIXED" else 0,
        samples=chosen.samples,
        shadows=chosen.shadows,
        passes=tuple(name for name in PASSES if name in chosen.passes) or ("combined",),
        overlay_depth=chosen.overlay_depth,
    )
