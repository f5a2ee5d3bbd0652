"""The panel's button for a report: it reads the scene, measures in the background, and opens the page.

Blender reads the annotations as values, so they are not postponed here.
"""

import tempfile
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, StringProperty

from ..pipeline.errors import UserError
from . import modules
from .export import scene_data
from .properties import settings_of

TICK = 0.25


class BIH_OT_report(bpy.types.Operator):
    bl_idname = "bih.report"
    bl_label = "Error Report"
    bl_description = (
        "Measure error against run time for what the viewport shows: wrong hits, time and memory of each method, "
        "stability, and what the scene does without. Opens a page in the browser; Esc ends it early"
    )

    quick: BoolProperty(
        name="Quick",
        description="Fewer rays and rounds: about a minute of time instead of several; memory stays the same",
        default=True,
    )
    only: StringProperty(name="Sections", description="Names of sections, with commas; empty: all", options={"HIDDEN"})
    folder: StringProperty(name="Folder", description="Where the page is written", options={"HIDDEN"})

    _background: Any = None
    _timer: Any = None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """In a window: without freezing it."""
        if not self._start(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            self._background.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if not self._background.is_done:
            context.window_manager.progress_update(100 * self._background.share)
            context.workspace.status_text_set(f"BIH report: {self._background.line} (Esc ends it)")
            return {"PASS_THROUGH"}
        self._stop_telling(context)
        if self._finished() == {"CANCELLED"}:
            return {"CANCELLED"}
        bpy.ops.wm.url_open(url=self._background.page.as_uri())
        return {"FINISHED"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """From a script: when it returns, the page is there."""
        if not self._start(context):
            return {"CANCELLED"}
        self._background.wait()
        return self._finished()

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender closes."""
        self._background.cancel()
        self._background.wait()
        self._stop_telling(context)

    def _start(self, context: bpy.types.Context) -> bool:
        try:
            modules.require("bihtree")
            from ..report.error.command import options_of
            from ..report.error.subject import Subject
            from .background import BackgroundReport

            scene = context.scene
            scale = scene.render.resolution_percentage / 100
            size = (max(1, int(side * scale)) for side in (scene.render.resolution_x, scene.render.resolution_y))
            exported = scene_data(context.evaluated_depsgraph_get(), *size)
            subject = Subject(exported, settings_of(scene), bpy.data.filepath or scene.name)
            # What is empty is said at once.
            assert subject.mesh and subject.camera
            folder = Path(self.folder) if self.folder else _own_folder()
            self._background = BackgroundReport(subject, options_of(self.quick, self.only or None), folder)
        except UserError as error:
            self.report({"ERROR"}, str(error))
            return False
        return True

    def _finished(self) -> set[str]:
        if self._background.error:
            self.report({"ERROR"}, self._background.error)
            return {"CANCELLED"}
        self.report({"INFO"}, f"BIH report: {self._background.page}")
        return {"FINISHED"}

    def _stop_telling(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


def _own_folder() -> Path:
    """The extension's own; where it is no extension, a new temporary one."""
    package = ".".join(str(__package__).split(".")[:3])
    if package.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(package, path="report", create=True))
    return Path(tempfile.mkdtemp(prefix="bih-report-"))
