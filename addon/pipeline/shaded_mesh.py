"""A mesh as triangles with a colour at each corner, ready to be drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

GREY = (0.72, 0.72, 0.72)
LIGHT = np.array([0.4, -0.5, 0.77])
"""Where the light of a mesh without materials comes from."""


def corner_positions(vertices: NDArray[np.floating[Any]], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    """(3 T, 3)."""
    return np.ascontiguousarray(vertices[triangles.ravel()], np.float32)


def grey_corners(vertices: NDArray[np.floating[Any]], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    """(3 T, 4) a grey that tells which way each triangle faces."""
    a, b, c = (vertices[triangles[:, corner]].astype(np.float64) for corner in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    facing = np.abs(normals / np.where(lengths > 0, lengths, 1.0) @ (LIGHT / np.linalg.norm(LIGHT)))
    shade = (0.35 + 0.65 * facing)[:, None] * np.array(GREY)
    return np.repeat(np.column_stack([shade, np.ones(len(shade))]), 3, axis=0).astype(np.float32)
