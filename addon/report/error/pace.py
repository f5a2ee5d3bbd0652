"""How long the pictures of a section take, tried on small ones, and how much of that fits the time it has."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from time import perf_counter
from typing import TypeVar

from ...pipeline import preview
from ..markdown import number
from .subject import Subject

PATIENT = 15
"""A section of pictures takes at most so many times the patience of a round of tracing."""
SMALLER = (16, 4, 1)
"""Times narrower than the whole picture, one try after the other; each takes 16 times as long as the one before."""
NARROWEST = 8
"""Pixels."""
Choice = TypeVar("Choice")
Trace = Callable[[Subject], preview.Preview]


@dataclass(frozen=True)
class Pace:
    """Seconds of one picture."""

    fixed: float
    """Whatever its size: to decide what it needs, to build, to encode."""
    traced: float
    """To trace it in its whole size."""

    def of(self, share: float) -> float:
        """A picture of so many times the pixels, or samples."""
        return self.fixed + self.traced * share


def tried(subject: Subject, trace: Trace, patience: float) -> Pace:
    """By the largest picture that a quarter of the patience allows for, or else by the smallest."""
    whole = subject.camera.width * subject.camera.height
    pace = Pace(0.0, 0.0)
    for smaller in SMALLER:
        small = subject.in_width(max(1, subject.camera.width // smaller))
        started = perf_counter()
        traced = trace(small).report["trace_seconds"]
        pixels = small.camera.width * small.camera.height
        pace = Pace(perf_counter() - started - traced, traced * whole / pixels)
        if pace.of(min(1.0, SMALLER[0] * pixels / whole)) > patience / 4:
            break
    return pace


def widths(most: int) -> list[int]:
    """Halved again and again."""
    return [most >> halved for halved in range(most.bit_length()) if not halved or most >> halved >= NARROWEST]


def fitting(choices: Iterable[Choice], seconds: Callable[[Choice], float], limit: float) -> Choice:
    """The first that takes no longer than the limit, or else the last."""
    for choice in choices:
        if seconds(choice) <= limit:
            break
    return choice


def why_less(what: str, instead: str, limit: float, long: str) -> str:
    """A note for the page."""
    return f"{what}, not {instead}: this section may take some {number(limit)} s, and {long}."
