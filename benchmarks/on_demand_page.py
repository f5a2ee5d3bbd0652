"""What came of benchmarks/on_demand.py, for docs/benchmarks.md and for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from addon.report.markdown import paragraph

from . import machine
from .on_demand_scenes import CASES
from .tables import table

STEADY = 0.95


@dataclass(frozen=True)
class Seconds:
    """Of one side: the build, the first picture, a second and a third one. The third builds and copies nothing more."""

    build: float
    first: float
    second: float
    third: float
    image: float

    @classmethod
    def of(cls, facts: dict[str, Any]) -> Seconds:
        return cls(*(facts[part]["seconds"] for part in ("build", "first", "second", "third", "image")))

    @property
    def slower(self) -> float:
        """What the first picture takes more than the third."""
        return max(0.0, self.first - self.third)


@dataclass(frozen=True)
class Share:
    """One side as a share of the eager tree."""

    name: str
    rays: str
    side: str
    seconds: Seconds
    eager: Seconds
    facts: dict[str, Any]
    memory: float

    @property
    def alone(self) -> float:
        return (self.seconds.build + self.seconds.slower) / (self.eager.build + self.eager.slower)

    @property
    def image(self) -> float:
        return self.seconds.image / self.eager.image

    @property
    def steady(self) -> float:
        return self.eager.third / self.seconds.third

    @property
    def parts(self) -> tuple[str, str]:
        """Of construction alone, then of the time to image: the share of the build, and of tracing."""
        build, slower, first = self.seconds.build, self.seconds.slower, self.seconds.first
        return (_parts(build, slower), _parts(build, first))

    @property
    def built(self) -> str:
        return f"{self.facts['pieces'] - self.facts['unbuilt']} of {self.facts['pieces']}"


def _parts(build: float, trace: float) -> str:
    share = round(100 * build / (build + trace))
    return f"{share} + {100 - share} %"


def shares(name: str, rays: str, sides: dict[str, Any]) -> list[Share]:
    """Every side but the first, which is the eager tree."""
    (_, eager), *others = sides.items()
    whole = Seconds.of(eager)
    return [
        Share(name, rays, side, Seconds.of(facts), whole, facts, facts["tree_bytes"] / eager["tree_bytes"])
        for side, facts in others
    ]


def line(share: Share) -> str:
    """For a terminal."""
    alone, image = share.parts
    clocks = ", ".join(f"{1e3 * seconds:.1f}" for seconds in vars(share.seconds).values())
    return (
        f"{share.name:<13}{share.rays:<9}{share.side:<24}alone {share.alone:5.2f} ({alone}), image {share.image:5.2f} "
        f"({image}), second {share.eager.second / share.seconds.second:5.2f}, steady {share.steady:5.2f}, memory "
        f"{share.memory:5.2f}; built {share.built}; {share.facts['differing_pixels']} pixels differ; ms: {clocks}"
    )


def _judged(value: float, limit: float | None, is_most: bool = True) -> str:
    if limit is None:
        return f"{value:.2f}"
    is_met = value <= limit if is_most else value >= limit
    said = f"{value:.2f} ({'≤' if is_most else '≥'} {limit:g})"
    return said if is_met else f"**{said}**"


def section(found: Sequence[Share], curve: Iterable[Share], pieces: dict[str, int]) -> str:
    """Of shares, and of those over sizes, `pieces` by their sides."""
    said = paragraph(
        "By `python -m benchmarks.on_demand`: a tree that is built on demand as a share of an eager one, medians of",
        "rounds in turn. Alone is the construction and what the first picture takes more than the third; image is from",
        "the arrays to the first picture; beside each the shares of the build and of tracing in it. Steady is the rate",
        "of the third picture; the second still copies vertices. Memory is acceleration data after the first picture,",
        "references included. Bold: a bar that is missed.",
    )
    heads = ["view", "rays", "alone", "build + trace", "image", "build + trace", "second", "steady", "memory", "pieces"]
    rows = []
    for share in found:
        case = CASES[share.name]
        alone, image = share.parts
        cells = [_judged(share.alone, case.alone), alone, _judged(share.image, case.image), image]
        second = f"{share.eager.second / share.seconds.second:.2f}"
        cells += [second, _judged(share.steady, STEADY, is_most=False), f"{share.memory:.2f}", share.built]
        rows.append([f"{share.name}, {case.size}", share.rays, *cells])
    parts = [said, *(f"- {what}: {fact}" for what, fact in machine.facts().items()), "", table(heads, rows)]
    over = [
        [share.name, share.rays, f"{pieces[share.side]:,}", f"{share.alone:.2f}", f"{share.image:.2f}"]
        + [f"{share.steady:.2f}", f"{share.memory:.2f}", share.built]
        for share in curve
    ]
    if over:
        heads = ["view", "rays", "largest piece", "alone", "image", "steady", "memory", "pieces"]
        parts += ["### Over the size at which a node is finished at once\n", table(heads, over)]
    return "\n".join(parts)
