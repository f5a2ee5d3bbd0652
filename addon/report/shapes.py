"""Parts that scenes are made of: float32 vertices, uint32 triangles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Shape(NamedTuple):
    """vertices (V, 3) float32, triangles (T, 3) uint32 rows of them."""

    vertices: NDArray[np.float32]
    triangles: NDArray[np.uint32]


def shape(vertices: ArrayLike, triangles: ArrayLike) -> Shape:
    """Of any arrays that reshape to rows of three."""
    return Shape(
        np.ascontiguousarray(vertices, np.float32).reshape(-1, 3),
        np.ascontiguousarray(triangles, np.uint32).reshape(-1, 3),
    )


def joined(*shapes: Shape) -> Shape:
    """The rows of all, one after another."""
    starts = np.cumsum([0] + [len(part.vertices) for part in shapes[:-1]])
    triangles = [part.triangles + np.uint32(start) for part, start in zip(shapes, starts, strict=True)]
    return shape(np.concatenate([part.vertices for part in shapes]), np.concatenate(triangles))


def copies(part: Shape, rotations: ArrayLike, positions: ArrayLike) -> Shape:
    """One copy of `part` for each row of `rotations` (N, 3, 3) or (3, 3), scaling included, and `positions` (N, 3)."""
    places = np.asarray(positions, np.float64)
    turned = np.asarray(part.vertices, np.float64) @ np.swapaxes(np.asarray(rotations, np.float64), -1, -2)
    vertices = turned + places[:, None]
    starts = np.arange(len(places), dtype=np.uint32) * np.uint32(len(part.vertices))
    return shape(vertices, part.triangles + starts[:, None, None])


def quads(columns: int, rows: int) -> NDArray[np.uint32]:
    """(2 · columns · rows, 3): two triangles a cell of a grid of (rows + 1) x (columns + 1) vertices, row by row."""
    corner = np.arange(rows, dtype=np.uint32)[:, None] * np.uint32(columns + 1) + np.arange(columns, dtype=np.uint32)
    corner = corner.reshape(-1, 1)
    right, above = corner + np.uint32(1), corner + np.uint32(columns + 1)
    return np.hstack([corner, right, above, above, right, above + np.uint32(1)]).reshape(-1, 3)


def soup_of(corners: ArrayLike) -> Shape:
    """(T, 3, 3) corners, shared by no two triangles."""
    points = np.asarray(corners).reshape(-1, 3)
    return shape(points, np.arange(len(points)))
