"""The benchmarks on small scenes, for CI: answers, counts and determinism are asserted, clocks are not read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from . import sides
from .harness import Harness, Result
from .meshes import Unavailable, written
from .plan import KINDS

SCENES = ("terrain@20000", "soup@20000", "gears@20000", "city@20000", "balls@20000", "stadium/3@20000", "bunny")

OURS = (sides.DEFAULT, sides.LOCAL, sides.SAH, sides.COMPACT, sides.CLASSIC, sides.WATERTIGHT)

COUNTS = ("missed", "invented", "nearer", "farther")

FAST_WRONG = 1e-4
"""The share of its rays that `fast`, or Embree's ROBUST, may answer in another way than exact arithmetic does."""

DIFFERING_PIXELS = 0.01
"""The share of pixels, those on edges, that two ways of shading in float32 and float64 may give another light."""


def check() -> int:
    """0 if all is as it should be; else each fault in a line, and 1."""
    harness = Harness.built()
    known = harness.known([*OURS, *sides.PEERS, "obvhs/bvh2/fastest", "obvhs/cwbvh/medium"])
    faults: list[str] = []
    for name in SCENES:
        try:
            faults += [f"{name}: {fault}" for fault in _faults(name, harness, known)]
        except Unavailable as reason:
            print(f"skipped: {reason}")
    for fault in faults:
        print(fault)
    if not faults:
        print("answers, counts and determinism hold")
    return 1 if faults else 0


def _faults(name: str, harness: Harness, known: set[str]) -> Iterator[str]:
    ours = [side for side in OURS if side in known]
    calls = [*ours, *(f"{side}@1" for side in ours)]
    for side in sorted(known - set(OURS)):
        calls += [f"{side}@{call}" for call in (sides.ALL_CALLS if side == sides.MEDIUM else ("1",))]
    images = [side for side in (sides.LOW, sides.MEDIUM, *ours) if side in known]
    runs = {}
    for threads in (1, 2):
        options = {"threads": str(threads), "rounds": "1", "seconds": "0", "size": "192x144"}
        options |= {"build": ",".join(sorted(known)), "trace": ",".join(calls)}
        options |= {"image": ",".join(images), "samples": "1,2"}
        runs[threads] = harness.run(written(name), options)
    yield from _wrong_answers(runs[2])
    yield from _broken_promises(runs[2])
    yield from _differing_pictures(runs[2])
    yield from _differences(runs[1], runs[2])


def _wrong_answers(run: Result) -> Iterator[str]:
    for kind in KINDS:
        for call, row in run["trace"][kind].items():
            # The peers' answers are theirs, but for the one that is meant to be right.
            if call.endswith("@cost") or sides.side_of(call) not in (*OURS, sides.ROBUST):
                continue
            wrong = sum(row.get(count, 0) for count in COUNTS)
            is_exact = call.startswith("bih/") and "/fast" not in call
            allowed = 0 if is_exact else max(3, FAST_WRONG * row["rays"])
            if wrong > allowed:
                yield f"{call}, {kind}: {wrong} of {row['rays']} answers are wrong"


def _broken_promises(run: Result) -> Iterator[str]:
    for side, facts in run["build"].items():
        if not side.startswith("bih/"):
            continue
        if facts["tree_bytes"] > facts["bound_bytes"]:
            yield f"{side}: {facts['tree_bytes']} bytes, the bound was {facts['bound_bytes']}"
        if facts["held_bytes"] > 1.02 * facts["tree_bytes"] + 65536:
            yield f"{side}: {facts['held_bytes']} bytes held, {facts['tree_bytes']} stated"
        # What is stated leaves out what the threads hold in passing.
        if facts["peak_bytes"] > 1.25 * facts["stated_peak_bytes"] + 65536:
            yield f"{side}: {facts['peak_bytes']} bytes at the peak, {facts['stated_peak_bytes']} stated"


def _differing_pictures(run: Result) -> Iterator[str]:
    for samples, rows in run["image"].items():
        for side, facts in rows.items():
            if facts["differing_pixels"] > DIFFERING_PIXELS * 192 * 144:
                yield f"{side}, {samples} samples: {facts['differing_pixels']} pixels differ from Embree's"


def _differences(alone: Result, together: Result) -> Iterator[str]:
    """Between one thread and two: of our answers, steps and sizes there are none."""
    for kind in KINDS:
        for call, row in together["trace"][kind].items():
            if call.startswith("bih/") and _counts(row) != _counts(alone["trace"][kind][call]):
                yield f"{call}, {kind}: other answers or steps on two threads than on one"
    for side, facts in together["build"].items():
        for fact in ("nodes", "leaves", "depth", "tree_bytes"):
            if side.startswith("bih/") and facts[fact] != alone["build"][side][fact]:
                yield f"{side}: {facts[fact]} {fact} on two threads, {alone['build'][side][fact]} on one"


def _counts(row: dict[str, Any]) -> dict[str, Any]:
    clocks = {"seconds", "least", "rounds", "rays_a_second"}
    return {name: value for name, value in row.items() if name not in clocks}
