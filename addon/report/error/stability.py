"""Stability: wrong answers, error of t and work as a scene becomes stiffer, sweep by sweep."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from ...pipeline.mesh import Mesh
from ..sweeps import SWEEPS, Sweep
from .comparison import compared, neighbours, quantile
from .hits import MILLION, Span, every_of, span
from .methods import EXACT, FAST, WATERTIGHT, Method
from .progress import Progress
from .rays import Rays
from .truth import Truth

COMPARED = (FAST, WATERTIGHT, EXACT, "kd_tree", "embreex", "embreex robust", "naive, float32", "Blender's BVHTree")
"""The others decide as one of these does."""
PAIRS = 2_000_000
"""Most pairs of ray and triangle of a step: where all triangles lie in one place, each ray meets each."""
BREAKS, TIMES = 0.01, 4
"""A method breaks where more than one answer in a hundred is wrong, neighbours not counted, and four times as many as
of the least stiff step."""


@dataclass
class Row:
    """A method at one k of a sweep."""

    sweep: str
    name: str
    k: int
    rays: int
    missed: int
    wrong_hits: int
    neighbours: int
    """Of those, how many share a corner with the right triangle."""
    t_error_max: float | None
    t_error_999: float | None
    nodes_a_ray: float | None
    nanoseconds_a_ray: Span | None
    hits: int = 0
    """How many of the rays truly hit."""

    @property
    def wrong_a_million(self) -> float:
        return MILLION * (self.missed + self.wrong_hits) / self.rays

    @property
    def far_off_a_million(self) -> float:
        """Without neighbours."""
        return MILLION * (self.missed + self.wrong_hits - self.neighbours) / self.rays


@dataclass
class Stability:
    """The section, filled step by step."""

    rows: list[Row] = field(default_factory=list)
    breaks: dict[str, dict[str, tuple[int, ...]]] = field(default_factory=dict)
    """By sweep and method the least k at which it breaks, to either side of 0; without those that never do."""

    def of(self, sweep: str, method: str) -> list[Row]:
        return [row for row in self.rows if (row.sweep, row.name) == (sweep, method)]


def chosen_ks(sweep: Sweep, steps: int) -> tuple[int, ...]:
    """About so many of a sweep's: the ends, the least stiff, and some between."""
    if len(sweep.ks) <= steps:
        return sweep.ks
    places = np.linspace(0, len(sweep.ks) - 1, steps).round().astype(int)
    return tuple(sorted({min(sweep.ks, key=abs), *(sweep.ks[place] for place in places.tolist())}))


def measure(
    stability: Stability, methods: Sequence[Method], rays: int, steps: int, rounds: int, progress: Progress
) -> None:
    """Fill `stability`. Raises Cancelled and KeyboardInterrupt; what was measured before stays in it."""
    progress.begin("stability")
    present = [method for method in methods if method.name in COMPARED and not method.missing()]
    work = [(sweep, k) for sweep in SWEEPS.values() for k in chosen_ks(sweep, steps)]
    for number, (sweep, k) in enumerate(work):
        progress.tell(f"{sweep.name}, k = {k}", number / len(work))
        stability.rows += _step(sweep, k, present, rays, rounds)
        names = [method.name for method in present]
        found = {name: broken_at(stability.of(sweep.name, name)) for name in names}
        stability.breaks[sweep.name] = {name: at for name, at in found.items() if at}


def _step(sweep: Sweep, k: int, methods: Iterable[Method], rays: int, rounds: int) -> list[Row]:
    vertices, triangles, *lines = sweep.at(k, rays)
    mesh = Mesh(sweep.name, np.ascontiguousarray(vertices), triangles.astype(np.int32))
    few = max(1, min(rays, PAIRS // len(triangles)))
    origins, directions = (np.ascontiguousarray(values[:few]) for values in lines)
    truth = Truth(vertices, triangles)
    nearest = truth.nearest(origins, directions)
    rows = []
    for method in methods:
        every = method.every(mesh, few)
        given = Rays(origins, directions).every(every)
        built = method.build(mesh)
        answers = built.trace(given)
        true = every_of(nearest, every)
        comparison = compared(answers, true)
        seconds = []
        for _ in range(rounds):
            started = perf_counter()
            built.trace(given)
            seconds.append(1e9 * (perf_counter() - started) / len(given.origins))
        rows.append(
            Row(
                sweep.name,
                method.name,
                k,
                len(given.origins),
                int(comparison.missed.sum()),
                int((comparison.false_hit | comparison.other_triangle).sum()),
                int(neighbours(answers, true, comparison, truth.corners).sum()),
                quantile(comparison.t_error, 1.0),
                quantile(comparison.t_error, 0.999),
                built.nodes(given),
                span(seconds),
                int(true.hit.sum()),
            )
        )
    return rows


def broken_at(rows: Sequence[Row]) -> tuple[int, ...]:
    """The least stiff k, below 0 and above it, at which a method is broken; k = 0 is not stiff."""
    ordered = sorted(rows, key=lambda row: abs(row.k))
    if not ordered:
        return ()
    bound = max(BREAKS * MILLION, TIMES * ordered[0].far_off_a_million)
    broken = [row.k for row in ordered[1:] if row.far_off_a_million > bound]
    below, above = ([k for k in broken if k < 0], [k for k in broken if k > 0])
    return (*below[:1], *above[:1])
