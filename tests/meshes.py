"""Meshes for tests: some by formula, some the shared models beside the repository."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import ArrayLike, DTypeLike, NDArray

SHARED = Path(__file__).resolve().parents[2] / "shared" / "meshes"


class Triangles(NamedTuple):
    """vertices (V, 3) float32 or float64, triangles (T, 3) int32 rows of them."""

    vertices: NDArray[np.floating]
    triangles: NDArray[np.int32]

    def corners(self) -> NDArray[np.floating]:
        """(T, 3, 3): the three vertices of each triangle."""
        return self.vertices[self.triangles]

    def astype(self, dtype: DTypeLike) -> Triangles:
        return Triangles(self.vertices.astype(dtype), self.triangles)


def shared_mesh_path(name: str) -> Path:
    """The .npz of a shared model; where there is none the test skips, and under CI it fails."""
    path = SHARED / f"{name}.npz"
    if not path.exists():
        reason = f"the shared mesh {name}.npz is not in ../shared/meshes beside the repository"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    return path


def shared_mesh(name: str) -> Triangles:
    """A shared model by its name, such as "stanford-bunny"."""
    with np.load(shared_mesh_path(name), allow_pickle=False) as archive:
        return Triangles(archive["vertices"], archive["triangles"].astype(np.int32))


def _mesh(vertices: ArrayLike, triangles: ArrayLike, dtype: DTypeLike) -> Triangles:
    corners = np.asarray(vertices, np.float64).reshape(-1, 3)
    return Triangles(np.ascontiguousarray(corners, dtype), np.asarray(triangles, np.int32).reshape(-1, 3))


def from_corners(corners: ArrayLike, dtype: DTypeLike = np.float32) -> Triangles:
    """(T, 3, 3) corners, shared by no two triangles."""
    points = np.asarray(corners, np.float64).reshape(-1, 3)
    return _mesh(points, np.arange(len(points)), dtype)


def joined(*meshes: Triangles) -> Triangles:
    """The rows of the meshes, one after another."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    triangles = [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]
    return Triangles(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(triangles).astype(np.int32))


def icosphere(level: int, radius: float = 1.0, dtype: DTypeLike = np.float32) -> Triangles:
    """A closed sphere of 20 · 4^level triangles; each vertex is stored once."""
    golden = (1 + 5**0.5) / 2
    corners = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0)]
    points = [np.roll(corner, shift) for shift in range(3) for corner in corners]
    vertices = np.array(points, np.float64)
    near = np.isclose(np.linalg.norm(vertices[:, None] - vertices[None], axis=2), 2)
    faces = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ]
    triangles = np.array(faces)
    inward = np.linalg.det(vertices[triangles]) < 0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    for _ in range(level):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        unique, rows = np.unique(edges, axis=0, return_inverse=True)
        middle = rows.reshape(-1, 3) + len(vertices)
        vertices = np.concatenate([vertices, vertices[unique].mean(axis=1)])
        a, b, c = triangles.T
        ab, bc, ca = middle.T
        triangles = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    vertices *= radius / np.linalg.norm(vertices, axis=1, keepdims=True)
    return _mesh(vertices, triangles, dtype)


def _quads(columns: int, rows: int) -> NDArray[np.int64]:
    """Two triangles a cell of a (rows + 1) x (columns + 1) grid of vertices, row by row."""
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1, 1)
    right, above = corner + 1, corner + columns + 1
    return np.hstack([corner, right, above, above, right, above + 1]).reshape(-1, 3)


def grid(columns: int, rows: int, dtype: DTypeLike = np.float32) -> Triangles:
    """2 · columns · rows triangles in the plane z = 0 on integer coordinates."""
    y, x = np.mgrid[0 : rows + 1, 0 : columns + 1]
    return _mesh(np.stack([x, y, np.zeros_like(x)], axis=2), _quads(columns, rows), dtype)


def terrain(size: int, seed: int = 1, dtype: DTypeLike = np.float32) -> Triangles:
    """2 · size² triangles over the unit square: a sum of octaves of random waves."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0 : size + 1, 0 : size + 1] / size
    height = np.zeros_like(x)
    for octave in range(6):
        frequency = 2**octave * rng.uniform(1, 2, 2)
        phase = rng.uniform(0, 2 * np.pi, 2)
        height += (
            0.2
            * 0.5**octave
            * np.sin(2 * np.pi * frequency[0] * x + phase[0])
            * np.cos(2 * np.pi * frequency[1] * y + phase[1])
        )
    return _mesh(np.stack([x, y, height], axis=2), _quads(size, size), dtype)


def soup(count: int, size: float = 0.1, seed: int = 1, dtype: DTypeLike = np.float32) -> Triangles:
    """Unconnected random triangles in the unit cube, each about `size` wide."""
    rng = np.random.default_rng(seed)
    return from_corners(rng.random((count, 1, 3)) + size * rng.uniform(-0.5, 0.5, (count, 3, 3)), dtype)


def gears(count: int, teeth: int, dtype: DTypeLike = np.float32) -> Triangles:
    """count · 8 · teeth long thin triangles: toothed discs on one axle, each thicker than its distance to the next."""
    tooth = np.array([0.0, 0.5, 0.5, 1.0])
    angle = ((np.arange(teeth)[:, None] + tooth) * (2 * np.pi / teeth)).ravel()
    radius = np.tile([1.0, 1.0, 0.8, 0.8], teeth)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros_like(angle)], axis=1)
    here = np.arange(4 * teeth)
    fan = np.stack([np.full_like(here, 4 * teeth), here, np.roll(here, -1)], axis=1)
    discs = []
    for number in range(count):
        height = 0.05 * number
        discs.append(_mesh(np.vstack([rim + [0, 0, height], [[0, 0, height + 0.2]]]), fan, dtype))
        discs.append(_mesh(np.vstack([rim + [0, 0, height], [[0, 0, height - 0.2]]]), fan[:, ::-1], dtype))
    return joined(*discs)


def spiral(count: int, dtype: DTypeLike = np.float32) -> Triangles:
    """A band of `count` triangles that winds up the z axis and shrinks, as a seashell does."""
    step = np.arange(count + 2)
    angle, radius = step * 0.1, 0.999**step
    height = step * 0.01 + 0.2 * (step % 2)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
    return _mesh(points, step[:count, None] + [0, 1, 2], dtype)


def box(lower: ArrayLike = (0, 0, 0), upper: ArrayLike = (1, 1, 1), dtype: DTypeLike = np.float32) -> Triangles:
    """12 triangles, two a side, in the order -x, +x, -y, +y, -z, +z."""
    low, high = np.asarray(lower, np.float64), np.asarray(upper, np.float64)
    points = [[(low, high)[i][0], (low, high)[j][1], (low, high)[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return _mesh(points, [[(a, b, c), (a, c, d)] for a, b, c, d in sides], dtype)


def sheets(count: int, spacing: float = 0.0, dtype: DTypeLike = np.float32) -> Triangles:
    """`count` copies of one triangle, stacked along z at the given spacing (0: coincident)."""
    corners = np.tile(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float64), (count, 1, 1))
    corners[:, :, 2] = np.arange(count)[:, None] * spacing
    return from_corners(corners, dtype)
