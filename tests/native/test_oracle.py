"""The oracle itself, on triangles made by hand and against itself without its filter."""

from fractions import Fraction

import numpy as np
import pytest

from tests import meshes
from tests.oracle import Hit, Oracle, crossing, exact, is_valid, ulp

INF, NAN = float("inf"), float("nan")
RIGHT = ((0, 0, 0), (4, 0, 0), (0, 4, 0))


def cross(origin, direction, corners=RIGHT):
    return crossing(exact(origin), exact(direction), *(exact(corner) for corner in corners))


@pytest.mark.parametrize(
    ("origin", "direction", "t", "u", "v"),
    [
        ((1, 1, 3), (0, 0, -1), 3, Fraction(1, 4), Fraction(1, 4)),
        ((1, 2, -3), (0, 0, 2), Fraction(3, 2), Fraction(1, 4), Fraction(1, 2)),
        ((1, 1, -1), (0, 0, -1), -1, Fraction(1, 4), Fraction(1, 4)),
        ((0, 0, 1), (0, 0, -1), 1, 0, 0),
        ((4, 0, 1), (0, 0, -1), 1, 1, 0),
        ((0, 4, 1), (0, 0, -1), 1, 0, 1),
        ((2, 0, 1), (0, 0, -1), 1, Fraction(1, 2), 0),
        ((0, 3, 1), (0, 0, -1), 1, 0, Fraction(3, 4)),
        ((2, 2, 1), (0, 0, -1), 1, Fraction(1, 2), Fraction(1, 2)),
        ((-2, -2, -3), (1, 1, 1), 3, Fraction(1, 4), Fraction(1, 4)),
        ((1, 1, 0), (1, 2, 3), 0, Fraction(1, 4), Fraction(1, 4)),
    ],
)
def test_hit(origin, direction, t, u, v):
    assert cross(origin, direction) == (t, u, v)


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)])
def test_neither_order_nor_side_changes_a_hit(order):
    corners = [RIGHT[i] for i in order]
    assert cross((2, 2, 1), (0, 0, -1), corners) is not None
    assert cross((2, 2, -1), (0, 0, 1), corners) is not None
    assert cross((2, np.nextafter(2, 3), 1), (0, 0, -1), corners) is None


@pytest.mark.parametrize(
    ("origin", "direction"),
    [
        ((-1e-300, 1, 1), (0, 0, -1)),
        ((2, np.nextafter(2, 3), 1), (0, 0, -1)),
        ((1, -5e-324, 1), (0, 0, -1)),
        ((1, 1, 1), (1, 0, 0)),
        ((-1, 1, 0), (1, 0, 0)),
        ((0, 0, 0), (1, 1, 0)),
    ],
)
def test_just_outside_or_in_the_plane_is_a_miss(origin, direction):
    assert cross(origin, direction) is None


@pytest.mark.parametrize(
    "corners",
    [
        ((0, 0, 0),) * 3,
        ((0, 0, 0), (1, 0, 0), (1, 0, 0)),
        ((0, 0, 0), (1, 1, 0), (2, 2, 0)),
        ((1, 0, 0), (2, 0, 0), (0, 0, 0)),
    ],
)
def test_no_area_no_hit(corners):
    assert cross((0, 0, 1), (0, 0, -1), corners) is None
    assert cross((1, 0, 1), (0, 0, -1), corners) is None


def test_a_sliver_of_one_subnormal_is_still_a_triangle():
    corners = ((0, 0, 0), (1, 0, 0), (0, 5e-324, 0))
    assert cross((0.5, 0, 1), (0, 0, -1), corners) == (1, Fraction(1, 2), 0)
    assert cross((0.5, 5e-324, 1), (0, 0, -1), corners) is None


def test_closest_takes_the_lower_row_of_a_tie_and_respects_the_limits():
    mesh = meshes.joined(meshes.sheets(1), meshes.sheets(2), meshes.from_corners([[[0, 0, 2], [1, 0, 2], [0, 1, 2]]]))
    oracle = Oracle(*mesh)
    third = Fraction(1, 4)
    ray = ([0.25, 0.25, 3], [0, 0, -1])
    assert oracle.closest(*ray) == [Hit(Fraction(1), 3, third, third)]
    assert oracle.closest(*ray, t_min=1.5) == [Hit(Fraction(3), 0, third, third)]
    assert oracle.closest(*ray, t_min=1, t_max=1) == [Hit(Fraction(1), 3, third, third)]
    assert oracle.closest(*ray, t_min=1.5, t_max=2.5) == [None]
    assert oracle.closest(*ray, t_min=-INF, t_max=INF) == oracle.closest(*ray)
    assert [hit.triangle for hit in next(oracle.crossings(*ray))] == [3, 0, 1, 2]
    assert [hit.triangle for hit in next(oracle.crossings(*ray, t_max=1))] == [3]


def test_invalid():
    assert is_valid([0, 0, 0], [0, 0, 1], -INF, INF)
    assert is_valid([0, 0, 0], [0, -0.0, 5e-324], 3, 2)
    for origin, direction, t_min, t_max in [
        ([NAN, 0, 0], [0, 0, 1], 0, 1),
        ([0, INF, 0], [0, 0, 1], 0, 1),
        ([0, 0, 0], [0, 0, -INF], 0, 1),
        ([0, 0, 0], [0, -0.0, 0], 0, 1),
        ([0, 0, 0], [0, 0, 1], NAN, 1),
        ([0, 0, 0], [0, 0, 1], 0, NAN),
        ([0, 0, 0], [0, 0, 1], INF, INF),
        ([0, 0, 0], [0, 0, 1], -INF, -INF),
    ]:
        assert not is_valid(origin, direction, t_min, t_max)
        assert Oracle(*meshes.box((-1, -1, -1))).closest(origin, direction, t_min, t_max) == [None]


def test_a_triangle_with_a_vertex_at_infinity_is_left_out():
    mesh = meshes.from_corners([[[0, 0, 0], [INF, 0, 0], [0, 1, 0]], RIGHT, [[0, 0, NAN], [1, 0, 0], [0, 1, 0]]])
    assert [hit.triangle for hit in next(Oracle(*mesh).crossings([0.1, 0.1, 1], [0, 0, -1]))] == [1]


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("scale", [2.0**-300, 2.0**-100, 1.0, 2.0**100, 2.0**300])
def test_the_filter_drops_nothing_that_is_hit(scale, offset):
    rng = np.random.default_rng(5)
    corners = rng.integers(-2, 3, (40, 3, 3)) + offset
    origins = rng.integers(-3, 4, (20, 3)) + offset
    directions = rng.integers(-2, 3, (20, 3)) * 2.0 ** rng.integers(-30, 30, (20, 1))
    oracle = Oracle(*meshes.from_corners(corners * scale, np.float64))
    hit = 0
    for ray, hits in enumerate(oracle.crossings(origins * scale, directions, -INF)):
        if not directions[ray].any():
            continue
        o, d = exact(origins[ray] * scale), exact(directions[ray])
        all_rows = [row for row in range(40) if crossing(o, d, *(exact(corner) for corner in oracle.corners[row]))]
        assert sorted(found.triangle for found in hits) == all_rows
        hit += len(all_rows)
    assert hit > 50


def test_nearest_is_the_head_of_all_crossings():
    rng = np.random.default_rng(7)
    mesh = meshes.from_corners(rng.integers(-2, 3, (30, 3, 3)))
    origins, directions = rng.integers(-3, 4, (60, 3)), rng.integers(-2, 3, (60, 3))
    oracle, ties = Oracle(*mesh), 0
    for t_min in (-INF, 0.0, 1.0):
        every = list(oracle.crossings(origins, directions, t_min))
        nearest = list(oracle.nearest(origins, directions, t_min))
        assert nearest == [[hit for hit in hits if hit.t == hits[0].t] for hits in every]
        ties += sum(len(hits) > 1 for hits in nearest)
    assert ties >= 20


def test_the_filter_leaves_out_most():
    mesh = meshes.icosphere(3)
    origins = np.full((20, 3), [0.1, 0.2, 0.3])
    directions = np.random.default_rng(3).normal(size=(20, 3))
    kept = [len(rows) for rows in Oracle(*mesh)._filter.candidates(origins, directions)]
    assert max(kept) <= 12


@pytest.mark.parametrize(
    ("value", "step"),
    [
        (1, -23),
        (Fraction(3, 2), -23),
        (2, -22),
        (Fraction(2**24 - 1, 2**24), -24),
        (0, -149),
        (Fraction(1, 2**140), -149),
    ],
)
def test_ulp_of_float32(value, step):
    assert ulp(Fraction(value), np.float32) == Fraction(2) ** step == ulp(-Fraction(value), np.float32)


def test_ulp_matches_numpy_spacing():
    for value in np.random.default_rng(1).normal(size=50) * 10.0 ** np.arange(-25, 25):
        assert ulp(Fraction(float(value)), np.float64) == Fraction(float(np.spacing(abs(value))))
