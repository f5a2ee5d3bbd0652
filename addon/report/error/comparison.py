"""Answers beside the truth: what is wrong, and by how much."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .methods import Answers
from .truth import Nearest

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Comparison:
    """(N,) each. A triangle is right if no other that the ray hits is nearer: of several at one t, any."""

    missed: Flags
    """The ray hits something, and the answer is a miss."""
    false_hit: Flags
    """The ray hits nothing, and the answer names a triangle."""
    other_triangle: Flags
    """It hits something, and the answer names a triangle that it does not hit, or that is not nearest."""
    t_error: NDArray[np.float64]
    """Of right triangles, in ulp of float32 at the true t; NaN for the others."""

    @property
    def wrong(self) -> Flags:
        return self.missed | self.false_hit | self.other_triangle


def compared(answers: Answers, truth: Nearest) -> Comparison:
    """Row by row."""
    rows = answers.triangle.astype(np.int64)
    is_right = rows == truth.triangle
    for ray, tied in truth.ties.items():
        is_right[ray] = rows[ray] in tied
    error = np.full(len(rows), np.nan)
    chosen = is_right & truth.hit
    t = answers.t[chosen].astype(np.float64)
    with np.errstate(all="ignore"):
        error[chosen] = np.abs((t - truth.t[chosen]) - truth.rest[chosen]) / ulp(truth.t[chosen])
    both = (rows >= 0) & truth.hit
    return Comparison(truth.hit & (rows < 0), (rows >= 0) & ~truth.hit, both & ~is_right, error)


def ulp(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """The spacing of float32 at t; that of the subnormals near 0."""
    _, exponent = np.frexp(t)
    return np.ldexp(1.0, np.where(t == 0, -149, np.clip(exponent - 24, -149, 104)))


def neighbours(answers: Answers, truth: Nearest, comparison: Comparison, corners: NDArray[np.floating[Any]]) -> Flags:
    """(N,) where another triangle than the nearest is named, and shares a corner with it: hardly seen in a picture."""
    found = np.zeros_like(comparison.missed)
    for ray in np.flatnonzero(comparison.other_triangle).tolist():
        nearest = truth.ties.get(ray, (int(truth.triangle[ray]),))
        named = {tuple(corner) for corner in corners[answers.triangle[ray]].tolist()}
        found[ray] = any(tuple(corner) in named for row in nearest for corner in corners[row].tolist())
    return found


def leaks(answers: Answers, truth: Nearest, comparison: Comparison, is_neighbour: Flags) -> Flags:
    """(N,) rays that slip through what they hit: a miss, or a triangle further away that is no neighbour."""
    beyond = answers.t.astype(np.float64) > truth.t
    return comparison.missed | (comparison.other_triangle & ~is_neighbour & beyond)


def quantile(errors: NDArray[np.float64], share: float) -> float | None:
    """Of the finite ones; None where there are none."""
    known = errors[~np.isnan(errors)]
    return float(np.quantile(known, share, method="higher")) if len(known) else None
