"""Which triangles a ray may hit: a tree of boxes in NumPy that never leaves one out. It shares no code with the
product, and every comparison has a bound for its own rounding: where one is in doubt, the triangle stays.

u = 2^-53 is the largest relative error of one rounding. Directions are scaled by a power of two, but for underflow, so
that their largest component is in [0.5, 1). A component that underflows by that is off by less than 2^-1074, and so is
a product that does: `TINY` times all that a component is multiplied by, and one more, covers both.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rows = NDArray[np.int64]

FAN_OUT = 8
PAIRS = 1 << 19
"""Pairs of ray and box that are looked at together: so many that NumPy is busy, so few that they fit the memory."""
MARGIN = 2.0**-48
TINY = 2.0**-1000


def scaled_directions(directions: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Directions with a largest component in [0.5, 1), and the powers of two that they were divided by."""
    _, power = np.frexp(np.abs(directions).max(axis=1, initial=0.0))
    return np.ldexp(directions, -power[:, None]), power.astype(np.int64)


class Boxes:
    """A tree over the boxes of triangles (T, 3, 3), all finite; its last level are the triangles themselves."""

    def __init__(self, corners: Floats) -> None:
        self.order = _along_a_curve(corners)
        lower, upper = corners.min(axis=1)[self.order], corners.max(axis=1)[self.order]
        self.levels: list[tuple[Floats, Floats]] = []
        while len(lower):
            self.levels.append(_middles(lower, upper))
            if len(lower) == 1:
                break
            starts = np.arange(0, len(lower), FAN_OUT)
            lower, upper = np.minimum.reduceat(lower, starts), np.maximum.reduceat(upper, starts)

    def candidates(self, origins: Floats, directions: Floats) -> Iterator[tuple[Rows, Rows]]:
        """Pairs (ray, triangle), in pieces: all whose line passes the triangle's box, unless that lies behind."""
        if not self.levels:
            return
        top = len(self.levels) - 1
        rays = np.arange(len(origins), dtype=np.int64)
        work = [(top, piece, np.zeros(len(piece), np.int64)) for piece in _pieces(rays)]
        while work:
            level, rays, nodes = work.pop()
            middles, halves = self.levels[level]
            kept = _may_meet(origins[rays], directions[rays], middles[nodes], halves[nodes])
            rays, nodes = rays[kept], nodes[kept]
            if level == 0:
                yield rays, self.order[nodes]
                continue
            children = nodes[:, None] * FAN_OUT + np.arange(FAN_OUT)
            rays = np.broadcast_to(rays[:, None], children.shape)
            there = children < len(self.levels[level - 1][0])
            rays, children = rays[there], children[there]
            work += [(level - 1, *pair) for pair in zip(_pieces(rays), _pieces(children), strict=True) if len(pair[0])]


def _pieces(rows: Rows) -> list[Rows]:
    return [rows[start : start + PAIRS] for start in range(0, max(1, len(rows)), PAIRS)]


def _along_a_curve(corners: Floats) -> Rows:
    """Rows in the order of a space-filling curve through their middles (Morton 1966): neighbours share boxes."""
    with np.errstate(all="ignore"):
        middle = (corners / 3).sum(axis=1)
        low, high = middle.min(axis=0, initial=np.inf), middle.max(axis=0, initial=-np.inf)
        cell = np.nan_to_num((middle / 2 - low / 2) / np.where(high > low, high / 2 - low / 2, 1.0))
    grid = np.clip(cell * 1023, 0, 1023).astype(np.uint64)
    key = np.zeros(len(corners), np.uint64)
    for bit in range(10):
        for axis in range(3):
            key |= ((grid[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(key, kind="stable").astype(np.int64)


def _middles(lower: Floats, upper: Floats) -> tuple[Floats, Floats]:
    """Middles as they are rounded, and half sizes so large that the boxes around them hold lower and upper."""
    with np.errstate(all="ignore"):
        middle = lower / 2 + upper / 2
        half = np.maximum(upper - middle, middle - lower)
        return middle, half * (1 + 2.0**-50) + 2.0**-1070


def _may_meet(origin: Floats, direction: Floats, middle: Floats, half: Floats) -> NDArray[np.bool_]:
    """False where the line surely misses the box, or the box surely lies behind the origin.

    A line and a box are apart if and only if the cross product of the direction and one axis parts them. With
    m = middle − origin (one rounding), m_j d_k − m_k d_j has three roundings in each term; so has the right side.
    32 u = `MARGIN` times the sum of all four products covers them. So it does for the sums of six that say "behind".
    """
    with np.errstate(all="ignore"):
        away, size = middle - origin, np.abs(direction)
        far = np.abs(away)
        kept = np.ones(len(origin), bool)
        for j, k in ((1, 2), (2, 0), (0, 1)):
            apart = np.abs(away[:, j] * direction[:, k] - away[:, k] * direction[:, j])
            reach = half[:, j] * size[:, k] + half[:, k] * size[:, j]
            doubt = MARGIN * (far[:, j] * size[:, k] + far[:, k] * size[:, j] + reach)
            doubt += TINY * (1 + far[:, j] + far[:, k] + half[:, j] + half[:, k])
            kept &= ~(apart > reach + doubt)
        ahead = (away * direction).sum(axis=1) + (half * size).sum(axis=1)
        doubt = MARGIN * ((far + half) * size).sum(axis=1) + TINY * (1 + (far + half).sum(axis=1))
        kept &= ~(ahead < -doubt)
    return kept
