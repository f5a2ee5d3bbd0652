"""Scans that nobody scanned: a closed surface subdivided after Loop and displaced at each level, to an exact count."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .shapes import Shape, shape
from .view import Scene, framed

Floats = NDArray[np.float64]
Rows = NDArray[np.int64]


def loop_subdivided(vertices: Floats, triangles: Rows) -> tuple[Floats, Rows]:
    """One step of Loop's scheme ("Smooth Subdivision Surfaces Based on Triangles", 1987) on a closed surface: four
    triangles for each, the old vertices first."""
    count = len(vertices)
    # Directed edges, and the corner opposite to each; a closed surface has each edge in both directions.
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    opposite = triangles[:, [2, 0, 1]].reshape(-1)
    key = edges.min(axis=1) * count + edges.max(axis=1)
    unique, rows = np.unique(key, return_inverse=True)
    ends = np.stack([unique // count, unique % count], axis=1)
    wings = np.zeros((len(unique), 3))
    for axis in range(3):
        wings[:, axis] = np.bincount(rows, vertices[opposite, axis], len(unique))
    middle = 0.375 * (vertices[ends[:, 0]] + vertices[ends[:, 1]]) + 0.125 * wings

    valence = np.bincount(ends.ravel(), minlength=count)
    around = np.zeros((count, 3))
    for axis in range(3):
        around[:, axis] = np.bincount(ends[:, 0], vertices[ends[:, 1], axis], count)
        around[:, axis] += np.bincount(ends[:, 1], vertices[ends[:, 0], axis], count)
    share = (0.625 - (0.375 + 0.25 * np.cos(2 * np.pi / valence)) ** 2) / valence
    moved = (1 - valence * share)[:, None] * vertices + share[:, None] * around

    a, b, c = triangles.T
    ab, bc, ca = rows.reshape(-1, 3).T + count
    finer = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    return np.concatenate([moved, middle]), finer


def _base(sides: int, segments: int) -> tuple[Floats, Rows]:
    """2 · sides · segments: a closed knotted tube, each vertex stored once."""
    a = (np.arange(segments) * 2 * np.pi / segments)[:, None]
    b = (np.arange(sides) * 2 * np.pi / sides)[None]
    out = 1 + 0.35 * np.cos(3 * a)
    spine = np.stack([out * np.cos(2 * a), 0.4 * np.sin(3 * a), out * np.sin(2 * a)], axis=2)
    ahead, behind = np.roll(spine, -1, axis=0), np.roll(spine, 1, axis=0)
    tangent = (ahead - behind) / np.linalg.norm(ahead - behind, axis=2, keepdims=True)
    across = np.cross(tangent, [0, 1.0, 0])
    across /= np.linalg.norm(across, axis=2, keepdims=True)
    upward = np.cross(across, tangent)
    points = spine + 0.2 * (np.cos(b)[..., None] * across + np.sin(b)[..., None] * upward)
    here = np.arange(segments)[:, None] * sides + np.arange(sides)[None]
    right, above = np.roll(here, -1, axis=1), np.roll(here, -1, axis=0)
    across_it = np.roll(above, -1, axis=1)
    rows = np.stack([here, right, above, above, right, across_it], axis=2).reshape(-1, 3)
    return points.reshape(-1, 3), rows


def _normals(vertices: Floats, triangles: Rows) -> Floats:
    """(V, 3) unit normals, of each vertex the sum of its triangles'."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    face = np.cross(b - a, c - a)
    sums = np.zeros_like(vertices)
    for axis in range(3):
        for corner in range(3):
            sums[:, axis] += np.bincount(triangles[:, corner], face[:, axis], len(vertices))
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    unit: Floats = sums / np.where(lengths > 0, lengths, 1)
    return unit


def _sizes(triangles: int) -> tuple[int, int, int]:
    """Sides and segments of the base and levels, so that hardly more triangles come out than asked for."""
    levels = max(0, round(np.log(triangles / 1_000) / np.log(4)))
    base = -(-triangles // (2 * 4**levels))
    sides = max(3, round((base / 6) ** 0.5))
    choices = [(max(3, -(-base // candidate)), candidate) for candidate in range(max(3, sides - 4), sides + 5)]
    segments, sides = min(choices, key=lambda pair: pair[0] * pair[1])
    return sides, segments, levels


def scan(triangles: int) -> Scene:
    """Exactly so many: a knot subdivided after Loop, rough at every level, with a hole where the surplus was cut."""
    sides, segments, levels = _sizes(triangles)
    vertices, rows = _base(sides, segments)
    rng = np.random.default_rng(29)
    for level in range(levels):
        vertices, rows = loop_subdivided(vertices, rows)
        rough = 0.02 * 0.55**level * rng.standard_normal(len(vertices))
        vertices += rough[:, None] * _normals(vertices, rows)
    surplus = len(rows) - triangles
    if surplus:
        # A scanner does not see the lowest part.
        height = vertices[rows, 1].sum(axis=1)
        kept = np.ones(len(rows), bool)
        kept[np.argpartition(height, surplus)[:surplus]] = False
        rows = rows[kept]
    used, compact = np.unique(rows, return_inverse=True)
    mesh: Shape = shape(vertices[used], compact)
    return Scene(mesh, framed(mesh, (0.3, 0.5, 1)))
