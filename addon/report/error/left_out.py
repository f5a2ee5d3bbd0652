"""What was left out for a scene, and what each part would have cost: measured by forcing it on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

from ...pipeline import preview
from ...pipeline.settings import PARTS
from .hits import Span, span
from .progress import Progress
from .subject import Subject

ALL = "all of them"


@dataclass
class Row:
    """A part: kept or left out, why, what that saves; of one that is left out and can be forced on, times to the
    finished picture in seconds without and with it, in turn, and the ratios of the pairs."""

    name: str
    kept: bool
    why: str
    saves: str = ""
    without: Span | None = None
    forced: Span | None = None
    ratio: Span | None = None


@dataclass
class LeftOut:
    """The section, filled part by part."""

    rows: list[Row] = field(default_factory=list)
    picture: str = ""


def measure(left_out: LeftOut, subject: Subject, width: int, pairs: int, progress: Progress) -> None:
    """Fill `left_out`. Raises Cancelled and KeyboardInterrupt; what was measured before stays in it."""
    progress.begin("left out")
    subject = subject.in_width(width)
    left_out.picture = f"{subject.camera.width} x {subject.camera.height}, {subject.settings.samples} samples"
    chosen = _table(subject, {})
    left_out.rows += [Row(part["part"], part["kept"], part["why"], part["saves"]) for part in chosen.values()]
    everything = Row(ALL, False, "every part that can be is forced on")
    for number, row in enumerate([*left_out.rows, everything]):
        progress.tell(row.name, number / (len(left_out.rows) + 1))
        parts = dict.fromkeys(PARTS, True) if row is everything else {row.name: True}
        if row is everything:
            left_out.rows.append(row)
        elif row.kept or row.name not in PARTS or not _table(subject, parts)[row.name]["kept"]:
            continue
        _compare(row, subject, parts, pairs)


def _trace(subject: Subject, parts: Mapping[str, bool]) -> preview.Preview:
    settings = replace(subject.settings, parts={**subject.settings.parts, **parts})
    return preview.trace(subject.scene, settings, outputs=preview.Outputs())


def _table(subject: Subject, parts: Mapping[str, bool]) -> dict[str, dict[str, Any]]:
    rows: list[dict[str, Any]] = _trace(subject, parts).report["needs"]
    return {row["part"]: row for row in rows}


def _compare(row: Row, subject: Subject, parts: Mapping[str, bool], pairs: int) -> None:
    """Each first in every other pair."""
    without: list[float] = []
    forced: list[float] = []
    for pair in range(pairs):
        for choice in ({}, parts) if pair % 2 else (parts, {}):
            started = perf_counter()
            _trace(subject, choice)
            (forced if choice else without).append(perf_counter() - started)
    row.without, row.forced = span(without), span(forced)
    row.ratio = span([two / one for one, two in zip(without, forced, strict=True)])
