"""What a person can choose of a report."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from ...pipeline.errors import UserError

SECTIONS = ("hits", "image", "stability", "left out")


@dataclass(frozen=True)
class Options:
    """Checked once."""

    rays: int = 50_000
    rounds: int = 5
    patience: float = 20.0
    """Seconds of tracing a round: a method that would take longer is given fewer rays."""
    threads: int = 1
    width: int = 640
    """Of pictures, at most."""
    samples: int = 32
    """Most a pixel; the reference has eight times as many."""
    steps: int = 16
    """Most of a sweep."""
    sweep_rays: int = 2_000
    pairs: int = 11
    """That parts left out are measured by."""
    quick: bool = False
    sections: tuple[str, ...] = SECTIONS
    max_wrong: int | None = None
    """Most wrong answers and misses of watertight and exact, of all rays."""
    max_leaks: int | None = None

    def __post_init__(self) -> None:
        for name, least in (("rays", 100), ("rounds", 1), ("threads", 0)):
            if getattr(self, name) < least:
                raise UserError(f"--{name} is {getattr(self, name)}; it must be at least {least}", exit_status=2)
        for name in self.sections:
            if name not in SECTIONS:
                raise UserError(f"unknown section {name!r}; choose from {', '.join(SECTIONS)}", exit_status=2)
        for name in ("max_wrong", "max_leaks"):
            value = getattr(self, name)
            if value is not None and value < 0:
                raise UserError(f"--{name.replace('_', '-')} is {value}; it must be at least 0", exit_status=2)
            if value is not None and "hits" not in self.sections:
                # Else a check would pass of which nothing was measured.
                raise UserError(
                    f"--{name.replace('_', '-')} needs the section hits; --only leaves it out", exit_status=2
                )

    def shown(self) -> dict[str, Any]:
        """For the page: those that change what is measured."""
        chosen = {name: value for name, value in asdict(self).items() if not name.startswith("max_")}
        return {**chosen, "sections": ", ".join(self.sections)}


WORDS = {
    "rays": "rays, of Hits",
    "rounds": "rounds, of which medians are taken",
    "patience": "seconds of tracing a round, at most",
    "threads": "threads of ours, of Hits and Stability",
    "width": "width of pictures, at most",
    "samples": "samples a pixel, at most",
    "steps": "steps of a sweep, at most",
    "sweep_rays": "rays a step of a sweep",
    "pairs": "pairs by which parts left out are measured",
}
"""For the page."""

QUICK = {"rays": 3_000, "rounds": 2, "patience": 2.0, "width": 160, "samples": 8, "steps": 4} | {
    "sweep_rays": 150,
    "pairs": 3,
}
"""For about a minute."""
