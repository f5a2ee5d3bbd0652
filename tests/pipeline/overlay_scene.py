"""Two spheres on a floor, two cameras, and the ray through each pixel: what the tests of the overlay share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.pipeline.camera import CameraView, perspective_view
from tests import meshes
from tests.pipeline.naive_bih import INNER, LEAF, NODE_DTYPE

EYE, TARGET, UP = np.array([3.0, -6.5, 3.2]), np.array([0.1, 0.0, 0.5]), np.array([0.0, 0.0, 1.0])
FORWARD = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
NEAR, FAR = 0.5, 50.0


def spheres_on_a_floor() -> meshes.Triangles:
    large, small, floor = meshes.icosphere(2, 0.8), meshes.icosphere(1, 0.6), meshes.grid(6, 6)
    placed = [
        meshes.Triangles(large.vertices + np.float32([-1, 0, 0.8]), large.triangles),
        meshes.Triangles(small.vertices + np.float32([1.4, 0.5, 0.6]), small.triangles),
        meshes.Triangles((floor.vertices - np.float32([3, 3, 0])) * np.float32([0.75, 0.5, 1]), floor.triangles),
    ]
    return meshes.joined(*placed)


def perspective(width: int, height: int) -> CameraView:
    return perspective_view(EYE, TARGET, UP, width, height, field_of_view=0.8, near=NEAR, far=FAR)


def orthographic(width: int, height: int) -> CameraView:
    """Six units wide, shifted sideways by half a unit."""
    right = np.cross(FORWARD, UP) / np.linalg.norm(np.cross(FORWARD, UP))
    view = np.eye(4)
    view[:3, :3] = np.stack([right, np.cross(right, FORWARD), -FORWARD])
    view[:3, 3] = -view[:3, :3] @ EYE
    projection = np.diag([1 / 3, width / height / 3, -2 / (FAR - NEAR), 1.0])
    projection[0, 3] = 0.5 / 3
    projection[2, 3] = -(FAR + NEAR) / (FAR - NEAR)
    return CameraView(np.linalg.inv(projection @ view), width, height, NEAR, perspective=False)


def depth_along_axis(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of world points (..., 3), from the eye."""
    return (points - EYE) @ FORWARD


def rays(view: CameraView) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Through the middle of each pixel, from the near to the far plane: origins and ways (H, W, 3)."""
    y, x = np.mgrid[0 : view.height, 0 : view.width] + 0.5
    ends = []
    for z in (-1.0, 1.0):
        clip = np.stack([2 * x / view.width - 1, 2 * y / view.height - 1, np.full_like(x, z), np.ones_like(x)], axis=-1)
        world = clip @ view.clip_to_world.T
        ends.append(world[..., :3] / world[..., 3:])
    return ends[0], ends[1] - ends[0]


def crossing(
    view: CameraView, lower: NDArray[np.floating], upper: NDArray[np.floating], axis: int
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Where the pixels' rays cross the rectangle lower..upper, flat along axis, and at which depth (inf: nowhere)."""
    origins, ways = rays(view)
    t = (lower[axis] - origins[..., axis]) / ways[..., axis]
    points = origins + t[..., None] * ways
    others = [other for other in range(3) if other != axis]
    inside = ((lower[others] <= points[..., others]) & (points[..., others] <= upper[others])).all(axis=-1) & (t >= 0)
    return inside, np.where(inside, depth_along_axis(points), np.inf)


def through_box(view: CameraView, lower: NDArray[np.floating], upper: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Whether the pixels' rays meet the box."""
    origins, ways = rays(view)
    first, second = (lower - origins) / ways, (upper - origins) / ways
    return np.minimum(first, second).max(axis=-1) <= np.maximum(first, second).min(axis=-1)


def grown(mask: NDArray[np.bool_], pixels: int) -> NDArray[np.bool_]:
    """The mask and all within so many pixels of it, along both axes."""
    for axis in (0, 1):
        padded = np.pad(mask, [(pixels, pixels) if a == axis else (0, 0) for a in (0, 1)])
        size = mask.shape[axis]
        mask = np.any([padded.take(range(i, i + size), axis) for i in range(2 * pixels + 1)], axis=0)
    return mask


def one_node(
    clip: tuple[float, float] | None,
    axis: int = 0,
    lower: tuple[float, ...] = (-2, -1, 0),
    upper: tuple[float, ...] = (2, 1, 1.5),
    childless: int = LEAF,
) -> NDArray[np.void]:
    """A table of a root alone: inner with these clip planes, or without children, a leaf or not yet subdivided."""
    kind, planes = (INNER, clip) if clip else (childless, (np.nan, np.nan))
    return np.array([(-1, 0, kind, axis if clip else -1, planes, lower, upper, 0, 10)], NODE_DTYPE)
