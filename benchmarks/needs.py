"""Measure what leaving parts out is worth: `python -m benchmarks.needs`, on an idle machine.

    python -m benchmarks.needs                 ten scenes, 21 alternating pairs a row; a section of docs/benchmarks.md
    python -m benchmarks.needs --scene ball    one scene, printed only
    python -m benchmarks.needs --sweep         where the thresholds lie: one part kept and left out, over sizes; printed
    python -m benchmarks.needs --quick         small scenes; the same bits are asserted, no clock is read

A row is the time to image by the scene's own choice ("auto") over that with every part kept, every part left out where
the picture stays the same, or one part's choice turned.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from statistics import median
from time import perf_counter

import bihtree
import numpy as np

from addon.pipeline import preview
from addon.pipeline.settings import PARTS

from . import machine, needs_sweep, sections
from .needs_scenes import SCENES, Case
from .page import PAGE
from .tables import table

SIZE, QUICK_SIZE = 200_000, 3_000
PAIRS = 21
LIMIT = 1.05
STRIPPED = "by hand"
STRIPPED_SCENE = "ball"

OF_THE_TREE = {"tree", "objects out of reach"}
"""Parts that change what the cost pass counts."""


@dataclass(frozen=True)
class Ratio:
    """Of the times of auto to another's, from alternating pairs: the median and its 95 % interval."""

    scene: str
    mode: str
    milliseconds: float
    middle: float
    lower: float
    upper: float


def modes(case: Case) -> Iterator[tuple[str, dict[str, bool]]]:
    """Those whose choice is another one than auto's: all on, all off, and each part turned alone."""
    chosen = _kept(case, {})
    seen = [chosen]
    tried = [("all on", dict.fromkeys(PARTS, True)), ("all off", dict.fromkeys(PARTS, False))]
    tried += [
        (f"{part}: {'left out' if kept else 'kept'}", {part: not kept})
        for part, kept in chosen.items()
        if part in PARTS
    ]
    for mode, parts in tried:
        kept = _kept(case, parts)
        if kept not in seen:
            seen.append(kept)
            yield mode, parts


def _trace(case: Case, parts: dict[str, bool]) -> preview.Preview:
    return preview.trace(case.scene, replace(case.settings, parts=parts), outputs=preview.Outputs())


def _kept(case: Case, parts: dict[str, bool]) -> dict[str, bool]:
    rows = _trace(case, parts).report["needs"]
    return {row["part"]: row["kept"] for row in rows if row["part"] in PARTS}


def differing(case: Case) -> Iterator[str]:
    """A line for each mode and pass whose bits are others than auto's."""
    expected = _trace(case, {}).passes
    for mode, parts in modes(case):
        found = _trace(case, parts).passes
        for name in case.settings.passes:
            if name == "cost" and (len(parts) > 1 or OF_THE_TREE & set(parts)):
                continue
            if expected[name].tobytes() != found[name].tobytes():
                count = np.count_nonzero((expected[name] != found[name]).any(axis=-1))
                yield f"{case.scene.name}, {mode}: {count} pixels of {name} differ"


def by_hand(case: Case) -> None:
    """What a person would write for a scene that needs no more than this."""
    view, mesh = case.scene.camera, case.scene.meshes[0]
    assert view is not None
    tree = bihtree.Tree(mesh.vertices, mesh.triangles, layout="wide", presort=False, copy=False)
    camera = bihtree.Camera(view.clip_to_world, view.width, view.height)
    bihtree.render(tree, camera, passes=case.settings.passes, shadows=False)


def _seconds(case: Case, mode: str, parts: dict[str, bool]) -> float:
    start = perf_counter()
    if mode == STRIPPED:
        by_hand(case)
    else:
        _trace(case, parts)
    return perf_counter() - start


def compared(case: Case, mode: str, parts: dict[str, bool], pairs: int, ours: dict[str, bool] | None = None) -> Ratio:
    """Auto, or what `ours` says, and the mode in turn, each first in every other pair."""
    turn = [("auto", ours or {}), (mode, parts)]
    ratios, seconds = [], []
    for pair in range(-2, pairs):
        times = {who: _seconds(case, who, options) for who, options in (turn if pair % 2 else turn[::-1])}
        # Two pairs warm up.
        if pair >= 0:
            ratios.append(times["auto"] / times[mode])
            seconds.append(times["auto"])
    lower, upper = _interval(sorted(ratios))
    return Ratio(case.scene.name, mode, 1e3 * median(seconds), median(ratios), lower, upper)


def _interval(ordered: list[float]) -> tuple[float, float]:
    """Of the median with 95 % confidence: order statistics by the binomial distribution, whose normal form is near
    enough from 21 on."""
    count = len(ordered)
    rank = max(0, int((count - 1.96 * count**0.5) / 2))
    return ordered[rank], ordered[count - 1 - rank]


def measured(case: Case, pairs: int) -> list[Ratio]:
    """Every mode of a scene."""
    chosen = list(modes(case))
    if case.scene.name == STRIPPED_SCENE:
        chosen.append((STRIPPED, {}))
    return [compared(case, mode, parts, pairs) for mode, parts in chosen]


def verdict(ratio: Ratio) -> str:
    """Whether auto is within the limit, and how surely."""
    if ratio.middle <= LIMIT:
        return "met" if ratio.upper <= LIMIT else "met, within its interval not surely"
    return "**missed**" if ratio.lower > LIMIT else "**missed**, within its interval not surely"


def section(ratios: list[Ratio], pairs: int) -> str:
    """For the page."""
    rows = [
        [r.scene, r.mode, f"{r.milliseconds:.3g}", f"{r.middle:.3f}", f"{r.lower:.3f} – {r.upper:.3f}", verdict(r)]
        for r in ratios
    ]
    met = sum(ratio.middle <= LIMIT for ratio in ratios)
    heads = ["scene", "compared with", "auto, ms", "auto over it", "95 % interval", f"≤ {LIMIT}"]
    said = f"""Time to image by the scene's own choice ("auto") over that of another, by `python -m benchmarks.needs`:
the median of {pairs} alternating pairs. Below 1 auto is faster. What comes to the same as auto is not measured again.
"{STRIPPED}" is the least that a person would write for a scene that needs none of the parts. All gave the same bits.
"""
    facts = [f"- {what}: {fact}" for what, fact in machine.facts().items()]
    return "\n".join([said, *facts, f"- met: {met} of {len(ratios)}\n", table(heads, rows)])


def sweep(pairs: int) -> None:
    """Each part left out over the same kept, size by size."""
    for point in needs_sweep.points():
        found = compared(point.case, "kept", {point.part: True}, pairs, {point.part: False})
        where = f"{point.part}: {point.what}"
        print(
            f"{where:<48} {found.milliseconds:8.2f} ms, left out over kept {found.middle:.3f}"
            f"  [{found.lower:.3f}, {found.upper:.3f}]",
            flush=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.needs", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="assert the same bits on small scenes")
    parser.add_argument("--pairs", type=int, default=PAIRS, help=f"alternating pairs a row ({PAIRS})")
    parser.add_argument("--size", type=int, default=SIZE, help=f"triangles of the larger scenes ({SIZE:,})")
    parser.add_argument("--scene", action="append", choices=SCENES, help="only this one, printed; may be repeated")
    parser.add_argument("--sweep", action="store_true", help="where the thresholds lie, printed")
    arguments = parser.parse_args()
    if arguments.sweep:
        sweep(arguments.pairs)
        return 0
    ratios: list[Ratio] = []
    faults: list[str] = []
    for name in arguments.scene or SCENES:
        case = SCENES[name](QUICK_SIZE if arguments.quick else arguments.size)
        faults += differing(case)
        if arguments.quick or faults:
            continue
        for ratio in measured(case, arguments.pairs):
            ratios.append(ratio)
            print(
                f"{ratio.scene:<9} {ratio.mode:<34} {ratio.milliseconds:8.2f} ms  {ratio.middle:.3f}"
                f"  [{ratio.lower:.3f}, {ratio.upper:.3f}]  {verdict(ratio)}",
                flush=True,
            )
    for fault in faults:
        print(fault)
    if not faults and not arguments.quick and not arguments.scene:
        sections.refresh(PAGE, sections.NEEDS, section(ratios, arguments.pairs))
        print(PAGE)
    if not faults:
        print("the same bits in every mode")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
