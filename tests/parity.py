"""The truth about crossings and insides, in rational arithmetic; it shares no code with the product.

A ray is moved by (ε, ε², ε³) for a real ε, so small that no number made of the coordinates is between it and 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.meshes import Triangles
from tests.oracle import Oracle, Point, crossing, exact

EPSILON = Fraction(1, 2**500)
"""For coordinates that are whole multiples of 2^-100 and below 2^40: edge values and the factors of ε in them are whole
multiples of 2^-300 and below 2^130, so the first that is not zero decides."""


def counts(
    mesh: Triangles, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
) -> Iterator[int]:
    """For each ray, how many of the closed triangles that it hits the moved line crosses within their boundary."""
    oracle = Oracle(*mesh)
    corners = mesh.corners()
    hits = oracle.crossings(origins, directions, t_min, t_max)
    for origin, direction, found in zip(np.atleast_2d(origins), np.atleast_2d(directions), hits, strict=True):
        x, y, z = exact(origin)
        moved = (x + EPSILON, y + EPSILON**2, z + EPSILON**3)
        yield sum(_is_within(moved, exact(direction), corners[hit.triangle]) for hit in found)


def _is_within(origin: Point, direction: Point, corners: NDArray[np.floating]) -> bool:
    a, b, c = map(exact, corners)
    found = crossing(origin, direction, a, b, c)
    assert found is None or (found[1] and found[2] and found[1] + found[2] != 1), "ε is too large"
    return found is not None


def insides(mesh: Triangles, points: ArrayLike, seed: int = 1) -> Iterator[bool]:
    """For each point, whether it is on a triangle, or an odd number of them is met in a direction by chance."""
    oracle = Oracle(*mesh)
    corners = mesh.corners()
    rng = np.random.default_rng(seed)
    for point in np.atleast_2d(points):
        yield any(is_on(point, triangle) for triangle in _near(point, corners)) or _is_odd(oracle, point, rng)


def _is_odd(oracle: Oracle, point: NDArray[np.floating], rng: np.random.Generator) -> bool:
    while True:
        [hits] = oracle.crossings(point, rng.normal(size=3))
        if all(hit.u > 0 and hit.v > 0 and hit.u + hit.v < 1 for hit in hits):
            return len(hits) % 2 == 1


def _near(point: NDArray[np.floating], corners: NDArray[np.floating]) -> NDArray[np.floating]:
    """The triangles whose boxes hold the point."""
    inside = (corners.min(axis=1) <= point) & (point <= corners.max(axis=1))
    return corners[inside.all(axis=1)]


def is_on(point: ArrayLike, corners: NDArray[np.floating]) -> bool:
    """Whether a point is on a closed triangle with area."""
    p, a, b, c = map(exact, (point, *corners))
    along = [[x - start for x, start in zip(end, a, strict=True)] for end in (p, b, c)]
    ap, ab, ac = (np.array(vector, object) for vector in along)
    normal = np.cross(ab, ac)
    if not normal.any() or normal @ ap != 0:
        return False
    u, v = (normal @ np.cross(ap, ac), normal @ np.cross(ab, ap))
    return bool(u >= 0 and v >= 0 and u + v <= normal @ normal)
