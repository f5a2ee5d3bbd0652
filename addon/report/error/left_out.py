"""What was left out for a scene, and what each part would have cost: measured by forcing it on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from time import perf_counter
from typing import Any, NamedTuple

from ...pipeline import preview
from ...pipeline.settings import PARTS
from ..markdown import number
from .hits import Span, span
from .pace import PATIENT, SMALLER, Pace, fitting, tried, why_less, widths
from .progress import Progress, TellsOfPicture
from .subject import Subject

ALL = "all of them"
FEWER = (5, 3)
"""Pairs that are tried before pictures get narrower."""


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
    notes: list[str] = field(default_factory=list)


class Plan(NamedTuple):
    """How large the pictures are, and how many pairs of them each part is measured by."""

    width: int
    pairs: int


def planned(pace: Pace, width: int, pairs: int, parts: int, limit: float) -> Plan:
    """The widest pictures by which so many parts fit the limit, and of those the most pairs. `pace` is that of pictures
    of the whole width."""

    def seconds(plan: Plan) -> float:
        return _seconds(pace, plan, width, parts)

    fewer = [pairs, *(few for few in FEWER if few < pairs)]
    return fitting((Plan(wide, count) for wide in widths(width) for count in fewer), seconds, limit)


def _seconds(pace: Pace, plan: Plan, width: int, parts: int) -> float:
    return (1 + parts * (1 + 2 * plan.pairs)) * pace.of((plan.width / width) ** 2)


def measure(left_out: LeftOut, subject: Subject, width: int, pairs: int, patience: float, progress: Progress) -> None:
    """Fill `left_out`, by fewer and smaller pictures where patience asks for that. Raises Cancelled and
    KeyboardInterrupt; what was measured before stays in it."""
    progress.begin("left out")
    subject = subject.in_width(width)
    asked, samples = subject.camera.width, subject.settings.samples
    pace = tried(subject, partial(_trace, parts={}), patience)
    small = subject.in_width(max(1, asked // SMALLER[0]))
    parts = 1 + sum(not part["kept"] and name in PARTS for name, part in _table(small, {}).items())
    plan = planned(pace, asked, pairs, parts, PATIENT * patience)
    subject = subject.in_width(plan.width)
    progress.expect(_seconds(pace, plan, asked, parts))
    left_out.picture = f"{subject.size}, {samples} {'samples' if samples > 1 else 'sample'} a pixel"
    if plan != (asked, pairs):
        what = f"{plan.pairs} pairs of pictures of {subject.size}"
        whole = f"one of that width takes {number(pace.of(1.0))} s"
        why = why_less(what, f"{pairs} of {asked} across", PATIENT * patience, whole)
        narrower = " A narrower picture is made of fewer rays, so that what is built weighs more in these times."
        left_out.notes.append(why + (narrower if plan.width < asked else ""))
    chosen = _table(subject, {})
    left_out.rows += [Row(part["part"], part["kept"], part["why"], part["saves"]) for part in chosen.values()]
    forced: list[tuple[Row, dict[str, bool]]] = [
        (row, {row.name: True}) for row in left_out.rows if not row.kept and row.name in PARTS
    ]
    left_out.rows.append(Row(ALL, False, "every part that can be is forced on"))
    forced.append((left_out.rows[-1], dict.fromkeys(PARTS, True)))
    for place, (row, on) in enumerate(forced):
        progress.tell(row.name, place / len(forced))
        if row.name == ALL or _table(subject, on)[row.name]["kept"]:
            shares = [(place + done / (2 * plan.pairs)) / len(forced) for done in range(2 * plan.pairs + 1)]
            _compare(row, subject, on, [progress.of_picture(row.name, *ends) for ends in pairwise(shares)])


def _trace(subject: Subject, parts: Mapping[str, bool], told: TellsOfPicture | None = None) -> preview.Preview:
    settings = replace(subject.settings, parts={**subject.settings.parts, **parts})
    return preview.trace(subject.scene, settings, outputs=preview.Outputs(), progress=told)


def _table(subject: Subject, parts: Mapping[str, bool]) -> dict[str, dict[str, Any]]:
    rows: list[dict[str, Any]] = _trace(subject, parts).report["needs"]
    return {row["part"]: row for row in rows}


def _compare(row: Row, subject: Subject, parts: Mapping[str, bool], tellers: Sequence[TellsOfPicture]) -> None:
    """Two pictures a pair, each first in every other one."""
    without: list[float] = []
    forced: list[float] = []
    for picture, told in enumerate(tellers):
        choice = parts if picture % 4 in (0, 3) else {}
        started = perf_counter()
        _trace(subject, choice, told)
        (forced if choice else without).append(perf_counter() - started)
    row.without, row.forced = span(without), span(forced)
    row.ratio = span([two / one for one, two in zip(without, forced, strict=True)])
