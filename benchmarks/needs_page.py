"""What came of benchmarks/needs.py, for docs/benchmarks.md and for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from . import machine
from .tables import table

LIMIT = 1.05
STRIPPED = "by hand"


@dataclass(frozen=True)
class Ratio:
    """Of auto to another choice: the median and its 95 % interval; where instructions are counted, one number."""

    scene: str
    mode: str
    auto: float
    """Milliseconds, or millions of instructions."""
    middle: float
    lower: float
    upper: float


def verdict(ratio: Ratio) -> str:
    """Whether auto is within the limit, and how surely."""
    if ratio.middle <= LIMIT:
        return "met" if ratio.upper <= LIMIT else "met, not surely"
    return "**missed**" if ratio.lower > LIMIT else "**missed**, not surely"


def line(ratio: Ratio) -> str:
    """For a terminal."""
    interval = f"[{ratio.lower:.3f}, {ratio.upper:.3f}]" if ratio.lower < ratio.upper else ""
    return f"{ratio.scene:<9} {ratio.mode:<34} {ratio.auto:9.2f}  {ratio.middle:.3f}  {interval}  {verdict(ratio)}"


def timed_section(ratios: Sequence[Ratio], pairs: int) -> str:
    """Of clocks."""
    rows = [
        [r.scene, r.mode, f"{r.auto:.3g}", f"{r.middle:.3f}", f"{r.lower:.3f} – {r.upper:.3f}", verdict(r)]
        for r in ratios
    ]
    heads = ["scene", "compared with", "auto, ms", "auto over it", "95 % interval", f"≤ {LIMIT}"]
    said = f"""Time to image by the scene's own choice ("auto") over that of another, by `python -m benchmarks.needs`:
the median of {pairs} alternating pairs. Below 1 auto is faster. What comes to the same as auto is not measured again.
"{STRIPPED}" is the least that a person would write for a scene that needs none of the parts. All gave the same bits.
"""
    return "\n".join([said, *_facts(ratios), table(heads, rows)])


def counted_section(ratios: Sequence[Ratio]) -> str:
    """Of instructions."""
    rows = [[r.scene, r.mode, f"{r.auto:,.1f}", f"{r.middle:.3f}", verdict(r)] for r in ratios]
    heads = ["scene", "compared with", "auto, millions", "auto over it", f"≤ {LIMIT}"]
    said = """The same by instructions retired from the scene to its passes, on one thread, by callgrind: `python -m
benchmarks.needs --instructions`. Smaller meshes and pictures than for the clock, so what is decided weighs more. How
many threads there are cannot be judged by it.
"""
    return "\n".join([said, *_facts(ratios), table(heads, rows)])


def _facts(ratios: Sequence[Ratio]) -> list[str]:
    met = sum(ratio.middle <= LIMIT for ratio in ratios)
    return [*(f"- {what}: {fact}" for what, fact in machine.facts().items()), f"- met: {met} of {len(ratios)}\n"]
