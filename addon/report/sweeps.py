"""Sweeps over stiffness: one thing grows by orders of magnitude; small meshes, and rays at their weak places."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from .scenes import stadium
from .shapes import box, sphere

Points = NDArray[np.float64]
Rows = NDArray[np.uint32]
Random = np.random.Generator


class Step(NamedTuple):
    """One k of a sweep: vertices (V, 3), triangles (T, 3) uint32, origins and directions (N, 3); floats of one type."""

    vertices: NDArray[np.floating[Any]]
    triangles: NDArray[np.uint32]
    origins: NDArray[np.floating[Any]]
    directions: NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Sweep:
    """A name of docs/accuracy.md, what is k there, and the values it takes."""

    name: str
    k_is: str
    ks: tuple[int, ...]
    _make: Callable[[int, int, Random, DTypeLike], Step]

    def at(self, k: int, rays: int, seed: int = 1, dtype: DTypeLike = np.float32) -> Step:
        """The mesh and so many rays for one k, the same for the same arguments."""
        # What is lost where numbers are rounded to the dtype belongs to the case.
        with np.errstate(under="ignore"):
            return self._make(k, rays, np.random.default_rng([seed, abs(k), k < 0]), dtype)


def _rounded(vertices: ArrayLike, dtype: DTypeLike) -> Points:
    """As the dtype has them, to aim at."""
    return np.asarray(vertices).astype(dtype).astype(np.float64)


def _spread(vertices: Points, triangles: Rows, count: int, random: Random) -> Points:
    """(count, 3) points of a mesh, of one kind after another: vertices, middles of edges, points of edges, inside."""
    corners = vertices[triangles[random.integers(0, len(triangles), count)]]
    weights = random.dirichlet([1, 1, 1], count)
    kind = np.arange(count) % 4
    weights[kind == 0] = [1, 0, 0]
    weights[kind == 1] = [0.5, 0.5, 0]
    on_edge = kind == 2
    weights[on_edge] = np.stack([weights[on_edge, 0], 1 - weights[on_edge, 0], 0 * weights[on_edge, 0]], axis=1)
    points: Points = (weights[:, :, None] * corners).sum(axis=1)
    return points


def _directions(count: int, random: Random) -> Points:
    away: Points = random.normal(size=(count, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    return away


def _aimed(vertices: Points, triangles: Rows, origins: Points, targets: Points, dtype: DTypeLike) -> Step:
    """Origins are rounded first, so that each ray still aims at its target; where that is the origin, along z."""
    start = origins.astype(dtype)
    directions = (targets - start).astype(dtype)
    directions[~directions.any(axis=1)] = [0, 0, 1]
    return Step(vertices.astype(dtype), triangles, start, directions)


def _from_around(vertices: Points, triangles: Rows, count: int, random: Random, dtype: DTypeLike) -> Step:
    """From a sphere about the mesh to points of it; each fifth ray to one of its box, which may pass it."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    radius = np.linalg.norm(high / 2 - low / 2) * 2
    targets = _spread(vertices, triangles, count, random)
    targets[::5] = random.uniform(low, high, targets[::5].shape)
    return _aimed(vertices, triangles, (low / 2 + high / 2) + radius * _directions(count, random), targets, dtype)


def _offset(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    ball = sphere(2)
    moved = _rounded(ball.vertices + 10.0**k * np.array([1, -1, 0.3]), dtype)
    return _from_around(moved, ball.triangles, count, random, dtype)


def _origin_distance(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    ball = sphere(2)
    vertices = _rounded(ball.vertices, dtype)
    targets = _spread(vertices, ball.triangles, count, random)
    return _aimed(vertices, ball.triangles, 10.0**k * 2 * _directions(count, random), targets, dtype)


def _sliver(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    """A bent strip, edge to edge, so that a ray through an edge hits both of its triangles or the nearer."""
    step = np.arange(60)
    points = np.stack([step % 2 + 0.01 * step, step * 10.0**-k, step % 3 * 10.0**-k], axis=1)
    vertices = _rounded(points, dtype)
    return _from_around(vertices, (step[:-2, None] + [0, 1, 2]).astype(np.uint32), count, random, dtype)


def _turn() -> Points:
    """A rotation without a zero in it: about (1, 2, 3) by 1 radian."""
    x, y, z = np.array([1, 2, 3]) / 14**0.5
    across: Points = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: Points = np.eye(3) + np.sin(1) * across + (1 - np.cos(1)) * across @ across
    return turn


def _grazing(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    solid = box()
    vertices = _rounded(solid.vertices @ _turn(), dtype)
    rows = np.arange(count) % len(solid.triangles)
    targets = np.empty((count, 3))
    origins = np.empty((count, 3))
    for row, triangle in enumerate(solid.triangles):
        chosen = rows == row
        targets[chosen] = _spread(vertices, triangle[None], int(chosen.sum()), random)
        a, b, c = vertices[triangle]
        normal = np.cross(b - a, c - a) / 4
        along = (b - a) + random.normal(size=(int(chosen.sum()), 1)) * (c - a)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        origins[chosen] = targets[chosen] - 6 * along + 6 * 10.0**-k * normal
    return _aimed(vertices, solid.triangles, origins, targets, dtype)


def _scale_ratio(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    """Two rays of three at the knot, one at the stadium."""
    whole = stadium(500, k).mesh
    vertices = _rounded(whole.vertices, dtype)
    is_small = (np.abs(vertices[whole.triangles]) < 2 * 10.0**-k).all(axis=(1, 2))
    small = whole.triangles[is_small]
    used = vertices[np.unique(small)]
    inner = _from_around(used, np.unique(small, return_inverse=True)[1].reshape(-1, 3), count, random, dtype)
    outer = _from_around(vertices, whole.triangles, count, random, dtype)
    is_outer = (np.arange(count) % 3 == 0)[:, None]
    origins = np.where(is_outer, outer.origins, inner.origins)
    return Step(outer.vertices, whole.triangles, origins, np.where(is_outer, outer.directions, inner.directions))


def _depth_complexity(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    """2^k sheets, two and two at one place and each two an ulp above those below; seen from above and below."""
    sheets = np.arange(2**k)
    corners = np.tile([[-1.0, -1, 0], [3, -1, 0], [-1, 3, 0]], (2**k, 1, 1))
    corners[:, :, 2] = 1 + (sheets // 2)[:, None] * float(np.spacing(np.ones((), dtype)))
    vertices, triangles = corners.reshape(-1, 3), np.arange(3 * 2**k, dtype=np.uint32).reshape(-1, 3)
    targets = _spread(vertices, triangles, count, random)
    origins = targets + _directions(count, random)
    origins[:, 2] = np.where(np.arange(count) % 2, 3, -1)
    return _aimed(vertices, triangles, origins, targets, dtype)


def _overlap(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    triangles = 216
    long = 2.0**k / triangles ** (1 / 3)
    centres = random.random((triangles, 1, 3))
    along = _directions(triangles, random)[:, None] * long / 2
    corners = centres + along * [[-1], [1], [1]] + 0.05 * random.uniform(-1, 1, (triangles, 3, 3))
    vertices = _rounded(corners.reshape(-1, 3), dtype)
    return _from_around(vertices, np.arange(3 * triangles, dtype=np.uint32).reshape(-1, 3), count, random, dtype)


def _direction(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    """One component or two are ±10^-k of the largest; for every fourth ray they are 0 or −0."""
    ball = sphere(2)
    vertices = _rounded(ball.vertices, dtype)
    rows, axis = np.arange(count), random.integers(0, 3, count)
    directions = random.choice([-1.0, 1.0], (count, 3)) * random.uniform(0.5, 1, (count, 3))
    size = np.where(rows % 4 == 3, 0, 10.0**-k)
    directions[rows, axis] = np.copysign(size, directions[rows, axis])
    both = rows % 2 == 1
    other = (axis + 1) % 3
    directions[rows[both], other[both]] = np.copysign(size, directions[rows, other])[both]
    directions = directions.astype(dtype)
    targets = _spread(vertices, ball.triangles, count, random)
    origins = (targets - 4 * directions.astype(np.float64)).astype(dtype)
    return Step(vertices.astype(dtype), ball.triangles, origins, directions)


def _magnitude(k: int, count: int, random: Random, dtype: DTypeLike) -> Step:
    ball = sphere(2)
    vertices = _rounded(np.ldexp(ball.vertices.astype(np.float64), k), dtype)
    return _from_around(vertices, ball.triangles, count, random, dtype)


SWEEPS = {
    sweep.name: sweep
    for sweep in (
        Sweep("offset", "the mesh is moved by 10^k of its size", tuple(range(10)), _offset),
        Sweep("origin distance", "rays start 10^k sizes away", tuple(range(10)), _origin_distance),
        Sweep("sliver", "triangles 10^k times as long as they are high", tuple(range(13)), _sliver),
        Sweep("grazing", "an angle of 10^-k between ray and surface", tuple(range(13)), _grazing),
        Sweep("scale ratio", "a knot of size 10^-k in a stadium of size 1", tuple(range(10)), _scale_ratio),
        Sweep("depth complexity", "2^k sheets at one place or an ulp apart", tuple(range(13)), _depth_complexity),
        Sweep("overlap", "triangles 2^k times as long as they are apart", tuple(range(7)), _overlap),
        Sweep("direction", "components 10^-k of the largest, and 0", tuple(range(46)), _direction),
        Sweep("magnitude", "all coordinates times 2^k", tuple(range(-140, 121, 20)), _magnitude),
    )
}
"""By name."""
