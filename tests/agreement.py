"""Do a tree's answers agree with the oracle? Decisions exactly, distances and weights within the promised bounds."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple, Protocol

import bihtree
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.meshes import Triangles
from tests.oracle import Oracle, Truth, ulp


class Rows(NamedTuple):
    """Answers that a test makes of bihtree.Hits."""

    t: NDArray[np.floating]
    triangle: NDArray[np.int32]
    u: NDArray[np.floating]
    v: NDArray[np.floating]
    instance: NDArray[np.int32]


class Answers(Protocol):
    """bihtree.Hits, or some of its rows."""

    @property
    def t(self) -> NDArray[np.floating]: ...
    @property
    def triangle(self) -> NDArray[np.int32]: ...
    @property
    def u(self) -> NDArray[np.floating]: ...
    @property
    def v(self) -> NDArray[np.floating]: ...
    @property
    def instance(self) -> NDArray[np.int32]: ...


class Promise(NamedTuple):
    """docs/accuracy.md: the error of t in ulp of a format or relative, the larger; of u and v in ulp and absolute."""

    format: type[np.floating]
    t_ulps: int
    t_relative: Fraction
    weight_ulps: int
    weight_error: Fraction

    def of_t(self, truth: Fraction) -> Fraction:
        return max(self.t_ulps * ulp(truth, self.format), self.t_relative * abs(truth))

    def of_weight(self, truth: Fraction) -> Fraction:
        return self.weight_ulps * ulp(truth, self.format) + self.weight_error


EXACT = Promise(np.float64, 1, Fraction(0), 1, Fraction(0))
# One ulp is more than that where t is subnormal.
WATERTIGHT = Promise(np.float64, 1, Fraction(1, 2**40), 0, Fraction(1, 2**32))
# Within 2^-32, then rounded to float32, in which weights are 2^-24 apart at most.
WATERTIGHT_FLOAT32 = Promise(np.float32, 1, Fraction(0), 0, Fraction(1, 2**32) + Fraction(1, 2**25))


def promise(precision: str, dtype: np.dtype) -> Promise:
    """What a precision promises of results of this type."""
    if precision == "exact":
        assert dtype == np.float64
        return EXACT
    return WATERTIGHT_FLOAT32 if dtype == np.float32 else WATERTIGHT


def distance_error(value: np.floating, truth: Fraction, promised: Promise) -> Fraction:
    """The error of t over what is allowed; above 1 is wrong. The nearest finite number stands for a truth beyond it."""
    if not np.isfinite(value):
        return Fraction(2)
    largest = Fraction(float(np.finfo(value.dtype).max))
    nearest = max(-largest, min(largest, truth))
    return _ratio(abs(Fraction(float(value)) - nearest), promised.of_t(nearest))


def weight_error(value: np.floating, truth: Fraction, promised: Promise) -> Fraction:
    """The error of u or v over what is allowed; above 1 is wrong."""
    if not 0 <= value <= 1:
        return Fraction(2)
    return _ratio(abs(Fraction(float(value)) - truth), promised.of_weight(truth))


def _ratio(error: Fraction, allowed: Fraction) -> Fraction:
    return Fraction(0) if error == 0 else error / allowed if allowed else Fraction(2)


def faults(hits: Answers, truth: Truth, precision: str = "watertight") -> list[str]:
    """One line for each ray whose answer is not the truth."""
    is_hit = truth.triangle >= 0
    is_named = (hits.triangle == truth.triangle) & (hits.instance == np.where(is_hit, 0, -1))
    is_named &= is_hit | (hits.t == np.inf)
    lines = [_misnamed(hits, truth, ray) for ray in np.flatnonzero(~is_named).tolist()]
    promised = promise(precision, hits.t.dtype)
    for ray in np.flatnonzero(is_named & is_hit & ~_are_close(hits, truth, promised)).tolist():
        lines += _beyond_bounds(hits, truth, ray, promised)
    return lines


def _misnamed(hits: Answers, truth: Truth, ray: int) -> str:
    expected = truth.hit(ray)
    right = f"triangle {expected.triangle} at {float(expected.t)!r}" if expected else "a miss"
    found = f"triangle {hits.triangle[ray]} at {hits.t[ray]}, instance {hits.instance[ray]}"
    return f"ray {ray}: {found}; truth: {right}"


def _are_close(hits: Answers, truth: Truth, promised: Promise) -> NDArray[np.bool_]:
    """(N,) whether t, u and v of a hit are within their bounds beyond doubt."""
    hit = np.flatnonzero(truth.triangle >= 0)
    near = truth.approximate
    close = np.zeros(len(truth), np.bool_)
    with np.errstate(all="ignore"):
        close[hit] = (
            (np.minimum(hits.u, hits.v)[hit] >= 0)
            & (np.maximum(hits.u, hits.v)[hit] <= 1)
            & _is_close(hits.t[hit], near.t, near.t_error, promised.format, promised.t_ulps, 0, promised.t_relative)
            & _is_close(hits.u[hit], near.u, near.u_error, promised.format, promised.weight_ulps, promised.weight_error)
            & _is_close(hits.v[hit], near.v, near.v_error, promised.format, promised.weight_ulps, promised.weight_error)
        )
    return close


def _is_close(
    found: NDArray[np.floating],
    truth: NDArray[np.floating],
    error: NDArray[np.floating],
    spacing: type[np.floating],
    ulps: int,
    absolute: Fraction | int,
    relative: Fraction | int = 0,
) -> NDArray[np.bool_]:
    """No false True: the truth is taken as far off, and its ulp as small, as it can be."""
    smallest = np.nextafter(np.maximum(np.abs(truth) - error, 0).astype(spacing), spacing(0))
    allowed = np.maximum(ulps * np.spacing(smallest).astype(np.float64), float(relative) * smallest) + float(absolute)
    off = np.abs(found.astype(truth.dtype) - truth) + error
    return np.asarray(off * (1 + 2.0**-50) <= allowed)


def _beyond_bounds(hits: Answers, truth: Truth, ray: int, promised: Promise) -> Iterator[str]:
    expected = truth.hit(ray)
    assert expected
    if distance_error(hits.t[ray], expected.t, promised) > 1:
        yield f"ray {ray}: triangle {expected.triangle}: t {hits.t[ray]!r}; truth {float(expected.t)!r}"
    for name, found, weight in (("u", hits.u[ray], expected.u), ("v", hits.v[ray], expected.v)):
        if weight_error(found, weight, promised) > 1:
            yield f"ray {ray}: triangle {expected.triangle}: {name} {found!r}; truth {float(weight)!r}"


@lru_cache(maxsize=16)
def _decided(*packed: tuple[bytes, str, tuple[int, ...]]) -> Truth:
    vertices, triangles, *rays = (np.frombuffer(data, dtype).reshape(shape) for data, dtype, shape in packed)
    return Oracle(vertices, triangles).decide(*rays)


def truth_of(mesh: Triangles, *rays: NDArray[np.floating]) -> Truth:
    """The oracle's closest hits, remembered, because every variant of a tree is asked about the same rays."""
    return _decided(*((array.tobytes(), array.dtype.str, array.shape) for array in (*mesh, *rays)))


def assert_true(
    tree: bihtree.Tree,
    mesh: Triangles,
    origins: ArrayLike,
    directions: ArrayLike,
    t_min: ArrayLike = 0.0,
    t_max: ArrayLike = np.inf,
) -> bihtree.Hits:
    """Closest hit, any hit and the count of invalid rays are the oracle's."""
    origin, direction = np.atleast_2d(origins), np.atleast_2d(directions)
    near, far = (np.broadcast_to(np.asarray(limit, np.float64), len(origin)) for limit in (t_min, t_max))
    expected = truth_of(mesh, origin, direction, near, far)
    hits = tree.intersect(origin, direction, t_min=near, t_max=far)
    assert len(hits) == len(expected)
    assert_answers(hits, expected, tree.stats.precision)
    hit = expected.triangle >= 0
    assert np.array_equal(hits.hit, hit)
    occluded = tree.occluded(origin, direction, t_min=near, t_max=far)
    assert occluded.dtype == np.bool_
    assert np.flatnonzero(occluded != hit).tolist() == []
    assert hits.invalid == int((~expected.is_valid).sum())
    return hits


def assert_answers(hits: Answers, expected: Truth, precision: str) -> None:
    """No fault; answers with the bits of others of this precision that had none need no proof again."""
    bits = {name: getattr(hits, name).tobytes() for name in ("t", "triangle", "u", "v", "instance")}
    known = expected.proved.setdefault(f"{precision} {hits.t.dtype}", {})
    if bits != known:
        wrong = faults(hits, expected, precision)
        assert not wrong, f"{len(wrong)} faults in {len(expected)} rays:\n" + "\n".join(wrong[:20])
        known.update(bits)


def assert_same(a: bihtree.Hits, b: bihtree.Hits) -> None:
    """Every array of the answers has the same bits."""
    for name in ("t", "triangle", "u", "v", "instance"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    assert a.invalid == b.invalid
