"""Rays and triangles as whole numbers: every finite float is one times a power of two, so nothing is rounded."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Point = tuple[int, int, int]


def _lowest(values: Floats) -> int:
    """The exponent of the lowest bit that is set in any of the finite values."""
    mantissa, exponent = np.frexp(values[values != 0])
    if not len(mantissa):
        return 0
    whole = np.ldexp(mantissa, 53).astype(np.int64)
    lowest_bit = np.frexp((whole & -whole).astype(np.float64))[1] - 1
    return int((exponent - 53 + lowest_bit).min())


def _whole(values: Floats, exponent: int) -> list[list[int]]:
    """(N, k) values over 2^exponent, which divides them all."""
    mantissa, exponents = np.frexp(values)
    if (exponents - exponent).max(initial=0, where=values != 0) <= 62:
        return np.ldexp(values, -exponent).astype(np.int64).tolist()
    numbers = np.ldexp(mantissa, 53).astype(np.int64).tolist()
    shifts = np.where(values != 0, exponents - 53 - exponent, 0).tolist()
    return [
        [x << s if s >= 0 else x >> -s for x, s in zip(row, shift, strict=True)]
        for row, shift in zip(numbers, shifts, strict=True)
    ]


def _minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Point, b: Point) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


class Meeting(NamedTuple):
    """A line meets a triangle at t = above / below; b and c over slope weigh its corners 2 and 3; below, slope > 0."""

    above: int
    below: int
    b: int
    c: int
    slope: int

    @property
    def t(self) -> Fraction:
        return Fraction(self.above, self.below)

    @property
    def u(self) -> Fraction:
        return Fraction(self.b, self.slope)

    @property
    def v(self) -> Fraction:
        return Fraction(self.c, self.slope)

    @property
    def is_zero(self) -> tuple[bool, bool, bool]:
        """Which of t, u and v are 0."""
        return self.above == 0, self.b == 0, self.c == 0

    def order(self, other: Meeting) -> int:
        """Negative where this one is nearer, 0 where both are at one distance."""
        return self.above * other.below - other.above * self.below

    def is_within(self, t_min: float, t_max: float) -> bool:
        return self._difference(t_min) >= 0 and self._difference(t_max) <= 0

    def _difference(self, limit: float) -> int:
        """Its sign is that of t less the limit."""
        if np.isinf(limit):
            return -1 if limit > 0 else 1
        numerator, denominator = limit.as_integer_ratio()
        return self.above * denominator - numerator * self.below


class _Plane(NamedTuple):
    """A triangle: its normal n, n . a, and of each edge e from p the products p x e and e."""

    normal: Point
    height: int
    edges: tuple[tuple[Point, Point], ...]


class WholeTriangles:
    """Triangles (T, 3, 3) without infinities as whole numbers, each worked out when it is first met."""

    def __init__(self, corners: Floats) -> None:
        self._corners = corners
        self.lowest = _lowest(corners)
        self._planes: dict[tuple[int, int], _Plane] = {}

    def plane(self, row: int, exponent: int) -> _Plane:
        """A triangle over 2^exponent."""
        found = self._planes.get((row, exponent))
        if found is None:
            a, b, c = ((x, y, z) for x, y, z in _whole(self._corners[row], exponent))
            normal = _cross(_minus(b, a), _minus(c, a))
            sides = tuple((_cross(p, q), _minus(q, p)) for p, q in ((b, c), (c, a), (a, b)))
            found = self._planes[row, exponent] = _Plane(normal, _dot(normal, a), sides)
        return found


class WholeRays:
    """Valid rays (N, 3) as whole numbers, to be met with triangles."""

    def __init__(self, triangles: WholeTriangles, origins: Floats, directions: Floats) -> None:
        self._triangles = triangles
        self._place = min(triangles.lowest, _lowest(origins))
        slope = _lowest(directions)
        self._shift = self._place - slope
        self._origins, self._directions = _whole(origins, self._place), _whole(directions, slope)

    def meet(self, ray: int, rows: list[int]) -> list[tuple[Meeting, int]]:
        """Where the line of a ray meets these triangles, each with its row.

        The line passes the edge e from p on the side that (p - o) x e . d = d . (p x e) + e . (o x d) tells. It meets
        the closed triangle if no two of them differ; each over their sum, which is d . n, weighs the corner opposite.
        """
        ox, oy, oz = self._origins[ray]
        dx, dy, dz = self._directions[ray]
        mx, my, mz = oy * dz - oz * dy, oz * dx - ox * dz, ox * dy - oy * dx
        found = []
        for row in rows:
            normal, height, edges = self._triangles.plane(row, self._place)
            a, b, c = (dx * p[0] + dy * p[1] + dz * p[2] + mx * e[0] + my * e[1] + mz * e[2] for p, e in edges)
            slope = a + b + c
            if slope == 0 or min(a, b, c) < 0 < max(a, b, c):
                continue
            above = height - (normal[0] * ox + normal[1] * oy + normal[2] * oz)
            if slope < 0:
                above, slope, b, c = -above, -slope, -b, -c
            below = slope
            if self._shift >= 0:
                above <<= self._shift
            else:
                below <<= -self._shift
            found.append((Meeting(above, below, b, c, slope), row))
        return found
