"""The bars: what bihtree must reach, each a ratio of two things measured in one run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import exp, log
from typing import Literal

from . import sides
from .plan import GROWING, KINDS, PRECISION_KINDS, PRECISION_SCENES, SCENES
from .results import Results, least

Bound = Literal["≤", "≥"]


@dataclass(frozen=True)
class Row:
    """One bar on one scene."""

    bar: str
    scene: str
    ours: float | None
    peer: float | None
    bound: Bound
    limit: float
    unit: str = ""
    """Of `ours` and `peer`."""

    @property
    def ratio(self) -> float | None:
        """Ours over the peer's; with no peer, ours itself."""
        if self.ours is None or self.peer is None or self.peer == 0:
            return None
        return self.ours / self.peer

    @property
    def is_met(self) -> bool | None:
        """None where one of the two was not measured."""
        if self.ratio is None:
            return None
        return self.ratio <= self.limit if self.bound == "≤" else self.ratio >= self.limit


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _building(results: Results, ours: str, low: float | None, medium: float, what: str) -> Iterator[Row]:
    for scene in SCENES:
        mine = _scaled(results.built(scene, ours), 1e3)
        if low is not None:
            peer = _scaled(results.built(scene, sides.LOW), 1e3)
            yield Row(f"{what} against Embree LOW", scene, mine, peer, "≤", low, "ms")
        peer = _scaled(results.built(scene, sides.MEDIUM), 1e3)
        yield Row(f"{what} against Embree MEDIUM", scene, mine, peer, "≤", medium, "ms")


def _tracing(results: Results, ours: str, peer: str, kind: str, limit: float, gears: float, what: str) -> Iterator[Row]:
    for scene in SCENES:
        mine, best = results.rate(scene, kind, ours), results.best_rate(scene, kind, peer)
        bound = gears if scene == "gears" else limit
        yield Row(f"{kind} rays, {what}", scene, _scaled(mine, 1e-6), _scaled(best, 1e-6), "≥", bound, "Mrays/s")


def _single(results: Results) -> Iterator[Row]:
    ratios = []
    for scene in SCENES:
        for kind in KINDS:
            mine, peer = results.rate(scene, kind, f"{sides.SAH}@1"), results.rate(scene, kind, f"{sides.MEDIUM}@1")
            row = Row(
                "one ray at a time, sah, against rtcIntersect1: each",
                *(f"{scene}, {kind}", _scaled(mine, 1e-6), _scaled(peer, 1e-6), "≥", 0.7, "Mrays/s"),
            )
            yield row
            if row.ratio is not None:
                ratios.append(row.ratio)
    mean = exp(sum(map(log, ratios)) / len(ratios)) if ratios else None
    yield Row("one ray at a time, sah, against rtcIntersect1: geometric mean", "all", mean, 1, "≥", 0.95)


def _images(results: Results) -> Iterator[Row]:
    for scene in SCENES:
        mine = _scaled(results.image(scene, sides.DEFAULT, 1), 1e3)
        fastest = _scaled(least(results.image(scene, peer, 1) for peer in sides.PEERS), 1e3)
        limit = 0.65 if (results.triangles(scene) or 0) >= 800_000 else 0.9
        yield Row("time to image, 1 sample, against the fastest Embree", scene, mine, fastest, "≤", limit, "ms")


def _memory(results: Results) -> Iterator[Row]:
    pairs = ((sides.DEFAULT, sides.MEDIUM, 0.8, "wide, against MEDIUM"), (sides.COMPACT, sides.SMALL, 0.3, "compact"))
    for ours, peer, limit, what in pairs:
        for scene in SCENES:
            mine, theirs = results.bytes_a_triangle(scene, ours), results.bytes_a_triangle(scene, peer)
            yield Row(f"bytes a triangle, {what}", scene, mine, theirs, "≤", limit, "B")
    for scene in SCENES:
        beyond = results.peak_beyond_result(scene, sides.DEFAULT)
        yield Row("peak memory while building beyond mesh and result, bytes a triangle", scene, beyond, 1, "≤", 24, "B")
    for kind in KINDS:
        yield from _tracing(results, sides.COMPACT, sides.SMALL, kind, 0.6, 0.6, "compact, against COMPACT")


def _growth(results: Results) -> Iterator[Row]:
    for scene in GROWING:
        sizes = (f"{scene}@100000", f"{scene}@10000000")
        times = []
        for name in sizes:
            seconds, count = results.built(name, sides.DEFAULT), results.triangles(name)
            times.append(None if seconds is None or not count else 1e9 * seconds / count)
        yield Row("time to build a triangle, 10^7 against 10^5", scene, times[1], times[0], "≤", 1.3, "ns")


def _steps(results: Results) -> Iterator[Row]:
    for scene in ("gears", "balls", "shells"):
        for kind in ("primary", "bounce", "random"):
            mine, sah = (results.steps(scene, kind, side) for side in (sides.DEFAULT, sides.SAH))
            yield Row("nodes a ray, against our own sah", f"{scene}, {kind}", mine, sah, "≤", 1.3)
    stiff, mild = (results.steps(f"stadium/{k}@100000", "primary", sides.DEFAULT) for k in (9, 0))
    yield Row("nodes a ray in the stadium, scale ratio 10^-9 against 1", "stadium, primary", stiff, mild, "≤", 2)


def rows(results: Results) -> list[Row]:
    """All bars of `fast` beside Embree's default."""
    fast = [*_building(results, sides.DEFAULT, 0.7, 0.25, "eager build")]
    for kind, limit in (("primary", 1.2), ("shadow", 1.1)):
        fast += _tracing(results, sides.DEFAULT, sides.MEDIUM, kind, limit, limit, "against MEDIUM's best")
    for kind in ("bounce", "random"):
        fast += _tracing(
            results, sides.DEFAULT, sides.MEDIUM, kind, 1.1, 1.0, "default heuristic, against MEDIUM's best"
        )
        fast += _tracing(results, sides.SAH, sides.MEDIUM, kind, 1.4, 1.15, "sah, against MEDIUM's best")
    fast += _building(results, sides.SAH, None, 0.6, "sah build")
    fast += [*_single(results), *_images(results), *_memory(results), *_growth(results), *_steps(results)]
    return fast


def exact_rows(results: Results) -> list[Row]:
    """The same of `watertight` beside ROBUST, where no bar is set yet."""
    found: list[Row] = []
    for kind in KINDS:
        found += _tracing(results, sides.WATERTIGHT, sides.ROBUST, kind, 1, 1, "watertight, against ROBUST's best")
    return found


def precision_rows(results: Results) -> list[Row]:
    """What `watertight` and `exact` cost beside `fast`, on the same rays in flight."""
    limits = {"vertices": 2.0, "axis": 4.0}
    found = []
    for precision, limit in (("watertight", 1.2), ("exact", 1.4)):
        for way, heuristic in (("", "global"), ("/sah", "sah")):
            for scene in PRECISION_SCENES:
                for kind in PRECISION_KINDS:
                    calls = (f"bih/wide/{name}{way}@flight" for name in (precision, "fast"))
                    rates = (results.precise_rate(scene, kind, call) for call in calls)
                    mine, fast = (None if rate is None else 1e9 / rate for rate in rates)
                    what = f"{precision}, {heuristic}, against fast"
                    found.append(Row(what, f"{scene}, {kind}", mine, fast, "≤", limits.get(kind, limit), "ns a ray"))
    return found
