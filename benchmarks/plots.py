"""Plots over the size of a scene."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt

from . import sides
from .plan import GROWING, SIZES
from .results import Results

mpl.use("svg")
# The same numbers make the same file.
mpl.rcParams["svg.hashsalt"] = "bihtree"
mpl.rcParams["svg.fonttype"] = "none"

COLOURS = {sides.DEFAULT: "C0", sides.SAH: "C2", sides.COMPACT: "C4", sides.LOW: "C1", sides.MEDIUM: "C3"}

Value = Callable[[str, str], float | None]


def draw(results: Results, folder: Path) -> dict[str, str]:
    """Write the pictures; their names, and what they show. None where nothing was measured."""
    if not any(results.triangles(f"{scene}@{size}") for scene in GROWING for size in SIZES):
        return {}
    folder.mkdir(parents=True, exist_ok=True)

    def build_time(scene: str, side: str) -> float | None:
        seconds, count = results.built(scene, side), results.triangles(scene)
        return None if seconds is None or not count else 1e9 * seconds / count

    def rate(kind: str) -> Value:
        def of(scene: str, side: str) -> float | None:
            found = results.best_rate(scene, kind, side)
            return None if found is None else found / 1e6

        return of

    traces = (sides.DEFAULT, sides.SAH, sides.MEDIUM)
    builds = (sides.DEFAULT, sides.SAH, sides.COMPACT, sides.LOW, sides.MEDIUM)
    plots: list[tuple[str, str, Value, tuple[str, ...], bool]] = [
        ("bench-build.svg", "build, nanoseconds a triangle", build_time, builds, True),
        ("bench-bytes.svg", "bytes a triangle beyond the mesh", results.bytes_a_triangle, builds, False),
        ("bench-primary.svg", "primary rays, millions a second, each side its best", rate("primary"), traces, True),
        ("bench-bounce.svg", "bounce rays, millions a second, each side its best", rate("bounce"), traces, True),
    ]
    for name, what, value, chosen, is_logarithmic in plots:
        _draw(results, folder / name, what, value, chosen, is_logarithmic)
    return {name: what for name, what, *_ in plots}


def _draw(results: Results, path: Path, what: str, value: Value, chosen: tuple[str, ...], is_logarithmic: bool) -> None:
    figure, axes = plt.subplots(1, len(GROWING), figsize=(4 * len(GROWING), 3.4), sharey=True, layout="constrained")
    for scene, axis in zip(GROWING, axes, strict=True):
        for side in chosen:
            points = [(results.triangles(f"{scene}@{size}"), value(f"{scene}@{size}", side)) for size in SIZES]
            known = [(count, height) for count, height in points if count and height]
            axis.plot(
                [count for count, _ in known],
                [height for _, height in known],
                marker=".",
                color=COLOURS[side],
                label=side,
            )
        axis.set_xscale("log")
        if is_logarithmic:
            axis.set_yscale("log")
        axis.set_title(scene)
        axis.set_xlabel("triangles")
        axis.grid(alpha=0.3)
    axes[0].set_ylabel(what)
    axes[0].legend(fontsize=7)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
