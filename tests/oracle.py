"""The truth about rays and triangles, in rational arithmetic; it shares no code with the product.

Every finite float is a fraction, so hit, miss, distance and order are decided without rounding. A triangle is closed:
its boundary is hit. One without area, with a coordinate that is not finite, or in the ray's plane is not hit. What
double precision decides beyond doubt (oracle_filter) is not decided again in whole numbers (oracle_integers).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.oracle_filter import Meetings, SideFilter, distances, meetings
from tests.oracle_integers import Meeting, WholeRays, WholeTriangles

Number = Fraction | int
Point = tuple[Number, Number, Number]
Floats = NDArray[np.float64]


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


def _minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Point, b: Point) -> Number:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def crossing(
    origin: Point, direction: Point, a: Point, b: Point, c: Point
) -> tuple[Fraction, Fraction, Fraction] | None:
    """(t, u, v) of the point in which the line meets the closed triangle, or None: the definition, step by step."""
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


def are_valid(origins: Floats, directions: Floats, t_min: Floats, t_max: Floats) -> NDArray[np.bool_]:
    """False for what no answer can be given for: NaN, infinite origin or direction, zero direction, an empty limit."""
    finite = np.isfinite(origins).all(axis=1) & np.isfinite(directions).all(axis=1)
    limits = ~(np.isnan(t_min) | np.isnan(t_max)) & (t_min < np.inf) & (t_max > -np.inf)
    return finite & limits & (directions != 0).any(axis=1)


class Truth:
    """The closest hit of each ray: of several at one t the lowest row."""

    def __init__(
        self,
        corners: Floats,
        rays: _Rays,
        triangle: NDArray[np.int64],
        ties: NDArray[np.int64],
        is_zero: NDArray[np.bool_],
        undecided: int,
    ) -> None:
        self.undecided = undecided
        """How many rays the filter left to whole numbers."""
        self.triangle = triangle
        """(N,) rows; -1 for a miss."""
        self.ties = ties
        """(N,) how many triangles are at the nearest t: 0 for a miss."""
        self.is_valid = rays.is_valid
        self.proved: dict[str, dict[str, bytes]] = {}
        """By precision and type: the bits of answers that were found to be true."""
        self._corners, self._rays, self._is_zero = corners, rays, is_zero
        self._exact: dict[int, Hit] = {}

    def __len__(self) -> int:
        return len(self.triangle)

    @cached_property
    def approximate(self) -> Meetings:
        """t, u and v of the rays that hit, in their order, with bounds on their errors; 0 where one is known to be."""
        hit = np.flatnonzero(self.triangle >= 0)
        origins, directions = self._rays.origins[hit], self._rays.directions[hit]
        near = meetings(origins, directions, self._corners[self.triangle[hit]], self._rays.is_sound[hit])
        for parts, is_zero in zip((near[:2], near[2:4], near[4:]), self._is_zero[hit].T, strict=True):
            for part in parts:
                part[is_zero] = 0
        return near

    def hit(self, ray: int) -> Hit | None:
        """The closest hit of one ray, exactly."""
        row = int(self.triangle[ray])
        if row < 0:
            return None
        found = self._exact.get(ray)
        if found is None:
            one = slice(ray, ray + 1)
            triangle = WholeTriangles(self._corners[row : row + 1])
            [(meeting, _)] = WholeRays(triangle, self._rays.origins[one], self._rays.directions[one]).meet(0, [0])
            found = self._exact[ray] = Hit(meeting.t, row, meeting.u, meeting.v)
        return found


class Oracle:
    """All triangles of one mesh, (V, 3) floats and (T, 3) rows of them."""

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None:
        self.corners = np.asarray(vertices)[np.asarray(triangles).reshape(-1, 3)].astype(np.float64)
        self.rows = np.flatnonzero(np.isfinite(self.corners).all(axis=(1, 2)))
        self._finite = self.corners[self.rows]
        self._filter = SideFilter(self._finite)
        self._whole = WholeTriangles(self._finite)

    def decide(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> Truth:
        """The closest hit with t_min <= t <= t_max of each ray."""
        rays = self._rays(origins, directions, t_min, t_max)
        triangle, ties = np.full(len(rays.origins), -1), np.zeros(len(rays.origins), np.int64)
        is_zero = np.zeros((len(rays.origins), 3), np.bool_)
        undecided = 0
        for first, nearest in self._nearest(rays):
            hit = nearest.triangle >= 0
            block = slice(first, first + len(hit))
            triangle[block][hit] = self.rows[nearest.triangle[hit]]
            ties[block] = nearest.ties
            for place, hits in nearest.doubtful.items():
                if hits:
                    is_zero[first + place] = min(hits, key=lambda hit: hit[1])[0].is_zero
            undecided += len(nearest.doubtful)
        return Truth(self.corners, rays, triangle, ties, is_zero, undecided)

    def crossings(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> Iterator[list[Hit]]:
        """For each ray, every hit with t_min <= t <= t_max, nearest first and the lower row first where t is equal."""
        rays = self._rays(origins, directions, t_min, t_max)
        for block in self._filter.blocks(rays.origins, rays.directions):
            here = rays.part(block.first, block.size)
            valid = here.is_valid[block.pairs.ray]
            found = self._exactly(here, block.pairs.ray[valid], block.pairs.triangle[valid])
            for place in range(block.size):
                hits = [self._hit(meeting, row) for meeting, row in found.get(place, [])]
                yield sorted(hits, key=lambda hit: (hit.t, hit.triangle))

    def nearest(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> Iterator[list[Hit]]:
        """For each ray the hits at its smallest t, lower row first: more than one is a tie, none a miss."""
        rays = self._rays(origins, directions, t_min, t_max)
        for first, nearest in self._nearest(rays):
            certain = np.array([ray for ray in np.flatnonzero(nearest.ties) if ray not in nearest.doubtful], np.intp)
            here = rays.part(first, len(nearest.ties))
            found = nearest.doubtful | self._exactly(here, certain, nearest.triangle[certain])
            for place in range(len(nearest.ties)):
                hits = [self._hit(meeting, row) for meeting, row in found.get(place, [])]
                yield sorted(hits, key=lambda hit: hit.triangle)

    def closest(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> list[Hit | None]:
        """For each ray the nearest hit; of several at one t the lowest row; None for a miss."""
        return [hits[0] if hits else None for hits in self.nearest(origins, directions, t_min, t_max)]

    def _hit(self, meeting: Meeting, row: int) -> Hit:
        return Hit(meeting.t, int(self.rows[row]), meeting.u, meeting.v)

    def _rays(self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike) -> _Rays:
        origin, direction = np.atleast_2d(origins).astype(np.float64), np.atleast_2d(directions).astype(np.float64)
        near, far = (np.broadcast_to(np.asarray(limit, np.float64), len(origin)) for limit in (t_min, t_max))
        valid = are_valid(origin, direction, near, far)
        return _Rays(origin, direction, near, far, valid, np.zeros(len(origin), np.bool_))

    def _nearest(self, rays: _Rays) -> Iterator[tuple[int, _Nearest]]:
        """Block by block, by its first ray."""
        for block in self._filter.blocks(rays.origins, rays.directions):
            here = rays.part(block.first, block.size)
            here.is_sound[:] = block.is_sound
            ray, row, inside = block.pairs
            low, high = distances(here.origins[ray], here.directions[ray], self._finite[row], block.is_sound[ray])
            near, far = here.t_min[ray], here.t_max[ray]
            certain = inside & (near <= low) & (high <= far)
            # Nothing is beyond a triangle that is hit for certain.
            upper = np.full(block.size, np.inf)
            np.minimum.at(upper, ray[certain], high[certain])
            stays = (near <= high) & (low <= far) & (low <= upper[ray]) & here.is_valid[ray]
            ray, row, certain = ray[stays], row[stays], certain[stays]
            left = np.bincount(ray, minlength=block.size)
            is_alone = left[ray] == 1
            triangle = np.full(block.size, -1)
            is_alone = certain & (left[ray] == 1)
            triangle[ray[is_alone]] = row[is_alone]
            ties = (triangle >= 0).astype(np.int64)
            is_open = (left > ties)[ray]
            doubtful = {place: _first(hits) for place, hits in self._exactly(here, ray[is_open], row[is_open]).items()}
            for place, hits in doubtful.items():
                triangle[place], ties[place] = min((row for _, row in hits), default=-1), len(hits)
            yield block.first, _Nearest(triangle, ties, doubtful)

    def _exactly(
        self, rays: _Rays, ray: NDArray[np.intp], row: NDArray[np.intp]
    ) -> dict[int, list[tuple[Meeting, int]]]:
        """What valid rays meet within their limits, of the pairs given in the order of the rays."""
        used, starts = np.unique(ray, return_index=True)
        whole = WholeRays(self._whole, rays.origins[used], rays.directions[used])
        limits = zip(rays.t_min[used].tolist(), rays.t_max[used].tolist(), strict=True)
        rows = [part.tolist() for part in np.split(row, starts[1:])]
        return {
            place: [(met, row) for met, row in whole.meet(index, rows[index]) if met.is_within(*limit)]
            for index, (place, limit) in enumerate(zip(used.tolist(), limits, strict=True))
        }


class _Rays(NamedTuple):
    """Rays as float64; `is_sound` is filled in by the filter."""

    origins: Floats
    directions: Floats
    t_min: Floats
    t_max: Floats
    is_valid: NDArray[np.bool_]
    is_sound: NDArray[np.bool_]

    def part(self, first: int, count: int) -> _Rays:
        part = slice(first, first + count)
        limits = self.t_min[part], self.t_max[part]
        return _Rays(self.origins[part], self.directions[part], *limits, self.is_valid[part], self.is_sound[part])


class _Nearest(NamedTuple):
    """Of a block: rows of what is hit, how many at that t; and for the rays that whole numbers decided all of them."""

    triangle: NDArray[np.int64]
    ties: NDArray[np.int64]
    doubtful: dict[int, list[tuple[Meeting, int]]]


def _first(hits: list[tuple[Meeting, int]]) -> list[tuple[Meeting, int]]:
    """Those at the smallest t."""
    best: list[tuple[Meeting, int]] = []
    for hit in hits:
        order = hit[0].order(best[0][0]) if best else -1
        if order < 0:
            best = [hit]
        elif order == 0:
            best.append(hit)
    return best


def ulp(truth: Fraction, dtype: type[np.floating]) -> Fraction:
    """The spacing of the format at the magnitude of `truth` (that of the subnormals for 0)."""
    info = np.finfo(dtype)
    magnitude = abs(truth)
    exponent = int(info.minexp)
    if magnitude:
        found = magnitude.numerator.bit_length() - magnitude.denominator.bit_length()
        exponent = max(exponent, found if magnitude >= Fraction(2) ** found else found - 1)
    return Fraction(2) ** (exponent - int(info.nmant))
