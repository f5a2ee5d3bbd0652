"""Rays for tests, all from a seed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tests.meshes import Triangles


class Rays(NamedTuple):
    """origins and directions, both (N, 3)."""

    origins: NDArray[np.floating]
    directions: NDArray[np.floating]


def joined(*parts: Rays) -> Rays:
    return Rays(np.concatenate([part.origins for part in parts]), np.concatenate([part.directions for part in parts]))


def bounds(mesh: Triangles) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner of the finite vertices that triangles use."""
    points = mesh.vertices[np.unique(mesh.triangles)].astype(np.float64)
    points = points[np.isfinite(points).all(axis=1)]
    return points.min(axis=0), points.max(axis=0)


def _between(origins: NDArray[np.float64], targets: NDArray[np.float64], dtype: DTypeLike) -> Rays:
    """Origins first rounded, so that each ray still aims at its target."""
    start = origins.astype(dtype)
    return Rays(start, (targets - start).astype(dtype))


def around(mesh: Triangles, count: int, rng: np.random.Generator, dtype: DTypeLike = np.float32) -> Rays:
    """From a sphere about the mesh to random points of its box."""
    low, high = bounds(mesh)
    middle, radius = (low + high) / 2, np.linalg.norm(high - low)
    away = rng.normal(size=(count, 3))
    origins = middle + radius * away / np.linalg.norm(away, axis=1, keepdims=True)
    return _between(origins, rng.uniform(low, high, (count, 3)), dtype)


def at_features(mesh: Triangles, count: int, rng: np.random.Generator, dtype: DTypeLike = np.float32) -> Rays:
    """From a sphere about the mesh to vertices, middles of edges, and points of edges, a third each."""
    low, high = bounds(mesh)
    away = rng.normal(size=(count, 3))
    away *= np.linalg.norm(high - low) / np.linalg.norm(away, axis=1, keepdims=True)
    row = rng.integers(0, len(mesh.triangles), count)
    start, end = (mesh.vertices[mesh.triangles[row, corner]].astype(np.float64) for corner in (0, 1))
    weight = np.choose(np.arange(count) % 3, [0.0, 0.5, rng.random(count)])[:, None]
    return _between((low + high) / 2 + away, start + weight * (end - start), dtype)


def pinhole(mesh: Triangles, width: int, height: int, axis: int = 2, dtype: DTypeLike = np.float32) -> Rays:
    """A camera before the middle of the mesh's box, looking along -axis; its pixels are a lattice on the near side."""
    low, high = bounds(mesh)
    targets = _lattice(low, high, width, height, axis)
    eye = (low + high) / 2
    eye[axis] = high[axis] + np.linalg.norm(high - low)
    return _between(np.broadcast_to(eye, targets.shape), targets, dtype)


def parallel(mesh: Triangles, width: int, height: int, axis: int = 2, dtype: DTypeLike = np.float32) -> Rays:
    """The same lattice seen by an orthographic camera: directions with two zero components."""
    low, high = bounds(mesh)
    origins = _lattice(low, high, width, height, axis)
    origins[:, axis] = high[axis] + (high - low).max()
    directions = np.zeros_like(origins)
    directions[:, axis] = -1
    return Rays(origins.astype(dtype), directions.astype(dtype))


def _lattice(
    low: NDArray[np.float64], high: NDArray[np.float64], width: int, height: int, axis: int
) -> NDArray[np.float64]:
    """(width · height, 3) points of the box's upper side on `axis`, its boundary and corners among them."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    points = np.empty((height, width, 3))
    points[..., a] = np.linspace(low[a], high[a], width)
    points[..., b] = np.linspace(low[b], high[b], height)[:, None]
    points[..., axis] = high[axis]
    return points.reshape(-1, 3)
