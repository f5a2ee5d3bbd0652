"""What the overlay in the 3D viewport shows, kept in the scene and saved with it.

Blender reads the annotations as values, so they are not postponed here.
"""

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty

from ..pipeline.settings import STRUCTURES
from .properties import STRUCTURE_TEXT

COSTS = "It takes redraw time, no memory of the tree, and makes no error: the picture stays the same"


class BihOverlaySettings(bpy.types.PropertyGroup):
    is_shown: BoolProperty(
        name="Overlay",
        description=f"Draw the built tree in 3D viewports. {COSTS}",
        default=True,
    )
    shown: EnumProperty(
        name="Show",
        description=f"What of the tree is drawn. {COSTS}",
        items=[
            (
                "planes",
                "Clip Planes",
                "The two clip planes of each node: blue ends the left child, red starts the right",
            ),
            ("boxes", "Boxes", "The box of every node"),
            ("leaves", "Leaves", "The boxes of leaves alone"),
            ("ray", "Picked Ray", "The nodes that the picked ray visits"),
            ("nothing", "Nothing", "Only the cost map or the other structure's mesh"),
        ],
    )
    first_depth: IntProperty(
        name="From Depth",
        description="The first level that is drawn; the root has depth 0. Fewer levels take less redraw time; memory "
        "stays the same, and there is no error",
        min=0,
        default=0,
        soft_max=32,
    )
    last_depth: IntProperty(
        name="To Depth",
        description="The last level that is drawn. Each level may double the redraw time and the memory of what is "
        "drawn, without error; Play moves it from the root down",
        min=0,
        default=6,
        soft_max=32,
    )
    in_front: BoolProperty(
        name="In Front",
        description="Draw over everything, instead of fainter behind surfaces. Less redraw time, the same memory, no "
        "error",
        default=False,
    )
    filled: BoolProperty(
        name="Fill Planes",
        description="Fill the clip planes of the upper levels, and the slab where children overlap (purple). A little "
        "redraw time, hardly any memory, no error",
        default=True,
    )
    legend: BoolProperty(
        name="Legend",
        description="Say in the viewport what the colours mean. No time to speak of, no memory, no error",
        default=True,
    )
    cost: BoolProperty(
        name="Cost Map",
        description="Colour the mesh by the nodes and triangles that a ray from the view to each vertex takes, as "
        "Cost From View found it. Redraw time of one mesh, 28 bytes of memory a corner; between vertices there is an "
        "error",
        default=True,
    )
    most_lines: IntProperty(
        name="Most Lines",
        description="Lines of a redraw: the largest outlines get them, smaller ones are points, an error of a few "
        "pixels. More take more redraw time and memory; 0 is automatic, by what draws: 15,000 where it is a "
        "processor, 4,000,000 on a GPU",
        min=0,
        default=0,
        soft_max=4_000_000,
    )
    other_structure: EnumProperty(
        name="Other Structure",
        description="A second structure over the same mesh, which Compare builds and the viewport shows beside the "
        "first: its build takes time and memory too, and makes no error: rays hit the same",
        items=[(name, *STRUCTURE_TEXT[name]) for name in STRUCTURES],
        default="bvh",
    )
