"""The truth about rays and triangles, in rational arithmetic; it shares no code with the product.

Every finite float is a fraction, so hit, miss, distance and order are decided without rounding. A triangle is closed:
its boundary is hit. One without area, with a coordinate that is not finite, or in the ray's plane is not hit.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Number = Fraction | int
Point = tuple[Number, Number, Number]

RANGE = 2.0**-300, 2.0**300  # of sizes whose products neither overflow nor lose bits to underflow


class Hit(NamedTuple):
    """One crossing: distance in units of the direction's length, the triangle's row, weights of its corners 2 and 3."""

    t: Fraction
    triangle: int
    u: Fraction
    v: Fraction


def exact(values: ArrayLike) -> Point:
    """Three finite floats as the fractions they are."""
    x, y, z = (Fraction(float(value)) for value in np.asarray(values))
    return x, y, z


def whole(points: NDArray[np.float64]) -> list[Point]:
    """Finite points (N, 3) times the one power of two that makes them whole: the same t and weights, found sooner."""
    ratios = [[value.as_integer_ratio() for value in point] for point in points.tolist()]
    scale = max(divisor for point in ratios for _, divisor in point)
    return [(x[0] * (scale // x[1]), y[0] * (scale // y[1]), z[0] * (scale // z[1])) for x, y, z in ratios]


def _minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Point, b: Point) -> Number:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def crossing(
    origin: Point, direction: Point, a: Point, b: Point, c: Point
) -> tuple[Fraction, Fraction, Fraction] | None:
    """(t, u, v) of the point in which the line meets the closed triangle, or None."""
    ab, ac = _minus(b, a), _minus(c, a)
    normal = _cross(ab, ac)
    slope = _dot(normal, direction)
    if slope == 0:  # without area, or parallel to the line
        return None
    from_a = _minus(origin, a)
    height = -_dot(normal, from_a)
    # The point met, seen from a, is from_a + t direction with t = height / slope; this is slope times it.
    x, y, z = (slope * start + height * step for start, step in zip(from_a, direction, strict=True))
    scale = slope * _dot(normal, normal)
    u = Fraction(_dot(normal, _cross((x, y, z), ac)), scale)
    v = Fraction(_dot(normal, _cross(ab, (x, y, z))), scale)
    return (Fraction(height, slope), u, v) if u >= 0 and v >= 0 and u + v <= 1 else None


def is_valid(origin: ArrayLike, direction: ArrayLike, t_min: float, t_max: float) -> bool:
    """False for what no answer can be given for: NaN, infinite origin or direction, zero direction, an empty limit."""
    finite = bool(np.isfinite(np.asarray(origin)).all() and np.isfinite(np.asarray(direction)).all())
    limits = not (np.isnan(t_min) or np.isnan(t_max)) and t_min < np.inf and t_max > -np.inf
    return finite and limits and bool(np.any(np.asarray(direction) != 0))


class Oracle:
    """All triangles of one mesh, (V, 3) floats and (T, 3) rows of them."""

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None:
        self.corners = np.asarray(vertices)[np.asarray(triangles).reshape(-1, 3)].astype(np.float64)
        self.rows = np.flatnonzero(np.isfinite(self.corners).all(axis=(1, 2)))
        self._filter = _Filter(self.corners[self.rows])

    def crossings(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> Iterator[list[Hit]]:
        """For each ray, every hit with t_min <= t <= t_max, nearest first and the lower row first where t is equal."""
        for ray in self._rays(origins, directions, t_min, t_max):
            hits = (self._hit(ray, row) for row in ray.rows.tolist())
            yield sorted((hit for hit in hits if hit), key=lambda hit: (hit.t, hit.triangle))

    def nearest(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> Iterator[list[Hit]]:
        """For each ray the hits at its smallest t, lower row first: more than one is a tie, none a miss."""
        for ray in self._rays(origins, directions, t_min, t_max):
            bounds = _lower_bounds(ray.origin, ray.direction, self.corners[ray.rows])
            best: list[Hit] = []
            for i in np.argsort(bounds):
                if best and bounds[i] > best[0].t:
                    break
                hit = self._hit(ray, int(ray.rows[i]))
                if hit and not (best and hit.t > best[0].t):
                    best = [*best, hit] if best and hit.t == best[0].t else [hit]
            yield sorted(best, key=lambda hit: hit.triangle)

    def closest(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> list[Hit | None]:
        """For each ray the nearest hit; of several at one t the lowest row; None for a miss."""
        return [hits[0] if hits else None for hits in self.nearest(origins, directions, t_min, t_max)]

    def _rays(self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike) -> Iterator[_Ray]:
        origin, direction = np.atleast_2d(origins).astype(np.float64), np.atleast_2d(directions).astype(np.float64)
        near = np.broadcast_to(np.asarray(t_min, np.float64), len(origin)).tolist()
        far = np.broadcast_to(np.asarray(t_max, np.float64), len(origin)).tolist()
        for i, candidates in enumerate(self._filter.candidates(origin, direction)):
            valid = is_valid(origin[i], direction[i], near[i], far[i])
            yield _Ray(origin[i], direction[i], near[i], far[i], self.rows[candidates if valid else []])

    def _hit(self, ray: _Ray, row: int) -> Hit | None:
        found = crossing(*whole(np.vstack([ray.origin, ray.direction, self.corners[row]])))
        return Hit(found[0], row, found[1], found[2]) if found and ray.t_min <= found[0] <= ray.t_max else None


class _Ray(NamedTuple):
    """One ray and the rows of the triangles that it may hit: none where it is invalid."""

    origin: NDArray[np.float64]
    direction: NDArray[np.float64]
    t_min: float
    t_max: float
    rows: NDArray[np.intp]


def _lower_bounds(
    origin: NDArray[np.float64], direction: NDArray[np.float64], corners: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A number for each triangle that no t of a hit is below.

    t = (p - o) . d / d . d for the point p that is hit, a mean of the corners, so no t is below the smallest of theirs.
    With P = max|c - o|, D = max|d| and u = 2^-53: (c - o) . d has 3 terms of at most P D with 4 roundings each; d . d
    and the division bring 4 more, relative to at most 3 P D / d . d. In all 24 u, below 2^-47, times P D / d . d.
    """
    with np.errstate(all="ignore"):
        away = corners - origin
        square = direction @ direction
        bounds = (away @ direction / square).min(axis=1)
        bounds -= 2.0**-47 * np.abs(away).max(initial=0) * np.abs(direction).max() / square
    return np.where((square > RANGE[0]) & np.isfinite(bounds), bounds, -np.inf)


class _Filter:
    """Leaves out triangles whose three edges the line passes, beyond doubt, on differing sides.

    For the edge e = b - a and the line o + s d, the side is the sign of (a - o) x e . d = d . (a x e) - (d x o) . e:
    one matrix product of rays and edges. With e divided by its largest component, the rays' rows by D (R + O), where
    D = max|d|, R = max|a|, O = max|o| (components, from the mesh's centre), it is a sum of 12 products of three,
    6 at most R / (R + O) and 6 at most O / (R + O) in size. Each meets at most 14 roundings: moving to the centre 1,
    edge 1, two scalings 4, the cross product's product and difference 2, the product with d or e 1, the sum of six 5.
    So the error is below 6 (1 + u)^14 - 6 < 85 u with u = 2^-53, and 128 u = 2^-46 is a safe margin.
    Underflow is harmless while R + O and D keep away from the ends of the range; else every triangle is kept.
    """

    MARGIN = 2.0**-46
    BLOCK = 1 << 18  # rays times triangles, so that the products stay in the cache

    def __init__(self, corners: NDArray[np.float64]) -> None:
        self.count = len(corners)
        with np.errstate(all="ignore"):
            points = corners.reshape(-1, 3)
            self.centre = (points.min(axis=0) / 2 + points.max(axis=0) / 2) if self.count else np.zeros(3)
            start = points - self.centre
            edge = np.roll(corners, -1, axis=1).reshape(-1, 3) - points
            longest = np.abs(edge).max(axis=1, keepdims=True)
            edge = edge / np.where(longest > 0, longest, 1.0)
            self.edges = np.hstack([np.cross(start, edge), edge]).reshape(-1, 3, 6).transpose(1, 2, 0).copy()
            self.radius = float(np.abs(start).max(initial=0.0))

    def candidates(self, origins: NDArray[np.float64], directions: NDArray[np.float64]) -> Iterator[NDArray[np.intp]]:
        """For each ray the rows, ascending, that only exact arithmetic can decide."""
        step = max(1, self.BLOCK // max(1, self.count))
        for first in range(0, len(origins), step):
            yield from self._block(origins[first : first + step], directions[first : first + step])

    def _block(self, origins: NDArray[np.float64], directions: NDArray[np.float64]) -> Iterator[NDArray[np.intp]]:
        low, high = RANGE
        with np.errstate(all="ignore"):
            origin = origins - self.centre
            size = self.radius + np.abs(origin).max(axis=1, keepdims=True)
            length = np.abs(directions).max(axis=1, keepdims=True)
            rays = np.hstack([directions, np.cross(origin, directions)]) / (size * length)
            side = [rays @ edges for edges in self.edges]
            positive = (side[0] >= -self.MARGIN) & (side[1] >= -self.MARGIN) & (side[2] >= -self.MARGIN)
            negative = (side[0] <= self.MARGIN) & (side[1] <= self.MARGIN) & (side[2] <= self.MARGIN)
        sound = ((low < size) & (size < high) & (low < length) & (length < high)).ravel()
        keep = positive | negative | ~sound[:, None]
        for row in keep:
            yield np.flatnonzero(row)


def ulp(truth: Fraction, dtype: type[np.floating]) -> Fraction:
    """The spacing of the format at the magnitude of `truth` (that of the subnormals for 0)."""
    info = np.finfo(dtype)
    magnitude = abs(truth)
    exponent = int(info.minexp)
    if magnitude:
        found = magnitude.numerator.bit_length() - magnitude.denominator.bit_length()
        exponent = max(exponent, found if magnitude >= Fraction(2) ** found else found - 1)
    return Fraction(2) ** (exponent - int(info.nmant))
