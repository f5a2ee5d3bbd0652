"""The render engine: what Blender calls for F12 and for a viewport in Rendered mode, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import bpy

from ..pipeline.errors import UserError
from . import modules
from .passes import KINDS, blender_passes, wanted_passes


class BihPreviewEngine(bpy.types.RenderEngine):
    bl_idname = "BIH_PREVIEW"
    bl_label = "BIH Preview"
    bl_use_preview = False
    bl_use_eevee_viewport = True

    last_summary: ClassVar[tuple[str, ...]] = ()
    """What the last render did, for the panel: Blender frees an engine with its render."""
    last_needs: ClassVar[tuple[Mapping[str, Any], ...]] = ()
    """What the last scene did without, and what not: rows of addon/pipeline/needs.py."""
    kept: ClassVar[dict[str, Any]] = {}
    """What a frame of an animation leaves to the next one (final_render.Kept), by view layer; empty where none is
    rendered."""

    _viewport: Any = None
    """The viewport.Viewport of this engine, or None: it ends with the engine. Blender looks annotations up when it
    registers the class, where bihtree may be missing."""

    def update_render_passes(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
        for name in wanted_passes(view_layer, scene.bih.passes):
            for label, channels in blender_passes(name):
                self.register_pass(scene, view_layer, label, len(channels), channels, KINDS[len(channels)])

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Called on Blender's render thread. Whatever goes wrong is reported: Blender itself would go on."""
        try:
            modules.require("bihtree")
            self._render(depsgraph)
        except UserError as error:
            self.report({"ERROR"}, str(error))
        except MemoryError as error:
            self.report({"ERROR"}, f"out of memory{_because(error)}. Hide heavy objects, or render fewer passes")
        except Exception as error:
            self.report({"ERROR"}, f"{type(error).__name__}: {error}")
            raise

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        from bihtree import Cancelled

        from ..pipeline.preview import sentences
        from .final_render import Kept, render

        kept = Kept()
        if self.is_animation:
            kept = BihPreviewEngine.kept.setdefault(depsgraph.view_layer_eval.name, kept)
        try:
            report = render(self, depsgraph, kept)
        except Cancelled:
            return
        BihPreviewEngine.last_summary = tuple(sentences(report))
        BihPreviewEngine.last_needs = tuple(report["needs"])

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Blender calls this for a viewport in Rendered mode when the scene has changed, and once at first."""
        try:
            modules.require("bihtree")
            from .viewport import Viewport

            if self._viewport is None:
                self._viewport = Viewport()
            self._viewport.update(context, depsgraph)
        except UserError as error:
            self.update_stats("", str(error))
        self.tag_redraw()

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """And this for each redraw."""
        if self._viewport is None:
            return
        try:
            self._viewport.draw(self, context, depsgraph)
        except UserError as error:
            self.update_stats("", str(error))


def _because(error: MemoryError) -> str:
    """What the error says, if anything."""
    return f" ({error})" if str(error) else ""


@bpy.app.handlers.persistent
def forget_frames(*_: object) -> None:
    """After the last frame of an animation, or where it ends early."""
    BihPreviewEngine.kept.clear()
