"""Markdown tables of bars."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from addon.report.markdown import number as number
from addon.report.markdown import table as table

from .bars import Row


def with_unit(value: float | None, unit: str) -> str:
    """A number and its unit; a dash alone for what was not measured."""
    return number(value) if value is None or not unit else f"{number(value)} {unit}"


def verdict(row: Row) -> str:
    """In a word."""
    return {True: "met", False: "**missed**", None: "not measured"}[row.is_met]


def bar_table(rows: Iterable[Row]) -> str:
    """Each bar on each scene."""
    cells = (
        [
            row.bar,
            row.scene,
            with_unit(row.ours, row.unit),
            with_unit(row.peer, row.unit),
            number(row.ratio),
            f"{row.bound} {row.limit:g}",
            verdict(row),
        ]
        for row in rows
    )
    return table(["bar", "scene", "ours", "peer", "ratio", "bound", ""], cells)


def summary_table(rows: Sequence[Row]) -> str:
    """A line a bar: how often it is met, and where it is worst."""
    lines = []
    for bar in dict.fromkeys(row.bar for row in rows):
        of_it = [row for row in rows if row.bar == bar]
        measured = [(row.ratio, row) for row in of_it if row.ratio is not None]
        bounds = " or ".join(dict.fromkeys(f"{row.bound} {row.limit:g}" for row in of_it))
        if not measured:
            lines.append([bar, bounds, "–", "–", f"not measured, 0 of {len(of_it)}"])
            continue
        # The farthest from its own bound, as a share of it.
        worst = max(measured, key=lambda pair: pair[0] / pair[1].limit * (1 if pair[1].bound == "≤" else -1))[1]
        met = sum(row.is_met is True for row in of_it)
        ratios = [ratio for ratio, _ in measured]
        spread = f"{number(min(ratios))} – {number(max(ratios))}"
        said = f"met, {met} of {len(of_it)}" if met == len(of_it) else f"**{met} of {len(of_it)}**"
        lines.append([bar, bounds, spread, worst.scene, said])
    return table(["bar", "bound", "ratios", "worst", "met"], lines)
