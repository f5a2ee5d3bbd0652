"""How far a report has come, and how long it may still take."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter

import bihtree

Told = Callable[[str, float], bool | None]
"""Gets a line and the share done, 0 to 1; False cancels."""
TellsOfPicture = Callable[[str, float], bool]
"""Gets a stage of the pipeline and the share of it that is done; False cancels."""
ENOUGH = 0.1
"""Where so much of a part is done, the rest is taken to go on like it."""
SELDOM = 0.5
"""Seconds between what is told of pictures."""


class Progress:
    """Parts of the work by the seconds that they take, about; each is told when it begins."""

    def __init__(self, told: Told, seconds: Mapping[str, float], clock: Callable[[], float] = perf_counter) -> None:
        self._told, self._clock = told, clock
        self._later = dict(seconds)
        self._part, self._expected = "", 0.0
        self._started = self._began = self._last = clock()
        self._furthest = 0.0

    def begin(self, part: str) -> None:
        """What stood before is done."""
        self._part = part
        self.expect(self._later.pop(part, 0.0))
        self.tell(part, 0.0)

    def expect(self, seconds: float) -> None:
        """All that is still to do of this part, whose share begins at 0 again, takes about so long."""
        self._expected, self._began = seconds, self._clock()

    def expect_later(self, part: str, seconds: float) -> None:
        """A part that is still to come takes about so long."""
        if part in self._later:
            self._later[part] = seconds

    def tell(self, what: str, share: float) -> None:
        """The share of this part that is done. Raises bihtree.Cancelled."""
        self._last = self._clock()
        spent = self._last - self._started
        left = self._left(share) + sum(self._later.values())
        self._furthest = max(self._furthest, spent / (spent + left) if left else 1.0)
        name = what if what.startswith(self._part) else f"{self._part}: {what}"
        if self._told(f"{100 * self._furthest:3.0f} %  {name}, about {_span(left)} left", self._furthest) is False:
            raise bihtree.Cancelled("cancelled")

    def of_picture(self, what: str, start: float, end: float) -> TellsOfPicture:
        """For the pipeline, which traces a picture between two shares of this part."""

        def told(stage: str, fraction: float) -> bool:
            if self._clock() - self._last < SELDOM:
                return True
            try:
                self.tell(what, start + (end - start) * (fraction if stage == "trace" else 0.0))
            except bihtree.Cancelled:
                return False
            return True

        return told

    def _left(self, share: float) -> float:
        if share > ENOUGH:
            return (self._clock() - self._began) * (1 - share) / share
        return self._expected * (1 - share)


def _span(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"
