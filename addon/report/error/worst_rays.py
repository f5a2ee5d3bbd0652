"""The worst rays of each method: the wrong answers that are furthest off, beside everybody's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...pipeline.mesh import Mesh
from .comparison import Comparison
from .methods import Answers, Method
from .rays import Kind, Rays
from .truth import Nearest

WORST = 5


def of(kind: str, every: int, answers: Answers, truth: Nearest, comparison: Comparison) -> list[dict[str, Any]]:
    """The wrong answers that are furthest off, relatively; a hit or miss turned round is off without end."""
    rows = np.flatnonzero(comparison.wrong)
    with np.errstate(all="ignore"):
        off = np.abs(answers.t[rows].astype(np.float64) - truth.t[rows]) / truth.t[rows]
    off = np.where(np.isfinite(off), off, np.inf)
    return [
        {"kind": kind, "ray": int(rows[i]) * every, "off": float(off[i])}
        for i in np.argsort(-off, kind="stable")[:WORST]
    ]


def beside(
    present: Sequence[tuple[Method, int, Sequence[Mapping[str, Any]]]],
    answered: Mapping[str, Mapping[str, Answers]],
    kinds: Mapping[str, Kind],
    mesh: Mesh,
) -> list[dict[str, Any]]:
    """The worst rays of each method that has any, with what every method answers; `present` are
    methods, of how many rays they were given one, and their worst; those that were given a part are asked again."""
    whose: dict[tuple[str, int], list[str]] = {}
    for method, _, worst in present:
        for ray in worst:
            whose.setdefault((ray["kind"], ray["ray"]), []).append(method.name)
    if not whose:
        return []
    chosen = Rays(
        np.stack([kinds[kind].rays.origins[row] for kind, row in whose]),
        np.stack([kinds[kind].rays.directions[row] for kind, row in whose]),
    )
    again = {method.name: method.build(mesh).trace(chosen) for method, every, _ in present if every > 1}
    table = []
    for place, ((kind, row), names) in enumerate(whose.items()):
        answers = {
            method.name: _answer(again[method.name], place)
            if method.name in again
            else _answer(answered[method.name][kind], row)
            for method, _, _ in present
        }
        truth = kinds[kind].truth
        right = truth.ties.get(row, (int(truth.triangle[row]),))
        for answer in answers.values():
            answer["is_wrong"] = answer["triangle"] not in right
        table.append(
            {
                "worst_of": names,
                "kind": kind,
                "ray": row,
                "origin": chosen.origins[place].tolist(),
                "direction": chosen.directions[place].tolist(),
                "truth": _answer(Answers(truth.triangle, truth.t), row),
                "answers": answers,
            }
        )
    return table


def _answer(answers: Answers, ray: int) -> dict[str, Any]:
    row = int(answers.triangle[ray])
    return {"triangle": row, "t": None if row < 0 else float(answers.t[ray])}
