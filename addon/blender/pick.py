"""Picking a ray, and walking from node to node.

Blender reads the annotations as values, so they are not postponed here.
"""

from typing import Any

import bpy
from bpy.props import EnumProperty, FloatVectorProperty

from ..pipeline.errors import UserError
from .build import built_tree
from .trees import TREES, OfBuiltTree, redraw


class BIH_OT_pick_ray(OfBuiltTree, bpy.types.Operator):
    bl_idname = "bih.pick_ray"
    bl_label = "Pick Ray"
    bl_description = (
        "Click in a 3D viewport: the nodes that the ray through that pixel visits are drawn, and the last of them is "
        "selected. On demand the ray builds what it comes to; milliseconds of time"
    )
    bl_options = {"REGISTER", "UNDO"}

    origin: FloatVectorProperty(name="Origin", description="Where the ray starts", options={"HIDDEN"})
    direction: FloatVectorProperty(name="Direction", description="Where it goes", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.window.cursor_modal_set("EYEDROPPER")
        context.workspace.status_text_set("Click on the ray's pixel in a 3D viewport (Esc or right click: leave it)")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self._stop(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"PASS_THROUGH"}
        self._stop(context)
        ray = ray_under(context.window, event.mouse_x, event.mouse_y)
        if ray is None:
            self.report({"WARNING"}, "that was not in a 3D viewport")
            return {"CANCELLED"}
        self.origin, self.direction = ray
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            line = pick(context, self.origin, self.direction)
        except UserError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, line)
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        self._stop(context)

    def _stop(self, context: bpy.types.Context) -> None:
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)


class BIH_OT_select_node(OfBuiltTree, bpy.types.Operator):
    bl_idname = "bih.select_node"
    bl_label = "Select Node"
    bl_description = "Go to another node of the built tree; no time, no memory"

    to: EnumProperty(
        name="To",
        description="Where to go from the selected node",
        items=[
            ("root", "Root", "The root of the tree"),
            ("parent", "Parent", "The node that the selected one is a child of"),
            ("left", "Left Child", "The child that ends at the blue plane"),
            ("right", "Right Child", "The child that starts at the red plane"),
            ("none", "None", "Select nothing"),
        ],
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        select(context, self.to)
        return {"FINISHED"}


def pick(context: bpy.types.Context, origin: Any, direction: Any) -> str:
    """Walk that ray, show it, and say what it did. Raises UserError where no tree is built."""
    from ..pipeline.built import MOST_NODES
    from ..pipeline.ray_path import ray_path

    made, trees = built_tree(context), TREES.of(context.scene)
    if not any(direction):
        raise UserError("direction is (0, 0, 0); give one that points somewhere")
    path = ray_path(made.tree, origin, direction, limit=MOST_NODES)
    trees.read_again()
    trees.path = path
    trees.selected = int(trees.path.visited[-1]) if len(trees.path.visited) else -1
    chosen = context.scene.bih_overlay
    chosen.is_shown, chosen.shown = True, "ray"
    redraw(context)
    what = f"hits triangle {trees.path.triangle:,}" if trees.path.is_hit else "hits nothing"
    visited = f"{path.nodes:,} records or nodes visited, {path.tests:,} triangles tested"
    return f"BIH: the ray {what}; {visited}"


def select(context: bpy.types.Context, to: str) -> None:
    from ..pipeline.ray_path import child_of, parent_of

    trees = TREES.of(context.scene)
    assert trees.main is not None
    row = trees.selected
    if to == "none":
        trees.selected = -1
    elif to == "root" or row < 0:
        trees.selected = 0
    elif to == "parent":
        trees.selected = parent_of(trees.main.nodes, row)
    else:
        trees.selected = child_of(trees.main.nodes, row, ("left", "right").index(to))
    redraw(context)


def ray_under(window: bpy.types.Window, x: int, y: int) -> tuple[Any, Any] | None:
    """Origin and direction of the ray through a pixel of the window; None outside 3D viewports."""
    from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d

    for area in window.screen.areas:
        for region in area.regions:
            is_inside = region.x <= x < region.x + region.width and region.y <= y < region.y + region.height
            if area.type == "VIEW_3D" and region.type == "WINDOW" and is_inside:
                place = (x - region.x, y - region.y)
                data = area.spaces.active.region_3d
                return region_2d_to_origin_3d(region, data, place), region_2d_to_vector_3d(region, data, place)
    return None
