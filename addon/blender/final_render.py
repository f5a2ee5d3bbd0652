"""F12: the picture of a render depsgraph, band by band into Blender's Render Result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from time import perf_counter
from typing import Any

import bpy
import numpy as np

from ..pipeline import prepared
from ..pipeline.camera import CameraView, Tile
from ..pipeline.errors import UserError
from ..pipeline.image import MISS_DEPTH
from ..pipeline.instance_bounds import BoundsPicture
from ..pipeline.looks import Reading
from ..pipeline.mesh_cache import MeshCache
from ..pipeline.tree_cache import TreeCache
from .camera import scene_view
from .export import MANY, Export
from .passes import blender_passes, wanted_passes
from .properties import settings_of

ANIMATED = {"objects out of reach": True, "instances": True}
"""From frame to frame objects move, and come into reach: each mesh has a tree of its own."""

BANDS = 32
"""A picture is shown in so many parts, from the bottom up, or fewer where it is not high."""

MOST_LOOKS = 4_000_000
"""Before its first ray each part looks at all instances, whether what they look like is there: parts are so few that
these are no more looks than a fraction of a second has room for."""


class Kept:
    """What one frame leaves to the next one: meshes as long as their content stays, trees as long as their meshes."""

    def __init__(self) -> None:
        self.meshes, self.trees = MeshCache(), TreeCache()


def render(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph, kept: Kept) -> dict[str, Any]:
    """Fill the engine's Render Result, and return the report of addon/pipeline/prepared.py.

    Raises UserError, and bihtree.Cancelled where a person pressed Esc.
    """
    render = depsgraph.scene_eval.render
    if render.use_multiview:
        raise UserError("stereoscopic renders are not supported. Untick Stereoscopy in the Output properties.")
    layer = depsgraph.view_layer_eval
    settings = settings_of(depsgraph.scene_eval)
    parts = {**ANIMATED, **settings.parts} if engine.is_animation else settings.parts
    settings = replace(settings, passes=wanted_passes(layer, settings.passes), parts=parts)
    progress = Progress(engine)
    started = perf_counter()
    view = scene_view(depsgraph, engine.resolution_x, engine.resolution_y)
    area = border(render, engine.resolution_x, engine.resolution_y)
    export = Export(meshes=kept.meshes, reading=Reading.of(settings, settings.passes))
    bounds = Bounds(engine, layer.name, view.part(area) if view else None)

    def read(stage: str, share: float) -> bool:
        goes_on = progress(stage, share)
        if goes_on:
            bounds.show(export)
        return goes_on

    export.read_all(depsgraph, read)
    bounds.show(export, is_last=True)
    scene = replace(export.scene(depsgraph), camera=view)
    if scene.skipped:
        engine.report({"WARNING"}, "BIH Preview: " + "; ".join(scene.skipped))
    ready = prepared.prepare(
        scene,
        settings,
        settings.passes,
        tree_shown=False,
        export_seconds=perf_counter() - started,
        trees=kept.trees,
        progress=progress,
    )
    for name in settings.passes:
        for label, channels in blender_passes(name):
            engine.add_pass(label, len(channels), channels, layer=layer.name)
    started = perf_counter()
    for band, done, share in bands(area, len(scene.instance_mesh)):
        passes = ready.picture(tile=band, progress=progress.part(done, share))
        _show(engine, layer.name, passes, (band[0] - area[0], band[1] - area[1], *band[2:]))
    return ready.report(perf_counter() - started, area)


class Progress:
    """Tells Blender how far a render is, and how much longer it takes."""

    def __init__(self, engine: bpy.types.RenderEngine) -> None:
        self._engine = engine
        self._stage, self._since = "", 0.0

    def __call__(self, stage: str, share: float) -> bool:
        """Whether to go on: False once a person has pressed Esc."""
        if stage != self._stage:
            self._stage, self._since = stage, perf_counter()
        text = f"{stage.capitalize()} {share:.0%}"
        if share > 0:
            text += f" | Time left {_clock((perf_counter() - self._since) * (1 - share) / share)}"
        self._engine.update_stats("BIH Preview", text)
        self._engine.update_progress(share)
        return not self._engine.test_break()

    def part(self, done: float, share: float) -> Callable[[float], bool]:
        """The same for a part of the picture, which begins when `done` of all is done and is `share` of all."""
        return lambda fraction: self("trace", done + share * fraction)


class Bounds:
    """Shows the boxes of many instances as the picture, until there is one: some of them while the others are read."""

    def __init__(self, engine: bpy.types.RenderEngine, layer: str, view: CameraView | None) -> None:
        self._engine, self._layer = engine, layer
        self._picture = BoundsPicture(view) if view else None
        self._drawn, self._next = 0, MANY

    def show(self, export: Export, *, is_last: bool = False) -> None:
        """Where there are many, as often as their number has doubled: a picture takes a while of its own."""
        count = export.shown_count
        if self._picture is None or count < (MANY if is_last else self._next):
            return
        self._picture.add(export.boxes(self._drawn))
        self._drawn, self._next = count, 2 * count
        view = self._picture.view
        place = (0, 0, view.width, view.height)
        _show(self._engine, self._layer, {"combined": self._picture.pixels()}, place)


def bands(area: Tile, instances: int = 1) -> Iterator[tuple[Tile, float, float]]:
    """Parts of `area` from the bottom up; what share of it is done before each, and what share it is."""
    left, bottom, width, height = area
    rows = -(-height // max(1, min(BANDS, MOST_LOOKS // max(1, instances))))
    for y in range(0, height, rows):
        count = min(rows, height - y)
        yield (left, bottom + y, width, count), y / height, count / height


def border(render: bpy.types.RenderSettings, width: int, height: int) -> Tile:
    """The part of the picture that is asked for; corners are rounded as Blender rounds them, in float32 and down."""
    if not render.use_border:
        return 0, 0, width, height
    left, right = (int(np.float32(x) * np.float32(width)) for x in (render.border_min_x, render.border_max_x))
    bottom, top = (int(np.float32(y) * np.float32(height)) for y in (render.border_min_y, render.border_max_y))
    return left, bottom, right - left, top - bottom


def _show(engine: bpy.types.RenderEngine, layer: str, passes: dict[str, np.ndarray], place: Tile) -> None:
    """Fill a part of the Render Result, which is float32: triangle rows are exact up to 16,777,216."""
    result = engine.begin_result(*place, layer=layer)
    for name, pixels in passes.items():
        shown = pixels.astype(np.float32)
        if name == "depth":
            shown[np.isinf(shown)] = MISS_DEPTH
        first = 0
        for label, channels in blender_passes(name):
            part = shown[..., first : first + len(channels)]
            result.layers[0].passes[label].rect.foreach_set(part.ravel())
            first += len(channels)
    engine.end_result(result)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes:02}:{rest:02}"
