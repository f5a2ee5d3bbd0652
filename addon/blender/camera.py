"""Blender's camera as one matrix."""

from __future__ import annotations

import bpy
import numpy as np

from ..pipeline.camera import CameraView, Tile
from ..pipeline.errors import UserError


def camera_view(camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph, width: int, height: int) -> CameraView:
    """What `camera` sees in width x height pixels: shift, sensor fit, pixel aspect and orthographic included.

    Any object may be a camera, as in Blender; its scale is left out. Raises UserError for a panoramic camera.
    """
    check_not_panoramic(camera)
    render = depsgraph.scene_eval.render
    projection = np.array(
        camera.calc_matrix_camera(
            depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y
        ),
        np.float64,
    )
    return _view(projection, _without_scale(camera), width, height)


def scene_view(depsgraph: bpy.types.Depsgraph, width: int, height: int) -> CameraView | None:
    """What the scene's camera sees; None where there is none. Raises UserError as `camera_view` does."""
    camera = depsgraph.scene_eval.camera
    return camera_view(camera, depsgraph, width, height) if camera else None


def viewport_view(region: bpy.types.Region, data: bpy.types.RegionView3D) -> CameraView:
    """What a viewport shows, also through the scene's camera: its lens, zoom, shift and clip range."""
    to_world = np.linalg.inv(np.array(data.view_matrix, np.float64))
    return _view(np.array(data.window_matrix, np.float64), to_world, region.width, region.height)


def viewport_border(
    scene: bpy.types.Scene, space: bpy.types.SpaceView3D, data: bpy.types.RegionView3D, whole: CameraView
) -> Tile:
    """The part of the viewport `whole` that is asked for: the render region of the scene where it is looked at through
    a camera, else the viewport's own; all of it where there is none. At least a pixel."""
    if data.view_perspective == "CAMERA" and space.camera and space.camera.type == "CAMERA":
        render = scene.render
        is_set, first, last = render.use_border, *_frame(scene, space.camera, whole)
        lower, upper = (render.border_min_x, render.border_min_y), (render.border_max_x, render.border_max_y)
    else:
        is_set, first, last = space.use_render_border, np.zeros(2), np.array([whole.width, whole.height], float)
        lower = space.render_border_min_x, space.render_border_min_y
        upper = space.render_border_max_x, space.render_border_max_y
    if not is_set:
        return 0, 0, whole.width, whole.height
    sides = np.array([whole.width, whole.height])
    left, bottom = np.clip(np.round(first + (last - first) * lower), 0, sides - 1).astype(int).tolist()
    right, top = np.clip(np.round(first + (last - first) * upper), 1, sides).astype(int).tolist()
    return left, bottom, max(right - left, 1), max(top - bottom, 1)


def picture_size(scene: bpy.types.Scene, *, least: int = 1) -> tuple[int, int]:
    """Pixels of the scene's picture, at least so many a side."""
    render = scene.render
    sides = (render.resolution_x, render.resolution_y)
    width, height = (max(least, side * render.resolution_percentage // 100) for side in sides)
    return width, height


def check_not_panoramic(camera: bpy.types.Object) -> None:
    """Raise UserError for a camera whose picture no matrix makes."""
    if camera.type == "CAMERA" and camera.data.type not in {"PERSP", "ORTHO"}:
        raise UserError(
            f"camera {camera.name!r} is panoramic, which is not supported. "
            "Choose Perspective or Orthographic in the camera's Lens panel."
        )


def _view(projection: np.ndarray, camera_to_world: np.ndarray, width: int, height: int) -> CameraView:
    clip_to_camera = np.linalg.inv(projection)
    near = clip_to_camera @ (0.0, 0.0, -1.0, 1.0)
    return CameraView(
        clip_to_world=camera_to_world @ clip_to_camera,
        width=width,
        height=height,
        near=float(-near[2] / near[3]),
        perspective=bool(projection[3, 3] == 0.0),
    )


def _frame(scene: bpy.types.Scene, camera: bpy.types.Object, view: CameraView) -> tuple[np.ndarray, np.ndarray]:
    """Where the lower left and the upper right corner of the scene's picture are in `view`, in pixels."""
    to_world = _without_scale(camera)
    corners = np.array(camera.data.view_frame(scene=scene)) @ to_world[:3, :3].T + to_world[:3, 3]
    places = view.project(corners)[:, :2]
    return places.min(axis=0), places.max(axis=0)


def _without_scale(camera: bpy.types.Object) -> np.ndarray:
    matrix = np.array(camera.matrix_world, np.float64)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if not (np.isfinite(matrix).all() and lengths.all()):
        raise UserError(
            f"camera {camera.name!r}: its transform is singular, NaN or infinite. "
            "Apply its scale (Object > Apply > Scale), or clear its transform."
        )
    matrix[:3, :3] /= lengths
    return matrix
