"""The construction of the tree as an animation: one level more at each step.

Blender reads the annotations as values, so they are not postponed here.
"""

from typing import Any

import bpy
from bpy.props import FloatProperty

from .trees import TREES, OfBuiltTree, redraw


class BIH_OT_play_construction(OfBuiltTree, bpy.types.Operator):
    bl_idname = "bih.play_construction"
    bl_label = "Play Construction"
    bl_description = (
        "Draw the tree level by level, from the root down to its deepest node, by moving To Depth; Esc stops. Each "
        "level may double the redraw time and the memory of what is drawn"
    )
    bl_options = {"REGISTER", "UNDO"}

    pause: FloatProperty(name="Pause", description="Seconds of time a level", default=0.6, min=0.05, soft_max=3.0)

    _timer: Any = None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        context.scene.bih_overlay.last_depth = context.scene.bih_overlay.first_depth
        self._timer = context.window_manager.event_timer_add(self.pause, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            self._stop(context)
            return {"FINISHED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if not step(context):
            self._stop(context)
            return {"FINISHED"}
        self._tell(context)
        return {"PASS_THROUGH"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """From a script: the end of it."""
        while step(context):
            pass
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        self._stop(context)

    def _tell(self, context: bpy.types.Context) -> None:
        depth = context.scene.bih_overlay.last_depth
        context.workspace.status_text_set(f"Construction to depth {depth} (Esc stops)")
        redraw(context)

    def _stop(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)


def step(context: bpy.types.Context) -> bool:
    """One level more; False at the deepest, or where the tree is gone."""
    made, chosen = TREES.of(context.scene).main, context.scene.bih_overlay
    if made is None or chosen.last_depth >= made.deepest:
        return False
    chosen.last_depth += 1
    return True
