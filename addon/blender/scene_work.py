"""Long work on what the viewport shows: it is read while the window goes on, and the overlay shows boxes of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy

from ..pipeline.scene import SceneData
from .camera import picture_size, scene_view
from .export import MANY, Export
from .modal_work import ModalWork
from .trees import TREES, redraw


class SceneWork(ModalWork):
    """Operators whose `started` asks for `scene_read`."""

    _export: Any = None

    def read(self, context: bpy.types.Context, seconds: float) -> bool:
        if self._export is None:
            self._export = Export()
        is_done: bool = self._export.read(context.evaluated_depsgraph_get(), None, seconds=seconds)
        if self.is_in_window and self._export.shown_count >= MANY:
            TREES.of(context.scene).bounds = self._export.boxes()
            redraw(context)
        return is_done

    def share_read(self) -> float:
        return self._export.share if self._export else 0.0

    def ended(self, context: bpy.types.Context) -> None:
        self._export = None
        if TREES.of(context.scene).bounds is not None:
            TREES.of(context.scene).bounds = None
            redraw(context)

    def scene_read(self, context: bpy.types.Context, *, with_camera: bool = False) -> SceneData:
        """What is read; with the scene's camera where that is wanted. Raises UserError as `scene_view` does."""
        depsgraph = context.evaluated_depsgraph_get()
        scene: SceneData = self._export.scene(depsgraph)
        return replace(scene, camera=scene_view(depsgraph, *picture_size(context.scene))) if with_camera else scene
