"""How a scene is looked at."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..pipeline.camera import CameraView, perspective_view
from .shapes import Shape

Point = tuple[float, float, float]


class View(NamedTuple):
    """Where a picture is taken from; `angle` is the vertical one, in degrees; `light` is a point light."""

    eye: Point
    target: Point
    up: Point
    angle: float
    light: Point


class Scene(NamedTuple):
    """A mesh and how it is looked at."""

    mesh: Shape
    view: View


def _point(values: ArrayLike) -> Point:
    x, y, z = np.asarray(values, np.float64).tolist()
    return x, y, z


def framed(mesh: Shape, towards: ArrayLike, up: Point = (0, 1, 0), angle: float = 35) -> View:
    """The whole of the mesh, seen from where `towards` points to; the light stands to the right and above."""
    lower, upper = mesh.vertices.min(axis=0).astype(np.float64), mesh.vertices.max(axis=0).astype(np.float64)
    centre, radius = (lower + upper) / 2, float(np.linalg.norm(upper - lower)) / 2
    direction = np.asarray(towards, np.float64) / np.linalg.norm(towards)
    # 0.8: the sphere around a mesh is seldom full.
    eye = centre + direction * (0.8 * radius / np.sin(np.radians(angle) / 2))
    right = np.cross(up, direction)
    light = centre + 3 * radius * (direction + right + np.asarray(up))
    return View(_point(eye), _point(centre), up, angle, _point(light))


def camera_of(scene: Scene, width: int, height: int) -> CameraView:
    """The view as a camera whose clip planes have all of the mesh between them, but for what is at the eye itself."""
    mesh, view = scene
    eye, target, up = (np.asarray(point, np.float64) for point in (view.eye, view.target, view.up))
    ends = np.stack([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]).astype(np.float64)
    far = 1.01 * float(np.linalg.norm(np.maximum(np.abs(ends[0] - eye), np.abs(ends[1] - eye))))
    longer = np.tan(0.5 * np.radians(view.angle)) * max(width, height) / height
    return perspective_view(
        eye, target, up, width, height, field_of_view=2 * np.arctan(longer), near=1e-3 * far, far=far
    )
