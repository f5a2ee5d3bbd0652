"""Hits: what each method's answers cost, and which of them are wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, inf
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from . import rays as kinds_of_rays
from . import worst_rays
from .comparison import compared, leaks, neighbours, quantile
from .decided import Decided, decided
from .methods import WATERTIGHT, Answers, Built, Method, OurBuilt
from .pareto import front
from .progress import Progress
from .rays import Kind
from .subject import Subject
from .truth import Nearest, Truth

TRIED, TRIES, LONG = 8, 4, 0.1
"""Rays of each kind that are tried at first to see how long a method takes, how often, and seconds that tell it."""
COUNTED = 8
"""Of a slow method's rays one in so many is counted: nodes take as long as an answer, decisions eight times as long."""
FEW = 10
"""A method that is given less than one ray in so many is on no front."""
SLOW = 5.0
"""A method that takes more seconds than this is measured once."""
MILLION = 1_000_000


@dataclass(frozen=True)
class Span:
    """Of repeated measurements."""

    median: float
    least: float
    most: float
    count: int


def span(values: Sequence[float]) -> Span | None:
    return Span(median(values), min(values), max(values), len(values)) if values else None


@dataclass
class Row:
    """A method, and what was measured of it: counts are of the rays that it was given, one in `every`."""

    name: str
    note: str
    missing: str = ""
    every: int = 1
    rays: int = 0
    hits: int = 0
    missed: int = 0
    false_hits: int = 0
    other_triangle: int = 0
    neighbours: int = 0
    """Of those, how many share a corner with the nearest."""
    leaks: int = 0
    aimed: int = 0
    wrong_by_kind: dict[str, int] = field(default_factory=dict)
    t_error_max: float | None = None
    t_error_999: float | None = None
    precision: str = ""
    bytes: int | None = None
    bytes_a_triangle: float | None = None
    nodes_a_ray: float | None = None
    build: Span | None = None
    trace: Span | None = None
    total: Span | None = None
    fronts: list[str] = field(default_factory=list)
    """Costs for which it is on the Pareto front with wrong answers."""
    worst: list[dict[str, Any]] = field(default_factory=list)

    @property
    def wrong(self) -> int:
        return self.missed + self.false_hits + self.other_triangle

    @property
    def wrong_a_million(self) -> float | None:
        return MILLION * self.wrong / self.rays if self.rays else None


@dataclass
class Hits:
    """The section, filled as it is measured."""

    rows: list[Row] = field(default_factory=list)
    rays: dict[str, dict[str, int]] = field(default_factory=dict)
    truth_seconds: float = 0.0
    rounds: int = 0
    decided: dict[str, Decided] = field(default_factory=dict)
    """By kind of ray: what it took to decide the tests of precision watertight."""
    decided_every: int = 1
    """One ray in so many was counted for that."""
    beside: list[dict[str, Any]] = field(default_factory=list)
    """The worst rays of the peers, with everybody's answers."""

    def row(self, name: str) -> Row | None:
        return next((row for row in self.rows if row.name == name and not row.missing and row.rays), None)


COSTS = {"seconds": "seconds, build and trace", "nodes": "nodes a ray", "bytes": "bytes a triangle"}


def measure(
    hits: Hits,
    subject: Subject,
    methods: Sequence[Method],
    count: int,
    rounds: int,
    patience: float,
    progress: Progress,
) -> None:
    """Fill `hits`. Raises Cancelled and KeyboardInterrupt; what was measured before stays in it."""
    mesh = subject.mesh
    progress.begin("truth")
    started = perf_counter()
    truth = Truth(mesh.vertices, mesh.triangles)
    kinds: dict[str, Kind] = {}
    for kind, rays, nearest in kinds_of_rays.of_kinds(truth, mesh, subject.camera, count):
        kinds[kind] = Kind(rays, nearest)
        facts = {"rays": len(nearest), "hit": int(nearest.hit.sum()), "ties": len(nearest.ties)}
        hits.rays[kind] = {**facts, "in whole numbers": nearest.decided_in_whole_numbers}
        progress.tell(f"{kind} rays", sum(len(k.truth) for k in kinds.values()) / count)
    hits.truth_seconds = perf_counter() - started
    progress.begin("hits")
    answered: dict[str, dict[str, Answers]] = {}
    clocks: dict[str, list[tuple[float, float]]] = {}
    spent: dict[str, float] = {}
    once: dict[str, float] = {}
    hits.rows += [Row(method.name, method.note, method.missing()) for method in methods]
    present = [
        (method, row) for method, row in zip(methods, hits.rows[-len(methods) :], strict=True) if not row.missing
    ]
    for turn in range(rounds + 1):
        if turn == 1:
            again = [row for _, row in present if row.name not in clocks]
            progress.expect(sum(once[row.name] * (1 if row.every > 1 else rounds) for row in again))
        for number, (method, row) in enumerate(present):
            if turn and (row.name in clocks) and (row.every > 1 or spent[row.name] > SLOW):
                continue
            where = f"{method.name}, round {turn} of {rounds}" if turn else method.name
            share = number / len(present)
            progress.tell(where, (turn - 1 + share) / rounds if turn else share)
            started = perf_counter()
            built = method.build(mesh)
            ready = perf_counter()
            if not turn:
                row.every = max(method.every(mesh, count), _affordable(built, kinds, patience))
            traced = perf_counter()
            answers = {name: built.trace(kind.rays.every(row.every)) for name, kind in kinds.items()}
            seconds = perf_counter() - traced
            once[row.name] = ready - started + seconds
            seconds *= sum(len(kind.truth) for kind in kinds.values())
            seconds /= sum(len(found.triangle) for found in answers.values())
            if not turn:
                _judge(row, answers, kinds, truth)
                _facts(row, built, kinds, len(mesh.triangles))
                if row.name == WATERTIGHT and isinstance(built, OurBuilt):
                    hits.decided_every = row.every * (COUNTED if row.every > 1 else 1)
                    given = {name: kind.rays.every(hits.decided_every) for name, kind in kinds.items()}
                    hits.decided = {name: decided(built.tree.decision_cost(*rays)) for name, rays in given.items()}
                answered[row.name] = answers
            spent[row.name] = perf_counter() - started
            # What is slow needs no warming up, and is measured once.
            if turn or spent[row.name] > SLOW:
                clocks.setdefault(row.name, []).append((ready - started, seconds))
            _time(row, clocks.get(row.name, []))
        hits.rounds = turn
        mark_fronts(hits.rows)
    worst = [(method, row.every, row.worst) for method, row in present]
    hits.beside = worst_rays.beside(worst, answered, kinds, mesh)


def _affordable(built: Built, kinds: Mapping[str, Kind], patience: float) -> int:
    """One ray in so many takes about `patience` seconds; few are tried, and more where these seem to take long: a busy
    machine lets any wait."""
    count = sum(len(kind.truth) for kind in kinds.values())
    few = TRIED
    while True:
        some = [kind.rays.every(max(1, len(kind.truth) // few)) for kind in kinds.values()]
        share = count / max(1, sum(len(rays.origins) for rays in some))
        least = inf
        for _ in range(TRIES):
            started = perf_counter()
            for rays in some:
                built.trace(rays)
            least = min(least, perf_counter() - started)
            if least * share <= patience:
                return 1
            if least < LONG:
                break
        if least >= LONG or share <= 1:
            return ceil(least * share / patience)
        few *= 4


def mark_fronts(rows: Sequence[Row]) -> None:
    """By each cost: who has no other below it in both that cost and wrong answers."""
    for cost in COSTS:
        chosen = front_of(rows, cost, lambda row: row.wrong_a_million)
        for row in rows:
            row.fronts = [*(name for name in row.fronts if name != cost), *([cost] if row.name in chosen else [])]


def front_of(rows: Sequence[Row], cost: str, error: Callable[[Row], float | None]) -> set[str]:
    """Names of methods that have no other below them in both; without those that were given few rays."""
    points = {
        row.name: (x, y)
        for row in rows
        if row.every <= FEW and (x := cost_of(row, cost)) is not None and (y := error(row)) is not None
    }
    return front(points)


def cost_of(row: Row, cost: str) -> float | None:
    if cost == "seconds":
        return row.total.median if row.total else None
    return row.nodes_a_ray if cost == "nodes" else row.bytes_a_triangle


def _time(row: Row, clocks: Sequence[tuple[float, float]]) -> None:
    row.build = span([build for build, _ in clocks])
    row.trace = span([trace for _, trace in clocks])
    row.total = span([build + trace for build, trace in clocks])


def _facts(row: Row, built: Built, kinds: Mapping[str, Kind], triangles: int) -> None:
    row.bytes = built.bytes()
    row.bytes_a_triangle = None if row.bytes is None else row.bytes / triangles
    every = row.every * (COUNTED if row.every > 1 else 1)
    visited = [built.nodes(kind.rays.every(every)) for kind in kinds.values()]
    known = [nodes * len(kind.truth) for nodes, kind in zip(visited, kinds.values(), strict=True) if nodes is not None]
    row.nodes_a_ray = sum(known) / sum(len(kind.truth) for kind in kinds.values()) if len(known) == len(kinds) else None


def _judge(row: Row, answers: Mapping[str, Answers], kinds: Mapping[str, Kind], truth: Truth) -> None:
    errors, worst = [], []
    for name, kind in kinds.items():
        nearest = every_of(kind.truth, row.every)
        found = answers[name]
        comparison = compared(found, nearest)
        row.precision = str(found.t.dtype)
        row.rays += len(nearest)
        row.hits += int(nearest.hit.sum())
        row.missed += int(comparison.missed.sum())
        row.false_hits += int(comparison.false_hit.sum())
        row.other_triangle += int(comparison.other_triangle.sum())
        row.wrong_by_kind[name] = int(comparison.wrong.sum())
        is_neighbour = neighbours(found, nearest, comparison, truth.corners)
        row.neighbours += int(is_neighbour.sum())
        if name in kinds_of_rays.AIMED:
            row.leaks += int(leaks(found, nearest, comparison, is_neighbour).sum())
            row.aimed += len(nearest)
        errors.append(comparison.t_error)
        worst += worst_rays.of(name, row.every, found, nearest, comparison)
    every = np.concatenate(errors)
    row.t_error_max, row.t_error_999 = quantile(every, 1.0), quantile(every, 0.999)
    row.worst = sorted(worst, key=lambda ray: -ray["off"])[: worst_rays.WORST]


def every_of(truth: Nearest, step: int) -> Nearest:
    """That of one ray in so many."""
    if step == 1:
        return truth
    ties = {row // step: rows for row, rows in truth.ties.items() if row % step == 0}
    return Nearest(truth.triangle[::step], truth.t[::step], truth.rest[::step], ties)
