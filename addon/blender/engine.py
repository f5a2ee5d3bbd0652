"""F12: a render engine whose Render Result is the traced picture."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from time import perf_counter
from typing import Any, ClassVar

import bpy
import numpy as np

from ..pipeline.errors import UserError
from ..pipeline.image import CHANNELS, MISS_DEPTH
from ..pipeline.settings import PASSES
from . import modules
from .export import scene_data
from .properties import settings_of

KINDS = {1: "VALUE", 3: "VECTOR", 4: "COLOR"}


class BihPreviewEngine(bpy.types.RenderEngine):
    bl_idname = "BIH_PREVIEW"
    bl_label = "BIH Preview"
    bl_use_preview = False
    bl_use_eevee_viewport = True

    last_summary: ClassVar[tuple[str, ...]] = ()
    """What the last render did, for the panel: Blender frees an engine with its render."""
    last_needs: ClassVar[tuple[Mapping[str, Any], ...]] = ()
    """What the last scene did without, and what not: rows of addon/pipeline/needs.py."""

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
        except Exception as error:
            self.report({"ERROR"}, f"{type(error).__name__}: {error}")
            raise

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        from bihtree import Cancelled

        from ..pipeline import preview

        if depsgraph.scene_eval.render.use_multiview:
            raise UserError("stereoscopic renders are not supported. Untick Stereoscopy in the Output properties.")
        view_layer = depsgraph.view_layer_eval
        settings = settings_of(depsgraph.scene_eval)
        settings = replace(settings, passes=wanted_passes(view_layer, settings.passes))
        started = perf_counter()
        scene = scene_data(depsgraph, self.resolution_x, self.resolution_y)
        if scene.skipped:
            self.report({"WARNING"}, "BIH Preview: " + "; ".join(scene.skipped))
        try:
            exported = perf_counter() - started
            traced = preview.trace(
                scene, settings, outputs=preview.Outputs(), export_seconds=exported, progress=self._progress
            )
        except Cancelled:
            return
        passes = {name: traced.passes[name] for name in settings.passes}
        self._show(passes, view_layer.name, depsgraph.scene_eval.render)
        BihPreviewEngine.last_summary = tuple(preview.summary(traced.report))
        BihPreviewEngine.last_needs = tuple(traced.report["needs"])

    def _progress(self, stage: str, fraction: float) -> bool:
        self.update_stats("BIH Preview", stage.capitalize())
        self.update_progress(fraction)
        return not self.test_break()

    def _show(self, passes: dict[str, np.ndarray], layer_name: str, render: bpy.types.RenderSettings) -> None:
        """Fill the Render Result, which is float32: triangle rows are exact up to 16,777,216."""
        for name in passes:
            for label, channels in blender_passes(name):
                self.add_pass(label, len(channels), channels, layer=layer_name)
        result = self.begin_result(0, 0, self.resolution_x, self.resolution_y, layer=layer_name)
        width, height = result.resolution_x, result.resolution_y
        left, bottom = border_corner(render, self.resolution_x, self.resolution_y)
        for name, pixels in passes.items():
            shown = pixels[bottom : bottom + height, left : left + width].astype(np.float32)
            if name == "depth":
                shown[np.isinf(shown)] = MISS_DEPTH
            first = 0
            for label, channels in blender_passes(name):
                part = shown[..., first : first + len(channels)]
                result.layers[0].passes[label].rect.foreach_set(part.ravel())
                first += len(channels)
        self.end_result(result)


def blender_passes(name: str) -> list[tuple[str, str]]:
    """Names and channels in the Render Result of one pass of the pipeline: those that its EXR files have."""
    parts: dict[str, str] = {}
    for channel in CHANNELS[name]:
        label, letter = channel.split(".")
        parts[label] = parts.get(label, "") + letter
    return list(parts.items())


def wanted_passes(view_layer: bpy.types.ViewLayer, chosen: Collection[str]) -> tuple[str, ...]:
    """The passes chosen for BIH, those that the view layer asks any engine for, and always Combined."""
    asked = {"combined", *chosen}
    asked |= {
        name
        for name, flag in (("depth", "use_pass_z"), ("normal", "use_pass_normal"), ("position", "use_pass_position"))
        if getattr(view_layer, flag)
    }
    return tuple(name for name in PASSES if name in asked)


def border_corner(render: bpy.types.RenderSettings, width: int, height: int) -> tuple[int, int]:
    """Lower left pixel of the render border. The whole picture is traced, and Blender is given the border's part;
    corners are rounded as Blender rounds them, in float32 and down."""
    if not render.use_border:
        return 0, 0
    return int(np.float32(render.border_min_x) * np.float32(width)), int(
        np.float32(render.border_min_y) * np.float32(height)
    )
