"""Do a tree's answers agree with the oracle? Decisions exactly, distances and weights within the promised bounds."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Protocol

import bihtree
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.meshes import Triangles
from tests.oracle import Hit, Oracle, is_valid, ulp

WEIGHT_ERROR = {np.dtype(np.float32): Fraction(1, 2**22), np.dtype(np.float64): Fraction(1, 2**32)}
T_ERROR_FLOAT64 = Fraction(1, 2**40)


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


def distance_error(value: np.floating, truth: Fraction) -> Fraction:
    """The error of t over what is allowed: 1 ulp for float32, 2^-40 of the value for float64; above 1 is wrong.

    The nearest finite number stands for a truth beyond it.
    """
    if not np.isfinite(value):
        return Fraction(2)
    largest = Fraction(float(np.finfo(value.dtype).max))
    nearest = max(-largest, min(largest, truth))
    error = abs(Fraction(float(value)) - nearest)
    allowed = ulp(nearest, np.float32) if value.dtype == np.float32 else abs(nearest) * T_ERROR_FLOAT64
    return Fraction(0) if error == 0 else error / allowed if allowed else Fraction(2)


def faults(hits: Answers, truth: list[Hit | None]) -> list[str]:
    """One line for each ray whose answer is not the truth."""
    lines = []
    for ray, expected in enumerate(truth):
        triangle, t, u, v = int(hits.triangle[ray]), hits.t[ray], hits.u[ray], hits.v[ray]
        if expected is None:
            if triangle != -1 or t != np.inf or hits.instance[ray] != -1:
                lines.append(f"ray {ray}: triangle {triangle} at {t}, instance {hits.instance[ray]}; truth: a miss")
        elif triangle != expected.triangle or hits.instance[ray] != 0:
            lines.append(
                f"ray {ray}: triangle {triangle} at {t}, instance {hits.instance[ray]}; "
                f"truth: triangle {expected.triangle} at {float(expected.t)!r}"
            )
        elif distance_error(t, expected.t) > 1:
            lines.append(f"ray {ray}: triangle {triangle}: t {t!r}; truth {float(expected.t)!r}")
        else:
            allowed = WEIGHT_ERROR[hits.u.dtype]
            for name, weight, exact in (("u", u, expected.u), ("v", v, expected.v)):
                if not (np.isfinite(weight) and abs(Fraction(float(weight)) - exact) <= allowed):
                    lines.append(f"ray {ray}: triangle {triangle}: {name} {weight!r}; truth {float(exact)!r}")
    return lines


@lru_cache(maxsize=16)
def _closest(*packed: tuple[bytes, str, tuple[int, ...]]) -> list[Hit | None]:
    vertices, triangles, *rays = (np.frombuffer(data, dtype).reshape(shape) for data, dtype, shape in packed)
    return Oracle(vertices, triangles).closest(*rays)


def truth_of(mesh: Triangles, *rays: NDArray[np.floating]) -> list[Hit | None]:
    """The oracle's closest hits, remembered, because every variant of a tree is asked about the same rays."""
    return _closest(*((array.tobytes(), array.dtype.str, array.shape) for array in (*mesh, *rays)))


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
    wrong = faults(hits, expected)
    assert not wrong, f"{len(wrong)} of {len(expected)} rays are wrong:\n" + "\n".join(wrong[:20])
    hit = [found is not None for found in expected]
    assert hits.hit.tolist() == hit
    occluded = tree.occluded(origin, direction, t_min=near, t_max=far)
    assert occluded.dtype == np.bool_
    assert np.flatnonzero(occluded != hit).tolist() == []
    valid = [is_valid(origin[i], direction[i], near[i], far[i]) for i in range(len(origin))]
    assert hits.invalid == valid.count(False)
    return hits


def assert_same(a: bihtree.Hits, b: bihtree.Hits) -> None:
    """Every array of the answers has the same bits."""
    for name in ("t", "triangle", "u", "v", "instance"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    assert a.invalid == b.invalid
