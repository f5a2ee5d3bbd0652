"""The truth of the report: by hand, beside the tests' own oracle, and where numbers leave the range."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from addon.report.error import culling, truth
from addon.report.error.exact import crossing
from addon.report.error.truth import Truth
from tests import meshes
from tests.oracle import Oracle
from tests.rays import around, at_features, joined, parallel

ONE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]


@pytest.mark.parametrize(
    ("origin", "direction", "t"),
    [
        ((0.25, 0.25, 1), (0, 0, -1), 1),
        ((0.25, 0.25, 1), (0, 0, -3), Fraction(1, 3)),
        ((0.5, 0.5, 1), (0, 0, -1), 1),
        ((0, 0, 1), (0, 0, -1), 1),
        ((1, 0, 2.0**-1074), (0, 0, -1), Fraction(2) ** -1074),
        ((0.25, 0.25, 1), (0, 0, 1), -1),
        ((0.5, np.nextafter(0.5, 1), 1), (0, 0, -1), None),
        ((-(2.0**-1074), 0.5, 1), (0, 0, -1), None),
        ((-1, 0.25, 0), (1, 0, 0), None),
        ((0.25, 0.25, 2.0**1000), (0, 0, -(2.0**-1000)), Fraction(2) ** 2000),
    ],
)
def test_a_triangle_made_by_hand(origin, direction, t):
    origin, direction = tuple(map(float, origin)), tuple(map(float, direction))
    found = crossing(origin, direction, *ONE)
    assert (found.t if found else None) == t
    nearest = Truth(np.array(ONE), np.array([[0, 1, 2]])).nearest(np.array([origin]), np.array([direction]))
    assert nearest.hit[0] == (t is not None and t >= 0)


def test_triangles_without_area_are_not_hit():
    for corners in ([ONE[0]] * 3, [[0, 0, 0], [1, 1, 0], [2, 2, 0]]):
        points = [[float(value) for value in point] for point in corners]
        assert crossing((1.0, 1.0, 1.0), (0.0, 0.0, -1.0), *points) is None


def test_distances_are_sums_of_two_floats():
    found = crossing((0.25, 0.25, 1.0), (0.0, 0.0, -3.0), *ONE)
    high, rest = found.as_two_floats()
    assert high == 1 / 3
    assert abs(Fraction(high) + Fraction(rest) - Fraction(1, 3)) < Fraction(2) ** -107


def assert_as_the_oracle(mesh, rays):
    """Every nearest triangle, every tie and every distance."""
    found = Truth(*mesh).nearest(*rays)
    for ray, hits in enumerate(Oracle(*mesh).nearest(*rays)):
        rows = tuple(hit.triangle for hit in hits)
        assert found.ties.get(ray, rows) == rows
        assert found.triangle[ray] == (rows[0] if rows else -1)
        assert (ray in found.ties) == (len(rows) > 1)
        if hits:
            t = Fraction(found.t[ray]) + Fraction(found.rest[ray])
            # The rest of a t as small as this is a subnormal number.
            assert abs(t - hits[0].t) < hits[0].t * Fraction(2) ** -100 + Fraction(2) ** -1074
    return found


@pytest.mark.parametrize("exponent", [0, -140, 100])
@pytest.mark.parametrize(
    "make", [lambda: meshes.icosphere(2), lambda: meshes.soup(200, 0.4), lambda: meshes.gears(3, 5)]
)
def test_every_ray_as_the_oracle_has_it(make, exponent):
    mesh = make()
    mesh = meshes.Triangles(np.ldexp(mesh.vertices, exponent), mesh.triangles)
    rng = np.random.default_rng(1)
    found = assert_as_the_oracle(mesh, joined(around(mesh, 80, rng), at_features(mesh, 120, rng)))
    assert 20 < found.hit.sum() < 200


@pytest.mark.parametrize("exponent", [0, 600, -700])
def test_double_precision_and_ties_on_a_grid(exponent):
    grid = meshes.grid(4, 4, np.float64)
    mesh = meshes.Triangles(np.ldexp(grid.vertices, exponent), grid.triangles)
    rays = parallel(grid, 9, 9, dtype=np.float64)
    scaled = type(rays)(np.ldexp(rays.origins, exponent), np.ldexp(rays.directions, exponent))
    found = assert_as_the_oracle(mesh, scaled)
    assert found.hit.all() and len(found.ties) > 40
    assert max(len(rows) for rows in found.ties.values()) == 6


@pytest.mark.parametrize("exponent", [0, 250, 600])
def test_a_direction_of_every_size_at_once(exponent):
    ball = meshes.icosphere(1, dtype=np.float64)
    mesh = meshes.Triangles(np.ldexp(ball.vertices, exponent), ball.triangles)
    rng = np.random.default_rng(1)
    origins = np.ldexp(np.c_[np.full(60, -4.0), rng.uniform(-1, 1, (60, 2))], exponent)
    origins[::4, 1:] = mesh.vertices[rng.integers(0, 42, 15), 1:]
    directions = np.ldexp(rng.uniform(-1, 1, (60, 3)), [1000, -100, -1060])
    directions[:, 0] = np.abs(directions[:, 0])
    assert_as_the_oracle(mesh, (origins, directions))


def test_what_is_not_finite_is_hit_by_nothing_and_hides_nothing():
    mesh = meshes.icosphere(1)
    vertices = np.vstack([mesh.vertices, [[np.nan, 0, 0]]])
    triangles = np.vstack([[[42, 0, 1]], mesh.triangles])
    rays = at_features(mesh, 90, np.random.default_rng(1))
    assert np.array_equal(
        np.where(Truth(*mesh).nearest(*rays).hit, Truth(*mesh).nearest(*rays).triangle + 1, -1),
        Truth(vertices, triangles).nearest(*rays).triangle,
    )


def test_crossings_are_counted():
    mesh = meshes.icosphere(2)
    rng = np.random.default_rng(1)
    points, directions = rng.uniform(-1, 1, (60, 3)), rng.normal(size=(60, 3))
    expected = [len(hits) for hits in Oracle(*mesh).crossings(points, directions)]
    assert Truth(*mesh).count(points, directions).tolist() == expected
    is_inside = np.linalg.norm(points, axis=1) < 0.95
    assert (np.array(expected)[is_inside] % 2 == 1).all()


def test_no_triangle_and_no_ray():
    empty = Truth(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    assert empty.nearest(np.zeros((3, 3)), np.ones((3, 3))).triangle.tolist() == [-1, -1, -1]
    assert len(Truth(*meshes.icosphere(0)).nearest(np.zeros((0, 3)), np.zeros((0, 3)))) == 0


def test_pieces_and_chunks_change_nothing(monkeypatch):
    mesh = meshes.icosphere(2)
    rays = at_features(mesh, 200, np.random.default_rng(1))
    whole = Truth(*mesh).nearest(*rays)
    monkeypatch.setattr(truth, "CHUNK", 7)
    monkeypatch.setattr(culling, "PAIRS", 50)
    parts = Truth(*mesh).nearest(*rays)
    assert np.array_equal(whole.triangle, parts.triangle) and np.array_equal(whole.t, parts.t)
    assert whole.ties == parts.ties
