"""What each ray hits, decided exactly; it shares no code with the product.

Boxes leave out what is far from a ray, double precision with a proven bound decides what is clear, and whole numbers
decide the rest, and every distance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .culling import MARGIN, TINY, Boxes, Floats, Rows, scaled_directions
from .exact import Crossing, crossing

CHUNK = 4096
LARGE = 2.0**300
"""Beyond it, and below its reciprocal, double precision decides nothing: products of three would leave its range."""


@dataclass
class Nearest:
    """Of N rays: the row of the nearest triangle, the lowest of several at one t, or -1; t as a sum of two floats
    (inf for a miss); for rays with more than one triangle at that t, all of them."""

    triangle: Rows
    t: Floats
    rest: Floats
    ties: dict[int, tuple[int, ...]] = field(default_factory=dict)
    decided_in_whole_numbers: int = 0
    """Rays that double precision left in doubt."""

    def __len__(self) -> int:
        return len(self.triangle)

    @property
    def hit(self) -> NDArray[np.bool_]:
        is_hit: NDArray[np.bool_] = self.triangle >= 0
        return is_hit


def joined(parts: list[Nearest]) -> Nearest:
    """Those of rays one after another."""
    starts = np.cumsum([0] + [len(part) for part in parts]).tolist()
    ties = {row + start: rows for part, start in zip(parts, starts, strict=False) for row, rows in part.ties.items()}
    return Nearest(
        np.concatenate([part.triangle for part in parts]),
        np.concatenate([part.t for part in parts]),
        np.concatenate([part.rest for part in parts]),
        ties,
        sum(part.decided_in_whole_numbers for part in parts),
    )


class Truth:
    """All triangles of one mesh: (V, 3) floats, (T, 3) rows of them. Those that are not finite are hit by nothing."""

    def __init__(self, vertices: NDArray[np.floating[Any]], triangles: NDArray[np.integer[Any]]) -> None:
        self.corners = np.asarray(vertices, np.float64)[np.asarray(triangles, np.int64).reshape(-1, 3)]
        self._rows = np.flatnonzero(np.isfinite(self.corners).all(axis=(1, 2)))
        self._boxes = Boxes(self.corners[self._rows])

    def nearest(
        self,
        origins: NDArray[np.floating[Any]],
        directions: NDArray[np.floating[Any]],
        told: Callable[[float], None] = lambda share: None,
    ) -> Nearest:
        """Of finite rays (N, 3), t >= 0, directions not zero; `told` is told the share done."""
        parts = []
        for start in range(0, max(1, len(origins)), CHUNK):
            parts.append(self._chunk(*_doubles(origins, directions, start)))
            told(min(1.0, (start + CHUNK) / max(1, len(origins))))
        return joined(parts)

    def count(self, origins: NDArray[np.floating[Any]], directions: NDArray[np.floating[Any]]) -> Rows:
        """(N,) how many triangles each ray hits with t >= 0."""
        counts = []
        for start in range(0, max(1, len(origins)), CHUNK):
            origin, direction = _doubles(origins, directions, start)
            found = np.zeros(len(origin), np.int64)
            pairs = _Pairs(self, origin, direction)
            for ray, row in zip(pairs.rays.tolist(), pairs.rows.tolist(), strict=True):
                hit = self.crossing(origin[ray], direction[ray], row)
                found[ray] += hit is not None and hit.numerator >= 0
            counts.append(found)
        return np.concatenate(counts)

    def crossing(self, origin: Floats, direction: Floats, row: int) -> Crossing | None:
        """Where a line meets one triangle."""
        a, b, c = self.corners[row].tolist()
        return crossing(origin.tolist(), direction.tolist(), a, b, c)

    def pairs(self, origins: Floats, directions: Floats) -> Iterator[tuple[Rows, Rows]]:
        """Ray and triangle of all that may meet, in pieces; directions are scaled."""
        for rays, rows in self._boxes.candidates(origins, directions):
            yield rays, self._rows[rows]

    def _chunk(self, origins: Floats, directions: Floats) -> Nearest:
        count = len(origins)
        found = Nearest(np.full(count, -1), np.full(count, np.inf), np.zeros(count))
        pairs = _Pairs(self, origins, directions)
        pairs.leave_out_later_ones(count)
        starts = np.searchsorted(pairs.rays, np.arange(count + 1)).tolist()
        for ray in np.unique(pairs.rays).tolist():
            chosen = slice(starts[ray], starts[ray + 1])
            best: list[tuple[Crossing, int]] = []
            for row in pairs.rows[chosen].tolist():
                hit = self.crossing(origins[ray], directions[ray], row)
                if hit is None or hit.numerator < 0 or (best and best[0][0].is_before(hit)):
                    continue
                best = [*best, (hit, row)] if best and hit.is_level_with(best[0][0]) else [(hit, row)]
            found.decided_in_whole_numbers += not bool(pairs.clear[chosen].all() and chosen.stop - chosen.start == 1)
            if best:
                rows = tuple(sorted(row for _, row in best))
                found.triangle[ray] = rows[0]
                found.t[ray], found.rest[ray] = best[0][0].as_two_floats()
                if len(rows) > 1:
                    found.ties[ray] = rows
        return found


def _doubles(
    origins: NDArray[np.floating[Any]], directions: NDArray[np.floating[Any]], start: int
) -> tuple[Floats, Floats]:
    chosen = slice(start, start + CHUNK)
    return np.asarray(origins[chosen], np.float64), np.asarray(directions[chosen], np.float64)


class _Pairs:
    """Rays and triangles that may meet, sorted by ray: whether they clearly do, and bounds of t (of scaled directions).

    With corners p, q, r seen from the origin (one rounding each), M the largest of their nine components and
    s = |d|_1, a volume d . (q x r) is a sum of terms of at most 2 M² s in all, each with at most seven roundings: two
    for the corners, the product, the difference, the product with d, two sums. `MARGIN` M² s = 32 u M² s exceeds
    7.1 u · 2 M² s. With edges of at most E (one rounding), p . n is off by less than 7.1 u · 6 M E² < 64 u M E², and
    d . n by less than 6.1 u · 2 E² s < 16 u E² s.
    """

    def __init__(self, truth: Truth, origins: Floats, directions: Floats) -> None:
        scaled, _ = scaled_directions(directions)
        pieces = []
        for rays, rows in truth.pairs(origins, scaled):
            with np.errstate(all="ignore"):
                kept, decided = _decided(truth.corners[rows], origins[rays], scaled[rays])
            pieces.append((rays[kept], rows[kept], *decided))
        none = np.zeros(0, np.int64)
        pieces.append((none, none, np.zeros(0, bool), np.zeros(0), np.zeros(0)))
        self.rays, self.rows, self.clear, self.lowest, self.highest = map(np.concatenate, zip(*pieces, strict=True))
        self._keep(np.argsort(self.rays, kind="stable"))

    def leave_out_later_ones(self, rays: int) -> None:
        """Keep what may be nearest: nothing that begins after a clear hit has ended."""
        bound = np.full(rays, np.inf)
        np.minimum.at(bound, self.rays[self.clear], self.highest[self.clear])
        self._keep(~(self.lowest > bound[self.rays]))

    def _keep(self, chosen: NDArray[Any]) -> None:
        self.rays, self.rows, self.clear = self.rays[chosen], self.rows[chosen], self.clear[chosen]
        self.lowest, self.highest = self.lowest[chosen], self.highest[chosen]


def _decided(
    corners: Floats, origin: Floats, direction: Floats
) -> tuple[NDArray[np.bool_], tuple[NDArray[np.bool_], Floats, Floats]]:
    """Which pairs may hit; of those whether they clearly do, and the bounds of t."""
    seen = corners - origin[:, None]
    p, q, r = seen[:, 0], seen[:, 1], seen[:, 2]
    largest = np.abs(seen).max(axis=(1, 2), initial=0.0)
    length = np.abs(direction).sum(axis=1)
    is_sound = (largest < LARGE) & (largest > 1 / LARGE)
    sides = np.stack([(direction * np.cross(*two)).sum(axis=1) for two in ((q, r), (r, p), (p, q))])
    doubt = MARGIN * largest**2 * length + TINY
    is_out = (sides.min(axis=0) < -doubt) & (sides.max(axis=0) > doubt) & is_sound
    is_in = ((sides.min(axis=0) > doubt) | (sides.max(axis=0) < -doubt)) & is_sound
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    edge = np.maximum(np.abs(first).max(axis=1, initial=0.0), np.abs(second).max(axis=1, initial=0.0))
    normal = np.cross(first, second)
    over, under = (p * normal).sum(axis=1), (direction * normal).sum(axis=1)
    over_doubt = 2 * MARGIN * largest * edge**2 + TINY
    under_doubt = MARGIN * edge**2 * length + TINY
    t = over / under
    t_doubt = (over_doubt + np.abs(t) * under_doubt) / (np.abs(under) - under_doubt)
    t_doubt = t_doubt * (1 + 2.0**-40) + np.abs(t) * 2.0**-50
    is_known = is_sound & (np.abs(under) > 2 * under_doubt) & np.isfinite(t_doubt)
    lowest, highest = np.where(is_known, t - t_doubt, -np.inf), np.where(is_known, t + t_doubt, np.inf)
    clear = is_in & is_known & (lowest >= 0)
    kept = ~is_out & ~(highest < 0)
    return kept, (clear[kept], lowest[kept], highest[kept])
