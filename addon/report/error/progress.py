"""How far a report has come, and how long it may still take."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import bihtree

Told = Callable[[str, float], bool | None]
"""Gets a line and the share done, 0 to 1; False cancels."""


class Progress:
    """Parts of the work by their weights; each is told when it begins."""

    def __init__(self, told: Told, weights: dict[str, float]) -> None:
        self._told = told
        self._weights = weights
        self._whole = sum(weights.values())
        self._done = 0.0
        self._part, self._share = "", 0.0
        self._started = perf_counter()

    def begin(self, part: str) -> None:
        """What stood before is done."""
        self.end()
        self._part, self._share = part, 0.0
        self.tell(part, 0.0)

    def end(self) -> None:
        self._done += self._weights.get(self._part, 0.0)
        self._part = ""

    def tell(self, what: str, share: float) -> None:
        """The share of this part that is done. Raises bihtree.Cancelled."""
        done = (self._done + self._weights.get(self._part, 0.0) * share) / self._whole
        spent = perf_counter() - self._started
        left = f", about {_span(spent * (1 - done) / done)} left" if done > 0.02 else ""
        name = what if what.startswith(self._part) else f"{self._part}: {what}"
        if self._told(f"{100 * done:3.0f} %  {name}{left}", done) is False:
            raise bihtree.Cancelled("cancelled")


def _span(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
