"""The camera of a picture: one matrix, and what follows from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import UserError
from .settings import LARGEST_SIDE

Tile = tuple[int, int, int, int]
"""x, y, width and height in pixels from the lower left."""


@dataclass(frozen=True)
class CameraView:
    """clip_to_world (4, 4) float64 is the inverse of projection times view, as OpenGL and Blender have it.

    Pixel (0, 0) is the lower left one and covers [0, 1] x [0, 1]. `near` is the distance from the camera to the
    near clip plane: an orthographic matrix does not hold it, and depth is counted from the camera.
    """

    clip_to_world: NDArray[np.float64]
    width: int
    height: int
    near: float
    perspective: bool

    def __post_init__(self) -> None:
        check_size(self.width, self.height)

    @property
    def world_to_clip(self) -> NDArray[np.float64]:
        return _inverse(self.clip_to_world)

    def part(self, tile: Tile) -> CameraView:
        """What lies in some of the pixels, as a view of its own: their rays are the same, but for rounding."""
        x, y, width, height = tile
        crop = np.eye(4)
        crop[0, 0], crop[0, 3] = width / self.width, (2 * x + width) / self.width - 1.0
        crop[1, 1], crop[1, 3] = height / self.height, (2 * y + height) / self.height - 1.0
        return replace(self, clip_to_world=self.clip_to_world @ crop, width=width, height=height)

    def project(self, points: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
        """World points (N, 3) to (N, 4): x and y in pixels from the lower left, z in [-1, 1] from near to far, and w.

        Points with w <= 0 lie behind a perspective camera: their x, y, z mean nothing (clip before projecting).
        """
        clip = np.asarray(points, np.float64) @ self.world_to_clip[:, :3].T + self.world_to_clip[:, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            ndc = clip[:, :3] / clip[:, 3:]
        out = np.empty((len(clip), 4))
        out[:, 0] = (ndc[:, 0] + 1.0) * (0.5 * self.width)
        out[:, 1] = (ndc[:, 1] + 1.0) * (0.5 * self.height)
        out[:, 2] = ndc[:, 2]
        out[:, 3] = clip[:, 3]
        return out


def _inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The inverse. Rows are scaled first: where a scene is very small or large, pivots among rows of different scale
    would be rounding errors."""
    scale = np.abs(matrix).max(axis=1, keepdims=True)
    inverse: NDArray[np.float64] = np.linalg.inv(matrix / scale) / scale.T
    return inverse


def check_size(width: int, height: int) -> None:
    """Raise UserError unless a picture can be of this size."""
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise UserError(f"the picture is {width} x {height} pixels; both must be 1 to {LARGEST_SIDE}", exit_status=2)


def perspective_view(
    eye: NDArray[np.float64],
    target: NDArray[np.float64],
    up: NDArray[np.float64],
    width: int,
    height: int,
    *,
    field_of_view: float,
    near: float,
    far: float,
) -> CameraView:
    """A perspective camera at `eye` that looks at `target`; `field_of_view` in radians along the longer side."""
    check_size(width, height)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = np.stack([right, np.cross(right, forward), -forward])
    view[:3, 3] = -view[:3, :3] @ eye
    focal = 1.0 / np.tan(0.5 * field_of_view)
    longer = max(width, height)
    projection = np.zeros((4, 4))
    projection[0, 0] = focal * longer / width
    projection[1, 1] = focal * longer / height
    projection[2, 2] = (far + near) / (near - far)
    projection[2, 3] = 2.0 * far * near / (near - far)
    projection[3, 2] = -1.0
    return CameraView(_inverse(projection @ view), width, height, near, perspective=True)


def framing_view(bounds: NDArray[np.floating[Any]], width: int, height: int) -> CameraView:
    """A camera from the front right, a little above, that has the whole of bounds (2, 3) in the picture; Z is up."""
    check_size(width, height)
    lower, upper = np.asarray(bounds, np.float64)
    # A point has no size; the least radius is what float32 can tell apart at that place, or at the origin.
    single = np.finfo(np.float32)
    least = max(float(np.abs(bounds).max()) * float(single.eps), float(single.tiny))
    radius = max(0.5 * float(np.linalg.norm(upper - lower)), least)
    centre = 0.5 * (lower + upper)
    field_of_view = np.radians(40.0)
    narrow = np.arctan(np.tan(0.5 * field_of_view) * min(width, height) / max(width, height))
    distance = 1.05 * radius / np.sin(narrow)
    direction = np.array([0.55, -1.0, 0.45])
    eye = centre + direction * (distance / np.linalg.norm(direction))
    return perspective_view(
        eye,
        centre,
        np.array([0.0, 0.0, 1.0]),
        width,
        height,
        field_of_view=field_of_view,
        near=distance - radius * 1.04,
        far=distance + radius * 1.04,
    )


def distance_to_see(
    corners: NDArray[np.floating[Any]], slopes: tuple[float, float], *, perspective: bool = True
) -> float:
    """How far from the origin an eye that looks at it sees all of corners (N, 3), which are in its own axes: x to the
    right, y up, z towards it. `slopes` are half the width and the height of what it sees, at distance 1. In parallel
    the picture is as large as that of a perspective eye is around the origin."""
    x, y, z = np.abs(corners[:, 0]), np.abs(corners[:, 1]), corners[:, 2]
    nearer = z if perspective else 0.0
    return float(max((x / slopes[0] + nearer).max(), (y / slopes[1] + nearer).max()))
