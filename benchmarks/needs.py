"""Measure what leaving parts out is worth: `python -m benchmarks.needs`, on an idle machine.

    python -m benchmarks.needs                 ten scenes, 21 alternating pairs a row; a section of docs/benchmarks.md
    python -m benchmarks.needs --scene ball    one scene, printed only
    python -m benchmarks.needs --sweep         where the thresholds lie: one part kept and left out, over sizes; printed
    python -m benchmarks.needs --instructions  the same by instructions retired, for a machine that is not idle
    python -m benchmarks.needs --quick         small scenes; the same bits are asserted, no clock is read

A row is the time to image by the scene's own choice ("auto") over that with every part kept, every part left out where
the picture stays the same, or one part's choice turned.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from statistics import median
from time import perf_counter

import bihtree
import numpy as np

from addon.pipeline import preview
from addon.pipeline.settings import PARTS

from . import needs_instructions, needs_page, needs_sweep, sections
from .needs_page import STRIPPED, Ratio
from .needs_scenes import SCENES, Case
from .page import PAGE

SIZE, QUICK_SIZE, COUNTED_SIZE = 200_000, 3_000, 20_000
SHRUNK = 2
"""Times that a picture has fewer pixels a side where instructions are counted."""
PAIRS = 21
STRIPPED_SCENE = "ball"

OF_THE_TREE = {"tree", "objects out of reach", "double precision"}
"""Parts that change what the cost pass counts."""
ROUNDED = {"instances"}
"""Flattened, a moved vertex is rounded to the precision of its mesh: the picture is nearly the same."""
SAME_BITS = [part for part in PARTS if part not in ROUNDED]


def modes(case: Case) -> Iterator[tuple[str, dict[str, bool]]]:
    """Those whose choice is another one than auto's: all on, all off, and each part turned alone."""
    chosen = _kept(case, {})
    seen = [chosen]
    tried = [("all on", dict.fromkeys(SAME_BITS, True)), ("all off", dict.fromkeys(SAME_BITS, False))]
    tried += [
        (f"{part}: {'left out' if kept else 'kept'}", {part: not kept})
        for part, kept in chosen.items()
        if part in SAME_BITS
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


def counted(names: Iterable[str]) -> None:
    """Do what `instructions` counts, scene by scene."""
    work: list[needs_instructions.Work] = []
    for name in names:
        case = SCENES[name](COUNTED_SIZE).smaller(SHRUNK)
        for mode, parts in [("auto", {}), *_modes_to_compare(case)]:
            work.append((f"{name}/{mode}", partial(_seconds, case, mode, parts)))
    needs_instructions.run(work)


def instructions(names: Sequence[str]) -> list[Ratio]:
    """As `measured`, of instructions; an interval is a point."""
    words = [word for name in names for word in ("--scene", name)]
    found = needs_instructions.counts(["benchmarks.needs", "--counted", *words])
    ratios = []
    for key, count in found.items():
        scene, _, mode = key.partition("/")
        auto = found[f"{scene}/auto"]
        if mode != "auto" and not mode.startswith("threads:"):
            ratios.append(Ratio(scene, mode, auto / 1e6, auto / count, auto / count, auto / count))
    return ratios


def _interval(ordered: list[float]) -> tuple[float, float]:
    """Of the median with 95 % confidence: order statistics by the binomial distribution, whose normal form is near
    enough from 21 on."""
    count = len(ordered)
    rank = max(0, int((count - 1.96 * count**0.5) / 2) - 1)
    return ordered[rank], ordered[count - 1 - rank]


def _modes_to_compare(case: Case) -> list[tuple[str, dict[str, bool]]]:
    return [*modes(case), *([(STRIPPED, {})] if case.scene.name == STRIPPED_SCENE else [])]


def measured(case: Case, pairs: int) -> list[Ratio]:
    """Every mode of a scene."""
    found = []
    for mode, parts in _modes_to_compare(case):
        found.append(compared(case, mode, parts, pairs))
        print(needs_page.line(found[-1]), flush=True)
    return found


def sweep(pairs: int) -> None:
    """Each part left out over the same kept, size by size."""
    for point in needs_sweep.points():
        found = compared(point.case, "kept", {point.part: True}, pairs, {point.part: False})
        where = f"{point.part}: {point.what}"
        print(
            f"{where:<48} {found.auto:8.2f} ms, left out over kept {found.middle:.3f}"
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
    parser.add_argument("--instructions", action="store_true", help="count instructions instead of time")
    parser.add_argument("--counted", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--sweep", action="store_true", help="where the thresholds lie, printed")
    arguments = parser.parse_args()
    if arguments.counted:
        counted(arguments.scene or SCENES)
        return 0
    if arguments.sweep:
        sweep(arguments.pairs)
        return 0
    names = arguments.scene or list(SCENES)
    faults: list[str] = []
    for name in names:
        faults += differing(SCENES[name](QUICK_SIZE if arguments.quick else arguments.size))
    if faults:
        print("\n".join(faults))
        return 1
    print("the same bits in every mode")
    if arguments.quick:
        return 0
    if arguments.instructions:
        ratios = instructions(names)
        print("\n".join(map(needs_page.line, ratios)))
        title, text = sections.NEEDS_COUNTED, needs_page.counted_section(ratios)
    else:
        ratios = [ratio for name in names for ratio in measured(SCENES[name](arguments.size), arguments.pairs)]
        title, text = sections.NEEDS, needs_page.timed_section(ratios, arguments.pairs)
    if not arguments.scene:
        sections.refresh(PAGE, title, text)
        print(PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
