"""Cameras for tests, from the matrices that OpenGL defines."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def look_at(eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0, 0, 1)) -> NDArray[np.float64]:
    """(4, 4) camera to world: looks along its -z at the target, y upwards."""
    position, aim = np.asarray(eye, float), np.asarray(target, float)
    z = (position - aim) / np.linalg.norm(position - aim)
    x = np.cross(np.asarray(up, float), z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = x, np.cross(z, x), z, position
    return matrix


def perspective(half_width: float, half_height: float, near: float, far: float) -> NDArray[np.float64]:
    """(4, 4) camera to clip: half sizes are those of the near plane."""
    depth = far - near
    return np.array(
        [
            [near / half_width, 0, 0, 0],
            [0, near / half_height, 0, 0],
            [0, 0, -(far + near) / depth, -2 * far * near / depth],
            [0, 0, -1, 0],
        ]
    )


def orthographic(half_width: float, half_height: float, near: float, far: float) -> NDArray[np.float64]:
    """(4, 4) camera to clip."""
    depth = far - near
    return np.array(
        [
            [1 / half_width, 0, 0, 0],
            [0, 1 / half_height, 0, 0],
            [0, 0, -2 / depth, -(far + near) / depth],
            [0, 0, 0, 1],
        ]
    )


def clip_to_world(camera_to_world: NDArray[np.float64], projection: NDArray[np.float64]) -> NDArray[np.float64]:
    return camera_to_world @ np.linalg.inv(projection)
