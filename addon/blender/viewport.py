"""Rendered mode in a 3D viewport: reads the scene, tells the session what to show, and draws its newest picture.

The session's thread never touches bpy: a timer asks it for news, in Blender's own thread.
"""

from __future__ import annotations

import math
import weakref
from time import perf_counter
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..pipeline.camera import CameraView, Tile
from ..pipeline.instance_bounds import BoundsPicture
from ..pipeline.looks import Reading
from ..pipeline.mesh_cache import MeshCache
from ..pipeline.refinement import Step, view_of
from ..pipeline.scene import SceneData
from ..pipeline.session import Session
from ..pipeline.settings import Settings
from .camera import check_not_panoramic, viewport_border, viewport_view
from .export import Export
from .modal_work import SLICE, time_left
from .properties import settings_of

TICK = 0.02
"""Seconds between two looks for a new picture."""

LONGEST_SLICE = 1.0
"""Seconds of reading at a redraw, at most."""

PATIENCE = 0.03
"""Seconds that a redraw waits for the first picture of what has changed: it follows the mouse, and nobody feels it."""


class Viewport:
    """One viewport of one engine; it holds no reference to the engine, which Blender frees."""

    def __init__(self) -> None:
        self._session = Session()
        self._meshes = MeshCache()
        self._scene: SceneData | None = None
        self._settings: Settings | None = None
        self._samples = 1
        self._pixel_size = 1
        self._view: CameraView | None = None
        self._place: Tile = (0, 0, 1, 1)
        self._export: Export | None = None
        """What is being read, where that takes a while, and until there is a picture of it."""
        self._is_reading = False
        self._began = self._left_off = 0.0
        self._bounds: _Bounds | None = None
        self._drawn: object = None
        self._texture: Any = None
        self._poll: Any = None

    def update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """The scene has changed. Where it shows many instances, redraws read them, part by part."""
        scene = depsgraph.scene_eval
        self._settings = settings_of(scene)
        self._samples = scene.bih.viewport_samples
        self._view = self._bounds = None
        self._export = Export(meshes=self._meshes, reading=Reading.of(self._settings, ("combined",)))
        self._is_reading = True
        if self._left_off:  # what changes again and again is seen, if only as boxes
            self._left_off = self._began = perf_counter()
        if not self._export.is_long(depsgraph):
            self._read(context, depsgraph, math.inf)
            self._export = None

    def draw(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        if self._settings is None:
            return
        scene, seen = depsgraph.scene_eval, context.region_data
        if seen.view_perspective == "CAMERA" and context.space_data.camera:
            check_not_panoramic(context.space_data.camera)
        whole, pixel_size = viewport_view(context.region, seen), engine.get_preview_pixel_size(scene)
        self._place = viewport_border(scene, context.space_data, seen, whole)
        view = whole.part(self._place)
        if self._is_reading:
            self._read_on(context, depsgraph)
        if not self._is_reading and self._scene is not None:
            self._ask(self._scene, self._settings, view, pixel_size)
        self._tell(engine)
        pixels = self._seen(view)
        if pixels is None:
            self._drawn = self._texture = None
        else:
            self._draw(pixels, engine, scene)
        self._keep_looking(engine)

    def _ask(self, scene: SceneData, settings: Settings, view: CameraView, pixel_size: int) -> None:
        """For a picture of what is seen, unless that was asked for."""
        if self._view is None or not _are_same(view, self._view) or pixel_size != self._pixel_size:
            self._view, self._pixel_size = view, pixel_size
            self._session.show(scene, settings, view, samples=self._samples, pixel_size=pixel_size)
            self._session.wait(PATIENCE)

    def _read_on(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """For as long as the window went on since the last time; at first not at all, so that it says what is done."""
        now = perf_counter()
        if self._left_off:
            self._read(context, depsgraph, min(max(SLICE, now - self._left_off), LONGEST_SLICE))
        else:
            self._began = now
        self._left_off = perf_counter()

    def _read(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph, seconds: float) -> None:
        assert self._export is not None
        if self._export.read(depsgraph, context.space_data, seconds=seconds):
            self._scene, self._is_reading = self._export.scene(depsgraph), False

    def _seen(self, view: CameraView) -> NDArray[np.float32] | None:
        """The newest picture, or the boxes of what there is none of yet."""
        if self._export is not None and not self._is_reading and self._session.wait(0.0):
            self._export = self._bounds = None
        if self._export is None:
            shown = self._session.shown
            return None if shown is None else shown.pixels
        if self._bounds is None or not _are_same(view, self._bounds.view):
            self._bounds = _Bounds(view)
        return self._bounds.pixels(self._export)

    def _tell(self, engine: bpy.types.RenderEngine) -> None:
        if self._is_reading and self._export is not None:
            share = self._export.share
            left = time_left(share, perf_counter() - self._began)
            engine.update_stats(f"Reading the scene {share:.0%}{left}", "")
            return
        notes = "; ".join(self._scene.skipped) if self._scene else ""
        engine.update_stats(self._session.problem or self._session.activity, notes)

    def _draw(self, picture: NDArray[np.float32], engine: bpy.types.RenderEngine, scene: bpy.types.Scene) -> None:
        """Over all that is asked for: a picture of another size is stretched."""
        import gpu
        from gpu_extras.presets import draw_texture_2d

        if self._texture is None or picture is not self._drawn:
            height, width, _ = picture.shape
            pixels = gpu.types.Buffer("FLOAT", picture.size, np.ascontiguousarray(picture).ravel())
            self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=pixels)
            self._drawn = picture
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(scene)
        x, y, width, height = self._place
        draw_texture_2d(self._texture, (x, y), width, height)
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def _keep_looking(self, engine: bpy.types.RenderEngine) -> None:
        """Look for news until the last picture is drawn."""
        if self._poll is None:
            self._poll = _poll(weakref.ref(self), weakref.ref(engine))
        if self._is_behind() and not bpy.app.timers.is_registered(self._poll):
            bpy.app.timers.register(self._poll, first_interval=TICK)

    def _is_behind(self) -> bool:
        return self._is_reading or bool(self._session.activity) or self._is_new()

    def _has_news(self) -> bool:
        return self._is_reading or self._is_new() or bool(self._session.problem)

    def _is_new(self) -> bool:
        """Whether there is a picture that is not drawn."""
        shown = self._session.shown
        return (None if shown is None else shown.pixels) is not self._drawn


class _Bounds:
    """A picture of the boxes of what is read in one view, made again when there are more."""

    def __init__(self, view: CameraView) -> None:
        self.view = view
        self._picture = BoundsPicture(view_of(view, Step(2)))
        self._drawn = -1
        self._pixels: NDArray[np.float32] | None = None

    def pixels(self, export: Export) -> NDArray[np.float32]:
        if self._pixels is None or export.shown_count > self._drawn:
            self._picture.add(export.boxes(max(self._drawn, 0)))
            self._drawn, self._pixels = export.shown_count, self._picture.pixels()
        return self._pixels


def _poll(viewport: weakref.ref[Viewport], engine: weakref.ref[bpy.types.RenderEngine]):
    """A timer that ends with the viewport, with its engine, and when there is no more to come."""

    def look() -> float | None:
        looked_at, owner = viewport(), engine()
        if looked_at is None or owner is None:
            return None
        try:
            if looked_at._has_news():
                owner.tag_redraw()
        except ReferenceError:  # Blender has freed the engine, and Python not yet
            return None
        return TICK if looked_at._is_behind() else None

    return look


def _are_same(a: CameraView, b: CameraView) -> bool:
    return (a.width, a.height) == (b.width, b.height) and np.array_equal(a.clip_to_world, b.clip_to_world)
