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


def part_of(whole: Shape, chosen: NDArray[np.bool_]) -> Shape:
    """The chosen triangles (T,), and the vertices that they use."""
    used, rows = np.unique(whole.triangles[chosen], return_inverse=True)
    return shape(whole.vertices[used], rows)


def copies(part: Shape, matrices: ArrayLike, positions: ArrayLike) -> Shape:
    """A copy of `part` for each of `positions` (N, 3), turned and scaled by `matrices` (N, 3, 3) or (3, 3)."""
    places = np.asarray(positions, np.float64).reshape(-1, 3)
    turned = part.vertices.astype(np.float64) @ np.swapaxes(np.asarray(matrices, np.float64), -1, -2)
    starts = np.arange(len(places), dtype=np.uint32) * np.uint32(len(part.vertices))
    return shape(turned + places[:, None], part.triangles + starts[:, None, None])


def scaled(part: Shape, factors: ArrayLike, positions: ArrayLike) -> Shape:
    """A copy of `part` for each of `positions` (N, 3), as large as `factors` say: (N,) or (N, 3), one for each axis."""
    places = np.asarray(positions, np.float64).reshape(-1, 3)
    sizes = np.asarray(factors, np.float64).reshape(len(places), 1, -1)
    starts = np.arange(len(places), dtype=np.uint32) * np.uint32(len(part.vertices))
    return shape(part.vertices * sizes + places[:, None], part.triangles + starts[:, None, None])


def quads(columns: int, rows: int) -> NDArray[np.uint32]:
    """(2 · columns · rows, 3): two triangles a cell of a grid of (rows + 1) x (columns + 1) vertices, row by row."""
    corner = np.arange(rows, dtype=np.uint32)[:, None] * np.uint32(columns + 1) + np.arange(columns, dtype=np.uint32)
    corner = corner.reshape(-1, 1)
    right, above = corner + np.uint32(1), corner + np.uint32(columns + 1)
    return np.hstack([corner, right, above, above, right, above + np.uint32(1)]).reshape(-1, 3)


def surface(points: NDArray[np.float64]) -> Shape:
    """2 · (rows - 1) · (columns - 1) triangles over a grid of points (rows, columns, 3)."""
    rows, columns, _ = points.shape
    return shape(points, quads(columns - 1, rows - 1))


def soup_of(corners: ArrayLike) -> Shape:
    """(T, 3, 3) corners, shared by no two triangles."""
    points = np.asarray(corners).reshape(-1, 3)
    return shape(points, np.arange(len(points)))


def box() -> Shape:
    """12 triangles from -1 to 1."""
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return shape(points, [[(a, b, c), (a, c, d)] for a, b, c, d in sides])


def ground(height: float, radius: float, centre: tuple[float, float] = (0, 0)) -> Shape:
    """2 triangles in the plane y = `height`."""
    x, z = centre
    corners = [(x - radius, z - radius), (x + radius, z - radius), (x + radius, z + radius), (x - radius, z + radius)]
    return shape([(a, height, b) for a, b in corners], [(0, 2, 1), (0, 3, 2)])


def sphere(level: int, octants: int = 8) -> Shape:
    """`octants` · 4^level triangles on the unit sphere, from an octahedron; each vertex is stored once."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float64)
    faces = [(0, 4, 2), (2, 4, 1), (1, 4, 3), (3, 4, 0), (2, 5, 0), (1, 5, 2), (3, 5, 1), (0, 5, 3)]
    triangles = np.array(faces[8 - octants :], np.int64)
    for _ in range(level):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        # One number an edge: sorting those is faster than sorting rows.
        unique, rows = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_inverse=True)
        ends = np.stack([unique // len(vertices), unique % len(vertices)], axis=1)
        middle = rows.reshape(-1, 3) + len(vertices)
        vertices = np.concatenate([vertices, vertices[ends].mean(axis=1)])
        a, b, c = triangles.T
        ab, bc, ca = middle.T
        triangles = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    used, rows = np.unique(triangles, return_inverse=True)
    vertices = vertices[used]
    return shape(vertices / np.linalg.norm(vertices, axis=1, keepdims=True), rows)


def tube(sides: int, segments: int = 1) -> Shape:
    """2 · sides · segments triangles: an open cylinder around y, of radius 1, from y = 0 to 1."""
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    height = np.linspace(0, 1, segments + 1)[:, None]
    around = np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=1)
    return surface(around[None] + height[..., None] * [0, 1, 0])


def ring(sides: int, segments: int, thickness: float) -> Shape:
    """2 · sides · segments triangles: a torus around y of radius 1."""
    around = np.linspace(0, 2 * np.pi, segments + 1)[:, None]
    across = np.linspace(0, 2 * np.pi, sides + 1)[None]
    radius = 1 + thickness * np.cos(across)
    height = np.broadcast_to(thickness * np.sin(across), (segments + 1, sides + 1))
    return surface(np.stack([radius * np.cos(around), height, radius * np.sin(around)], axis=2))


def along(directions: ArrayLike) -> NDArray[np.float64]:
    """(N, 3, 3) rotations that take y to unit `directions` (N, 3)."""
    y = np.asarray(directions, np.float64).reshape(-1, 3)
    helper = np.where(np.abs(y[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 0, 1.0]])
    x = np.cross(y, helper)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=2)
