"""What the oracle decides in double precision: the easy pairs of rays and triangles, by bounds proved here.

It shares no code with the product. u is 2^-53, half a unit in the last place of 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Extended = NDArray[np.floating]
Rows = NDArray[np.intp]

RANGE = 2.0**-300, 2.0**300  # of sizes whose products neither overflow nor lose bits to underflow unseen


class Pairs(NamedTuple):
    """Rays and triangles that may meet; every other pair of the block is a miss. `is_inside`: they do, beyond doubt."""

    ray: Rows
    triangle: Rows
    is_inside: NDArray[np.bool_]


class Block(NamedTuple):
    """Rays first … first + size, their pairs, and whether double precision holds the products of each ray."""

    first: int
    size: int
    pairs: Pairs
    is_sound: NDArray[np.bool_]


class SideFilter:
    """On which side of a line the edges of triangles pass.

    For the edge e = b - a and the line o + s d, the side is the sign of (a - o) x e . d = d . (a x e) - (d x o) . e:
    one matrix product of rays and edges. With e divided by its largest component, the rays' rows by D (R + O), where
    D = max|d|, R = max|a|, O = max|o| (components, from the mesh's centre), it is a sum of 12 products of three,
    6 at most R / (R + O) and 6 at most O / (R + O) in size. Each meets at most 14 roundings: moving to the centre 1,
    edge 1, two scalings 4, the cross product's product and difference 2, the product with d or e 1, the sum of six 5.
    So the error is below 6 (1 + u)^14 - 6 < 85 u, and 128 u = 2^-46 is a safe margin.
    Underflow is harmless while R + O and D keep away from the ends of the range; else every triangle is kept.

    Two edges with sides that differ beyond doubt: a miss. All three on one side beyond doubt: the line meets the
    inside. It is not parallel then, because the sum of the three before their scaling is d . n for the normal n.
    """

    MARGIN = 2.0**-46
    BLOCK = 1 << 18  # rays times triangles, so that the products stay in the cache

    def __init__(self, corners: Floats) -> None:
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

    def blocks(self, origins: Floats, directions: Floats) -> Iterator[Block]:
        """All rays, in blocks; those that are not finite or without direction are not sound."""
        step = max(1, self.BLOCK // max(1, self.count))
        for first in range(0, len(origins), step):
            yield self._block(first, origins[first : first + step], directions[first : first + step])

    def _block(self, first: int, origins: Floats, directions: Floats) -> Block:
        low, high = RANGE
        with np.errstate(all="ignore"):
            origin = origins - self.centre
            size = self.radius + np.abs(origin).max(axis=1, keepdims=True)
            length = np.abs(directions).max(axis=1, keepdims=True)
            rays = np.hstack([directions, np.cross(origin, directions)]) / (size * length)
            sides = [rays @ edges for edges in self.edges]
            low_side = (sides[0] < -self.MARGIN) | (sides[1] < -self.MARGIN) | (sides[2] < -self.MARGIN)
            high_side = (sides[0] > self.MARGIN) | (sides[1] > self.MARGIN) | (sides[2] > self.MARGIN)
        sound = ((low < size) & (size < high) & (low < length) & (length < high)).ravel()
        # What is not a number is kept.
        ray, triangle = np.nonzero(~(low_side & high_side & sound[:, None]))
        kept = np.stack([side[ray, triangle] for side in sides])
        is_inside = (kept > self.MARGIN).all(axis=0) | (kept < -self.MARGIN).all(axis=0)
        return Block(first, len(origins), Pairs(ray, triangle, is_inside & sound[ray]), sound)


def _triple(a: Extended, b: Extended, c: Extended) -> tuple[Extended, Extended]:
    """a . (b x c) for rows of (N, 3), and a bound on its error, where each component may carry one rounding.

    Each of its six products of three meets at most eight roundings: three of the components, the product, the
    difference, the product with a, the sum of three 2. The error is below 8.1 u S, S the sum of their sizes. S itself
    is computed 8 u too small at most, so 16 u S is safe. A product that underflows loses 2^-1074 at most, times the
    third factor; all factors are below 2^302, and 2^-760 is more than all six lose.
    """
    value = size = np.zeros(len(a), a.dtype)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        p, q = b[:, j] * c[:, k], b[:, k] * c[:, j]
        value = value + a[:, i] * (p - q)
        size = size + np.abs(a[:, i]) * (np.abs(p) + np.abs(q))
    return value, 8 * np.finfo(a.dtype).eps * size + 2.0**-760


def _quotient(above: tuple[Extended, Extended], below: tuple[Extended, Extended]) -> tuple[Extended, Extended]:
    """The quotient and a bound on its error: of A ± α and B ± β it lies within (α + |A/B| β) / (|B| - β) of A/B.

    The division's own rounding and those of the bound are less than four units in the last place of each.
    """
    value = above[0] / below[0]
    margin = np.abs(below[0]) - below[1]
    eps = np.finfo(value.dtype).eps
    error = (above[1] + np.abs(value) * below[1]) / margin * (1 + 8 * eps) + 4 * eps * np.abs(value)
    error += np.finfo(np.float64).tiny
    return value, np.where((margin > below[1]) & np.isfinite(error), error, np.inf)


class Meetings(NamedTuple):
    """t and the weights u and v of corners 2 and 3, and what each may differ from the truth by: inf where unknown."""

    t: Extended
    t_error: Extended
    u: Extended
    u_error: Extended
    v: Extended
    v_error: Extended


def _relative(origins: Floats, directions: Floats, corners: Floats, dtype: type) -> tuple[Extended, ...]:
    """d, a - o, b - a, c - a."""
    a, b, c = np.moveaxis(corners.astype(dtype), 1, 0)
    return directions.astype(dtype), a - origins.astype(dtype), b - a, c - a


def distances(
    origins: Floats, directions: Floats, corners: Floats, is_sound: NDArray[np.bool_]
) -> tuple[Floats, Floats]:
    """For rows of rays and (N, 3, 3) corners two numbers that the true t lies between: t = (a - o) . n / d . n."""
    with np.errstate(all="ignore"):
        d, to, ab, ac = _relative(origins, directions, corners, np.float64)
        t, error = _quotient(_triple(to, ab, ac), _triple(d, ab, ac))
        low, high = np.nextafter(t - error, -np.inf), np.nextafter(t + error, np.inf)
        known = np.isfinite(error) & is_sound
    return np.where(known, low, -np.inf), np.where(known, high, np.inf)


def meetings(origins: Floats, directions: Floats, corners: Floats, is_sound: NDArray[np.bool_]) -> Meetings:
    """The same with the weights, in the widest format there is: from a - o + u e1 + v e2 = t d by Cramer's rule."""
    with np.errstate(all="ignore"):
        d, to, ab, ac = _relative(origins, directions, corners, np.longdouble)
        below = _triple(d, ab, ac)
        parts = [_quotient(above, below) for above in (_triple(to, ab, ac), _triple(d, ac, to), _triple(d, to, ab))]
    found = [part for value, error in parts for part in (value, np.where(is_sound, error, np.inf))]
    return Meetings(*found)
