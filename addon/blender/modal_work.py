"""Operators whose work is done by a thread while the window goes on: progress, time left, and Esc."""

from __future__ import annotations

import math
from pathlib import Path
from time import perf_counter
from typing import Any

import bpy

from ..pipeline.errors import UserError
from . import modules
from .worker import Worker

TICK = 0.05

SLICE = 0.1
"""Seconds of reading at a time, at least: then the window goes on."""


class ModalWork:
    """What such an operator has beside bpy.types.Operator: `read` reads the scene, `started` starts the thread,
    `finished` puts its result where it belongs. All run in Blender's own thread, and may raise UserError; `ended` is
    called whatever became of it."""

    work: Any = None
    """The Worker, while there is one; before it something is read."""
    is_in_window = False
    _timer: Any = None
    _began = 0.0

    def read(self, context: bpy.types.Context, seconds: float) -> bool:
        """Read for so long or a little longer; whether all is read."""
        return True

    def share_read(self) -> float:
        return 0.0

    def started(self, context: bpy.types.Context) -> Worker[Any]:
        raise NotImplementedError

    def finished(self, context: bpy.types.Context, result: Any) -> str:
        """One line for the status bar."""
        raise NotImplementedError

    def ended(self, context: bpy.types.Context) -> None:
        """Let go of what was read."""

    def line(self) -> str:
        """How far it is, in a few words."""
        what, share = (self.work.line, self.work.share) if self.work else ("reading the scene", self.share_read())
        return f"{what} {share:.0%}{time_left(share, perf_counter() - self._began)}".lstrip()

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """In a window: without freezing it."""
        self.is_in_window = True
        if not self._start(context, SLICE):
            return {"CANCELLED"}
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.work is None:
            return self._read_on(context, event)
        if event.type == "ESC" and event.value == "PRESS":
            self.work.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if not self.work.is_done:
            self._tell(context)
            return {"PASS_THROUGH"}
        self._stop_telling(context)
        return self._end(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """From a script: when it returns, all is done."""
        if not self._start(context, math.inf):
            return {"CANCELLED"}
        self.work.wait()
        return self._end(context)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender closes, or another file is opened."""
        if self.work is not None:
            self.work.cancel()
            self.work.wait()
        self._stop_telling(context)
        self.ended(context)

    def _read_on(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Nothing else is done in Blender meanwhile: what is read must not change."""
        if event.type == "ESC" and event.value == "PRESS":
            self._stop_telling(context)
            self.ended(context)
            self.report({"WARNING"}, f"{self.bl_label}: cancelled")
            return {"CANCELLED"}
        if event.type == "TIMER":
            if not self._go_on(context, SLICE):
                self._stop_telling(context)
                return {"CANCELLED"}
            self._tell(context)
        return {"RUNNING_MODAL"}

    def _start(self, context: bpy.types.Context, seconds: float) -> bool:
        self._began = perf_counter()
        return self._go_on(context, seconds)

    def _go_on(self, context: bpy.types.Context, seconds: float) -> bool:
        """Read, and start the thread once all is read. False where that goes wrong."""
        try:
            modules.require("bihtree")
            if self.read(context, seconds):
                self.work = self.started(context)
                self._began = perf_counter()
        except UserError as error:
            self.ended(context)
            self.report({"ERROR"}, str(error))
            return False
        return True

    def _end(self, context: bpy.types.Context) -> set[str]:
        worker = self.work
        self.work = None  # the operator outlives its work in Blender's list of what was done
        self.ended(context)
        if worker.error:
            self.report({"ERROR"}, worker.error)
            return {"CANCELLED"}
        if worker.result is None:
            self.report({"WARNING"}, f"{self.bl_label}: cancelled")
            return {"CANCELLED"}
        try:
            self.report({"INFO"}, self.finished(context, worker.result))
        except UserError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _tell(self, context: bpy.types.Context) -> None:
        share = self.work.share if self.work else self.share_read()
        context.window_manager.progress_update(100 * share)
        context.workspace.status_text_set(f"{self.bl_label}: {self.line()} (Esc ends it)")

    def _stop_telling(self, context: bpy.types.Context) -> None:
        if self._timer is None:
            return
        context.window_manager.event_timer_remove(self._timer)
        self._timer = None
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


def time_left(share: float, passed: float) -> str:
    """In words, after a comma; empty where it cannot be said yet."""
    return f", {passed / share - passed:.0f} s left" if share > 0.05 and passed > 1.0 else ""


class FileWork(ModalWork):
    """Work that writes the file of the property `filepath`: from a window it is asked for first."""

    suffix = ""
    filepath: str
    _is_asked = False

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.filepath:
            self.filepath = str(Path(bpy.data.filepath or context.scene.name).with_suffix(self.suffix))
        self._is_asked = True
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """From a script, or when the file was chosen."""
        return ModalWork.invoke(self, context, None) if self._is_asked else ModalWork.execute(self, context)

    def path(self) -> Path:
        """Absolute, with the suffix if it has none. Raises UserError for none."""
        if not self.filepath:
            raise UserError(f"no file is named; give filepath=, a path that ends in {self.suffix}")
        path = Path(bpy.path.abspath(self.filepath))
        return path if path.suffix else path.with_suffix(self.suffix)
