"""Rendered mode in a 3D viewport: reads the scene, tells the session what to show, and draws its newest picture.

The session's thread never touches bpy: a timer asks it for news, in Blender's own thread.
"""

from __future__ import annotations

import weakref

import bpy
import numpy as np

from ..pipeline.camera import CameraView, Tile
from ..pipeline.looks import Reading
from ..pipeline.mesh_cache import MeshCache
from ..pipeline.scene import SceneData
from ..pipeline.session import Session, Shown
from ..pipeline.settings import Settings
from .camera import check_not_panoramic, viewport_border, viewport_view
from .export import contents
from .properties import settings_of

TICK = 0.02
"""Seconds between two looks for a new picture."""

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
        self._drawn: Shown | None = None
        self._texture = None
        self._poll = None

    def update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """The scene has changed."""
        scene = depsgraph.scene_eval
        self._settings = settings_of(scene)
        reading = Reading.of(self._settings, ("combined",))
        self._scene = contents(depsgraph, meshes=self._meshes, space=context.space_data, reading=reading)
        self._samples = scene.bih.viewport_samples
        self._view = None

    def draw(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, scene: bpy.types.Scene) -> None:
        if self._scene is None or self._settings is None:
            return
        seen = context.region_data
        if seen.view_perspective == "CAMERA" and context.space_data.camera:
            check_not_panoramic(context.space_data.camera)
        whole, pixel_size = viewport_view(context.region, seen), engine.get_preview_pixel_size(scene)
        self._place = viewport_border(scene, context.space_data, seen, whole)
        view = whole.part(self._place)
        if self._view is None or not _are_same(view, self._view) or pixel_size != self._pixel_size:
            self._view, self._pixel_size = view, pixel_size
            self._session.show(self._scene, self._settings, view, samples=self._samples, pixel_size=pixel_size)
            self._session.wait(PATIENCE)
        self._tell(engine)
        shown = self._session.shown
        if shown is None:
            self._drawn = self._texture = None
        else:
            self._draw(shown, engine, scene)
        self._keep_looking(engine)

    def _tell(self, engine: bpy.types.RenderEngine) -> None:
        notes = "; ".join(self._scene.skipped) if self._scene else ""
        engine.update_stats(self._session.problem or self._session.activity, notes)

    def _draw(self, shown: Shown, engine: bpy.types.RenderEngine, scene: bpy.types.Scene) -> None:
        """Over all that is asked for: a picture of another size is stretched."""
        import gpu
        from gpu_extras.presets import draw_texture_2d

        if self._texture is None or shown is not self._drawn:
            height, width, _ = shown.pixels.shape
            pixels = gpu.types.Buffer("FLOAT", shown.pixels.size, np.ascontiguousarray(shown.pixels).ravel())
            self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=pixels)
            self._drawn = shown
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
        return bool(self._session.activity) or self._session.shown is not self._drawn

    def _has_news(self) -> bool:
        return self._session.shown is not self._drawn or bool(self._session.problem)


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
