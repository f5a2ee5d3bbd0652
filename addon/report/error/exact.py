"""Rays and triangles in whole numbers: every finite float is a whole number over a power of two, so nothing is rounded.

A triangle is closed: its boundary is hit. One without area, or in the ray's plane, is not hit.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

Point = tuple[int, int, int]
Numbers = Sequence[float]
"""Three finite ones."""


class Crossing(NamedTuple):
    """Where a line meets a triangle: t = numerator / denominator, the denominator positive."""

    numerator: int
    denominator: int

    def is_before(self, other: Crossing) -> bool:
        return self.numerator * other.denominator < other.numerator * self.denominator

    def is_level_with(self, other: Crossing) -> bool:
        return self.numerator * other.denominator == other.numerator * self.denominator

    @property
    def t(self) -> Fraction:
        return Fraction(self.numerator, self.denominator)

    def as_two_floats(self) -> tuple[float, float]:
        """The float nearest to t, and the float nearest to what is left."""
        try:
            # Python divides whole numbers with one rounding.
            high = self.numerator / self.denominator
        except OverflowError:
            return float("inf"), 0.0
        over, under = high.as_integer_ratio()
        return high, (self.numerator * under - over * self.denominator) / (self.denominator * under)


def whole(points: Sequence[Numbers]) -> tuple[list[Point], int]:
    """Points times the least power of two that makes all of them whole, and that power."""
    ratios = [[value.as_integer_ratio() for value in point] for point in points]
    scale = max(under for point in ratios for _, under in point)
    return [(x[0] * (scale // x[1]), y[0] * (scale // y[1]), z[0] * (scale // z[1])) for x, y, z in ratios], scale


def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Point, b: Point) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def crossing(origin: Numbers, direction: Numbers, a: Numbers, b: Numbers, c: Numbers) -> Crossing | None:
    """Where the line origin + t direction meets the closed triangle a, b, c; None where it does not.

    With the corners seen from the origin, the volumes of direction and each two corners have one sign where the line
    passes inside; their sum is direction . normal, and the volume of the three corners is t times that.
    """
    (o, *corners), scale = whole([origin, a, b, c])
    (d,), finer = whole([direction])
    p, q, r = ((x - o[0], y - o[1], z - o[2]) for x, y, z in corners)
    qr = _cross(q, r)
    sides = _dot(d, qr), _dot(d, _cross(r, p)), _dot(d, _cross(p, q))
    if min(sides) < 0 < max(sides):
        return None
    slope = sum(sides)
    if slope == 0:
        return None
    volume = _dot(p, qr)
    # Volumes of three corners hold the scale of points three times; those of a direction twice, and its own once.
    numerator, denominator = volume * finer, slope * scale
    return Crossing(numerator, denominator) if denominator > 0 else Crossing(-numerator, -denominator)
