"""What a person can choose, kept in the scene and saved with it.

Blender reads the annotations as values, so they are not postponed here.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ..pipeline.settings import (
    DEFAULT_PASSES,
    GOES_WITH,
    HEURISTICS,
    LAYOUTS,
    PASSES,
    PRECISIONS,
    SHADINGS,
    STRUCTURES,
    Settings,
)

STRUCTURE_TEXT = {
    "bih": ("BIH", "Bounding Interval Hierarchy: two clip planes a node. Quick to build and small"),
    "bvh": (
        "BVH",
        "A rival: boxes by the surface area heuristic. A multiple of the build time, less trace time",
    ),
    "kd_tree": ("kd-Tree", "A rival that cuts triangles: slow to build, several times the memory, few tests for a ray"),
}
HEURISTIC_TEXT = {
    "global": ("Global", "In the middle of the longest side of a cell, as in the paper: the least build time"),
    "local": ("Local", "In the middle of what is there: little more build time, less trace time where sizes differ"),
    "sah": ("SAH", "Where the surface area heuristic expects the least work: more build time, less trace time"),
}
BUILD_TEXT = {
    "auto": ("Automatic", "On demand where the view needs a small part of many triangles"),
    "eager": ("All at Once", "The whole tree before the first ray"),
    "on_demand": ("On Demand", "Rays build what they come to: less time and memory until the first picture"),
}
PRESORT_TEXT = {
    "auto": ("Automatic", "From 65,536 triangles on, where it pays"),
    "always": ("Always", "Sort first: 8 bytes of memory a triangle while building, less build time of large meshes"),
    "never": ("Never", "Sort in place: no memory beside the tree"),
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
SHADING_TEXT = {
    "lights": ("Scene Lights", "Suns, points, spots and areas of the scene, and its world; a headlight if it has none"),
    "headlight": ("Headlight", "One light at the camera, without shadows: no ray but the camera's, the least time"),
}
PASS_TEXT = {
    "combined": "Shaded picture",
    "depth": "Distance from the camera along the viewing axis; infinite where nothing is hit",
    "normal": "Unit normal in world space, facing the camera",
    "position": "Hit point in world space",
    "triangle": "Row of the triangle that is hit, -1 for none",
    "instance": "Row of the instance that is hit, -1 for none",
    "object_index": "The object's Pass Index, 0 for none",
    "material_index": "The material's Pass Index, 0 for none",
    "cost": "Nodes visited and triangles tested for the pixel: where the tree is slow",
}


class BihSettings(bpy.types.PropertyGroup):
    structure: EnumProperty(
        name="Structure",
        description="How triangles are arranged for tracing. It changes build time, trace time and memory, and no "
        "error: the picture stays the same",
        items=[(name, *STRUCTURE_TEXT[name]) for name in STRUCTURES],
    )
    layout: EnumProperty(
        name="Layout",
        description="How the tree is stored: for little trace time or for little memory. It makes no error: the "
        "picture stays the same",
        items=[(name, *LAYOUT_TEXT[name]) for name in LAYOUTS],
    )
    heuristic: EnumProperty(
        name="Heuristic",
        description="Where nodes are split. It trades build time for trace time; memory changes little, the error not "
        "at all: the picture stays the same",
        items=[(name, *HEURISTIC_TEXT[name]) for name in HEURISTICS],
    )
    build: EnumProperty(
        name="Build",
        description="When the tree is built. On demand saves build time and memory where rays see a part of the "
        "scene. It makes no error: the picture stays the same",
        items=[(name, *text) for name, text in BUILD_TEXT.items()],
    )
    presort: EnumProperty(
        name="Presort",
        description="The bucket sort before the global heuristic. It changes build time and the memory that building "
        "takes; the tree stays the same, and so does the error",
        items=[(name, *text) for name, text in PRESORT_TEXT.items()],
    )
    precision: EnumProperty(
        name="Precision",
        description="How hits are decided. More precision costs trace time, not memory, and has less error: fewer "
        "wrong pixels",
        items=[(name, *PRECISION_TEXT[name]) for name in PRECISIONS],
    )
    leaf_size: IntProperty(
        name="Leaf Size",
        description="Most triangles in a leaf; 0 is automatic: the structure chooses. Larger leaves take less build "
        "time and memory, smaller ones fewer tests for a ray; wide ones hold 8 at most. No error: the picture stays "
        "the same",
        min=0,
        soft_max=64,
    )
    samples: IntProperty(
        name="Samples",
        description="Rays a pixel. Trace time grows in proportion, memory stays the same, and the error of edges and "
        "soft light shrinks: with four times as many, by half or more",
        min=1,
        default=1,
        soft_max=64,
    )
    viewport_samples: IntProperty(
        name="Viewport Samples",
        description="Rays a pixel in the viewport, one after another while you look. The error of edges shrinks as "
        "time goes on; the first picture comes as soon, and memory stays the same",
        min=1,
        default=16,
        soft_max=256,
    )
    shadows: BoolProperty(
        name="Shadows",
        description="Trace a ray to each light from what the camera sees: up to one more ray for each light and "
        "sample of time, no memory. Without them the error is that nothing is in shadow",
        default=True,
    )
    shading: EnumProperty(
        name="Shading",
        description="What the scene is lit by. Each light with shadows takes one more ray a sample of time, no "
        "memory; the headlight shows shapes without error, and not how they are lit",
        items=[(name, *SHADING_TEXT[name]) for name in SHADINGS],
    )
    soft_shadows: BoolProperty(
        name="Soft Shadows",
        description="Give lights their size. Shadows get the soft edges they have, with noise, an error that fades as "
        "the samples grow: with four times as many, by half or more. The same rays, a little more time for each, no "
        "memory",
        default=Settings.soft_shadows,
    )
    ambient_occlusion: BoolProperty(
        name="Ambient Occlusion",
        description="Darken what the world's light or the headlight reaches only in part. One more ray a sample of "
        "time, no memory; noise, an error that fades as the samples grow",
        default=Settings.ambient_occlusion,
    )
    ambient_occlusion_distance: FloatProperty(
        name="Distance",
        description="How far away a surface may darken another; 0 is without end. A shorter one takes less time and "
        "the same memory; what is further away is left out, which is an error",
        min=0.0,
        subtype="DISTANCE",
    )
    smooth: BoolProperty(
        name="Smooth Normals",
        description="Shade smooth faces as smooth. It takes 36 bytes of memory a triangle where a mesh has such "
        "faces, and little time; outlines and shadows stay those of the triangles, so the error is at edges alone",
        default=Settings.smooth,
    )
    passes: EnumProperty(
        name="Passes",
        description="Pictures to keep beside Combined. Each takes 4 to 16 bytes of memory a pixel, hardly any time, "
        "and makes no error",
        items=[(name, name.replace("_", " ").title(), PASS_TEXT[name], 1 << bit) for bit, name in enumerate(PASSES)],
        options={"ENUM_FLAG"},
        default=set(DEFAULT_PASSES),
    )
    overlay_depth: IntProperty(
        name="Overlay Depth",
        description="Deepest level of the tree that the overlay picture shows. Each level may double the planes to "
        "draw, and so its time and memory; it makes no error: the traced picture stays the same",
        min=0,
        default=Settings.overlay_depth,
        soft_max=16,
    )


FORCED = {"auto": None, "eager": False, "on_demand": True, "always": True, "never": False}
"""What a choice of build or presort says of its part of the work; None: the scene decides."""


def settings_of(scene: bpy.types.Scene) -> Settings:
    """The scene's choice as the pipeline takes it; where no pass is chosen, Combined. What the structure does not have
    is not asked for: `why_not` says so in the panel."""
    chosen = scene.bih
    own = {name: own_choice(chosen, name) for name in GOES_WITH[chosen.structure]}
    forced = {
        part: FORCED[getattr(chosen, name)]
        for name, part in PARTS_OF_CHOICES.items()
        if name != "leaf_size" and not why_not(chosen, part)
    }
    return Settings(
        structure=chosen.structure,
        **own,
        precision=chosen.precision,
        leaf_size=None if why_not(chosen, "leaf size") else chosen.leaf_size or None,
        threads=scene.render.threads if scene.render.threads_mode == "FIXED" else 0,
        samples=chosen.samples,
        shading=chosen.shading,
        shadows=chosen.shadows,
        soft_shadows=chosen.soft_shadows,
        ambient_occlusion=chosen.ambient_occlusion,
        ambient_occlusion_distance=chosen.ambient_occlusion_distance or None,
        smooth=chosen.smooth,
        passes=tuple(name for name in PASSES if name in chosen.passes) or ("combined",),
        overlay_depth=chosen.overlay_depth,
        parts={part: is_kept for part, is_kept in forced.items() if is_kept is not None},
    )


def own_choice(chosen: BihSettings, name: str) -> str:
    """The layout or the heuristic that is used: the chosen one where the structure has it, else the structure's own."""
    known = GOES_WITH[chosen.structure][name]
    value: str = getattr(chosen, name)
    return value if value in known else known[0]


PARTS_OF_CHOICES = {"build": "on demand", "presort": "bucket sort", "leaf_size": "leaf size"}
"""The part of the work that each of these choices is about."""


def why_not(chosen: BihSettings, part: str) -> str:
    """Why a part of the work cannot be chosen now, in one line; empty where it can."""
    name = STRUCTURE_TEXT[chosen.structure][0]
    if part == "on demand" and chosen.structure != "bih":
        return f"A {name} is built all at once"
    if part == "bucket sort" and own_choice(chosen, "heuristic") != "global":
        return "Presort goes with the global heuristic alone"
    if part == "leaf size" and chosen.structure == "kd_tree":
        return f"The leaves of a {name} end where no split is cheaper"
    return ""


def notes(chosen: BihSettings) -> list[str]:
    """Everything that cannot be chosen now, a line each."""
    lines = [why for part in PARTS_OF_CHOICES.values() if (why := why_not(chosen, part))]
    for choice, known in GOES_WITH[chosen.structure].items():
        if getattr(chosen, choice) not in known:
            texts = LAYOUT_TEXT if choice == "layout" else HEURISTIC_TEXT
            name = STRUCTURE_TEXT[chosen.structure][0]
            lines.append(f"A {name} has no {choice} {texts[getattr(chosen, choice)][0]}: {texts[known[0]][0]} is used")
    return lines
