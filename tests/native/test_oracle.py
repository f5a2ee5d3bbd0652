"""The oracle itself, on triangles made by hand and against itself without its filter."""

from fractions import Fraction

import numpy as np
import pytest

from tests import meshes
from tests.oracle import Hit, Oracle, are_valid, crossing, exact, ulp
from tests.oracle_filter import SideFilter, distances, meetings

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
    truth = Oracle(*meshes.from_corners([RIGHT])).decide(origin, direction, -INF)
    assert truth.hit(0) == Hit(t, 0, u, v) and truth.triangle.tolist() == [0] and truth.ties.tolist() == [1]


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
    truth = Oracle(*meshes.from_corners([RIGHT])).decide(origin, direction, -INF)
    assert truth.hit(0) is None and truth.triangle.tolist() == [-1] and truth.ties.tolist() == [0]


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


def is_valid(origin, direction, t_min, t_max):
    return are_valid(*(np.array([part], np.float64) for part in (origin, direction, t_min, t_max))).tolist() == [True]


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


def lattice_case(scale, offset, seed=5):
    rng = np.random.default_rng(seed)
    corners = (rng.integers(-2, 3, (40, 3, 3)) + offset) * scale
    origins = (rng.integers(-3, 4, (20, 3)) + offset) * scale
    directions = rng.integers(-2, 3, (20, 3)) * 2.0 ** rng.integers(-30, 30, (20, 1))
    return corners, origins, directions


def random_case(scale, offset, seed=6):
    """No numbers with few bits: aimed at corners, at points of edges and at points beside them."""
    rng = np.random.default_rng(seed)
    corners = (rng.normal(size=(40, 3, 3)) + offset) * scale
    origins = (3 * rng.normal(size=(20, 3)) + offset) * scale
    weight = rng.choice([0, 0.3, 0.5], (20, 1))
    target = corners[:20, 0] * (1 - weight) + corners[:20, 1] * weight
    target[::3] = corners[:20:3].mean(axis=1)
    return corners, origins, target - origins


@pytest.mark.parametrize("case", [lattice_case, random_case])
@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("scale", [2.0**-1060, 2.0**-150, 1.0, 2.0**300, 2.0**1000])
def test_filter_and_whole_numbers_against_the_definition(case, scale, offset):
    """Every pair of a ray and a triangle: who is hit, what the filter says beyond doubt, and every bound on t, u, v."""
    corners, origins, directions = case(scale, offset)
    directions[~directions.any(axis=1)] = [0, 0, 1]
    mesh = meshes.from_corners(corners, np.float64)
    oracle = Oracle(*mesh)
    truth = oracle.decide(origins, directions, -INF)
    inside = {}
    for block in SideFilter(oracle.corners).blocks(origins, directions):
        rays = (block.pairs.ray + block.first).tolist()
        inside.update(zip(zip(rays, block.pairs.triangle.tolist(), strict=True), block.pairs.is_inside, strict=True))
    hit = proved = 0
    closest = iter(zip(*truth.approximate, strict=True))
    for ray, hits in enumerate(oracle.crossings(origins, directions, -INF)):
        o, d = exact(origins[ray]), exact(directions[ray])
        found = {row: crossing(o, d, *(exact(corner) for corner in oracle.corners[row])) for row in range(len(corners))}
        expected = [Hit(met[0], row, *met[1:]) for row, met in found.items() if met]
        assert hits == sorted(expected, key=lambda hit: (hit.t, hit.triangle))
        assert all(found[row] for row in found if inside.get((ray, row), False))
        assert all((ray, row) in inside for row in found if found[row])
        assert truth.hit(ray) == (hits[0] if hits else None)
        assert truth.ties[ray] == sum(hit.t == hits[0].t for hit in hits)
        hit += len(hits)
        if expected:
            t, t_error, u, u_error, v, v_error = next(closest)
            for value, error, true in ((t, t_error, hits[0].t), (u, u_error, hits[0].u), (v, v_error, hits[0].v)):
                assert not np.isfinite(error) or abs(fraction(value) - true) <= fraction(error)
                assert true or value == error == 0 or hits[0].u > 0 < hits[0].v
            rows = [row for _, row, *_ in expected]
            many = np.repeat(origins[ray : ray + 1], len(rows), 0), np.repeat(directions[ray : ray + 1], len(rows), 0)
            sound = np.full(len(rows), abs(np.log2(scale)) <= 300)
            low, high = distances(*many, oracle.corners[rows], sound)
            near = meetings(*many, oracle.corners[rows], sound)
            for i, (t, _, u, v) in enumerate(expected):
                assert low[i] <= t <= high[i]
                for value, error, true in (near[:2] + (t,), near[2:4] + (u,), near[4:] + (v,)):
                    if np.isfinite(error[i]):
                        assert abs(fraction(value[i]) - true) <= fraction(error[i])
                        proved += 1
    assert hit > 50 and (proved > 100 or offset or abs(np.log2(scale)) > 300)


def fraction(value):
    """A longdouble as the fraction it is: float(value) would round it."""
    high = float(value)
    return Fraction(high) + Fraction(float(value - np.longdouble(high)))


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
    [block] = SideFilter(mesh.corners().astype(np.float64)).blocks(origins, directions)
    assert np.bincount(block.pairs.ray).max() <= 12
    assert block.pairs.is_inside.sum() >= 30


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
