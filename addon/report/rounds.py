"""Structures timed side by side, in rounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import Protocol

from ..pipeline.camera import CameraView
from .shapes import Shape


class Built(Protocol):
    """What a structure's build returns."""

    def frame(self) -> None:
        """Take one picture."""

    def facts(self) -> dict[str, float]:
        """Bytes and counts that it tells of itself."""


class Structure(Protocol):
    """A way to build."""

    @property
    def name(self) -> str: ...

    def missing(self) -> str:
        """Why it cannot be measured here; empty where it can."""

    def build(self, mesh: Shape, view: CameraView) -> Built:
        """Everything between the arrays of a mesh and the first ray."""


@dataclass(frozen=True)
class Measured:
    """Medians over the rounds, in seconds; the facts are those after the last frame of the last round."""

    build: float
    image: float
    """Build and first picture."""
    frame: float
    """A further picture of the same view."""
    facts: dict[str, float]

    @property
    def frames(self) -> float:
        """Pictures a second."""
        return 1 / self.frame


@dataclass(frozen=True)
class Rounds:
    """How often, after one round that warms up, and the seconds after which no further round starts."""

    count: int = 5
    seconds: float = 20.0


def measure(structures: Sequence[Structure], mesh: Shape, view: CameraView, rounds: Rounds) -> dict[str, Measured]:
    """By name, of those that can be measured: in turn, round by round, so that all share a slower minute."""
    clocks: dict[str, list[tuple[float, float, float]]] = {}
    facts: dict[str, dict[str, float]] = {}
    present = [structure for structure in structures if not structure.missing()]
    started = perf_counter()
    for turn in range(rounds.count + 1):
        for structure in present:
            start = perf_counter()
            built = structure.build(mesh, view)
            ready = perf_counter()
            built.frame()
            first = perf_counter()
            facts[structure.name] = built.facts()
            again = perf_counter()
            built.frame()
            end = perf_counter()
            if turn:
                clocks.setdefault(structure.name, []).append((ready - start, first - start, end - again))
            del built
        if turn and perf_counter() - started > rounds.seconds:
            break
    return {
        name: Measured(
            build=median(build for build, _, _ in times),
            image=median(image for _, image, _ in times),
            frame=median(frame for _, _, frame in times),
            facts=facts[name],
        )
        for name, times in clocks.items()
    }
