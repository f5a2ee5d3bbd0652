"""Case 8: t exactly at a limit is a hit; of triangles at one t the lower row is, in whatever order they were built."""

import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_true
from tests.many_rays import RAYS, assert_many_true, on_a_lattice
from tests.rays import around
from tests.variants import every_tree, every_tree_of_many_rays

DOWN = [0, 0, -1.0]


@every_tree
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_limits_are_closed(variant, dtype):
    tree = variant.tree(*meshes.sheets(5, 0.25, dtype))  # crossed at t = 1, 1.25, 1.5, 1.75, 2
    origin, direction = [[0.25, 0.25, 2]], [DOWN]
    below, above = np.nextafter(1.5, 0), np.nextafter(1.5, 2)
    for t_min, t_max, triangle in [
        (1.5, 1.5, 2),
        (1.5, np.inf, 2),
        (above, np.inf, 1),
        (below, below, -1),
        (above, above, -1),
        (below, above, 2),
        (-np.inf, 1.0, 4),
        (-np.inf, np.nextafter(1.0, 0), -1),
        (2.0, np.inf, 0),
        (np.nextafter(2, 3), np.inf, -1),
        (-np.inf, np.inf, 4),
    ]:
        assert tree.intersect(origin, direction, t_min=t_min, t_max=t_max).triangle.tolist() == [triangle]
        assert tree.occluded(origin, direction, t_min=t_min, t_max=t_max).tolist() == [triangle >= 0]


@every_tree
def test_limits_that_no_float_can_equal(variant):
    """t is 1 / 3 in truth: the double next to it on either side decides, though both round to one float32."""
    tree = variant.tree(*meshes.sheets(1))
    third, origin, direction = 1 / 3, [[0.25, 0.25, 1.0]], [[0, 0, -3.0]]  # the double 1 / 3 is below the fraction
    above = np.nextafter(third, 1)
    for t_min, t_max, found in [
        (third, above, True),
        (above, 2, False),
        (0, third, False),
        (0, above, True),
        (third, third, False),
    ]:
        assert tree.intersect(origin, direction, t_min=t_min, t_max=t_max).hit.tolist() == [found]
        assert tree.occluded(origin, direction, t_min=t_min, t_max=t_max).tolist() == [found]


@every_tree
def test_negative_t(variant):
    tree = variant.tree(*meshes.sheets(3, 1.0))
    origin, direction = [[0.25, 0.25, 5.0]], [[0, 0, 1.0]]
    assert tree.intersect(origin, direction).triangle.tolist() == [-1]
    hits = tree.intersect(origin, direction, t_min=-np.inf)
    assert (hits.triangle[0], hits.t[0]) == (0, -5)
    hits = tree.intersect(origin, direction, t_min=-4.0, t_max=-3.0)
    assert (hits.triangle[0], hits.t[0]) == (1, -4)


@every_tree
def test_an_origin_on_the_triangle_is_at_zero(variant):
    """Also where rounded products would not be 0; both signs of the direction."""
    mesh = meshes.from_corners([[[0.1, 0.2, 0.3], [1.3, 0.1, 0.7], [0.2, 1.7, 0.9]]])
    tree = variant.tree(*mesh)
    a, b, _ = mesh.vertices.astype(np.float64)
    origins = np.array([a, b, a, b])
    directions = [[0.3, -0.2, 0.9], [0.1, 0.7, 0.3], [-0.3, 0.2, -0.9], [-0.1, -0.7, -0.3]]
    hits = assert_true(tree, mesh, origins, directions, 0.0, 0.0)
    assert hits.t.tolist() == [0, 0, 0, 0]


@every_tree
def test_duplicates_give_the_lower_row_in_any_order(variant):
    sphere = meshes.icosphere(2)
    twice = meshes.Triangles(sphere.vertices, np.vstack([sphere.triangles] * 3))
    rng = np.random.default_rng(1)
    rays = around(sphere, 500, rng)
    for order in (np.arange(len(twice.triangles)), rng.permutation(len(twice.triangles))):
        rows = twice.triangles[order]
        key = order % len(sphere.triangles)
        lowest = np.full(len(sphere.triangles), len(rows))
        np.minimum.at(lowest, key, np.arange(len(rows)))
        once = variant.tree(*sphere).intersect(*rays)
        hits = variant.tree(twice.vertices, rows).intersect(*rays)
        assert np.array_equal(hits.t, once.t)
        # A ray through an edge may find the neighbour's copy; away from edges it is a copy of the same triangle.
        inner = once.hit & (once.u > 1e-3) & (once.v > 1e-3) & (once.u + once.v < 1 - 1e-3)
        assert inner.sum() > 100
        assert np.array_equal(hits.triangle[inner], lowest[once.triangle[inner]])


@every_tree
def test_equal_t_of_unequal_triangles_on_the_integer_lattice(variant):
    """Fans about a common vertex that every ray goes through, so that all triangles tie; also with rows shuffled."""
    rng = np.random.default_rng(4)
    corners = rng.integers(-3, 4, (40, 3, 3)).astype(np.float64)
    corners[:, rng.integers(0, 3)] = [0, 0, 0]
    mesh = meshes.from_corners(corners)
    origins = rng.integers(-5, 6, (60, 3)).astype(np.float64)
    origins[~origins.any(axis=1)] = [1, 2, 3]
    hits = assert_true(variant.tree(*mesh), mesh, origins, -origins)
    assert (hits.hit & (hits.t == 1)).sum() > 20


@every_tree
def test_nearly_equal_t_is_no_tie(variant):
    """Two planes so close that t differs by far less than an ulp of float64: the nearer one wins, not the lower row."""
    tilt, step = 2.0**-60, 2.0**-52
    flat, tilted = [[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 0, 1], [1, 0, 1 - step], [0, 1, 1]]
    mesh = meshes.from_corners([flat, tilted], np.float64)
    hits = assert_true(variant.tree(*mesh), mesh, [[tilt / step, 0.25, 0], [0, 0.25, 0]], [[0, 0, 1.0]] * 2)
    assert hits.triangle.tolist() == [1, 0]


@every_tree_of_many_rays
def test_a_hundred_thousand_rays(variant):
    """Through the vertices and edges of lattice triangles, each of them twice, with limits at which many are met."""
    rng = np.random.default_rng(6)
    corners = rng.integers(-2, 3, (30, 3, 3))
    corners[::2, 0] = 0
    mesh = meshes.from_corners(np.concatenate([corners, corners[::-1]]))
    halves = rng.integers(-2, 9, (2, RAYS)) / 2
    limits = np.where(rng.random((2, RAYS)) < 0.5, [[0.0], [np.inf]], halves)
    assert_many_true(variant, mesh, on_a_lattice(-3, 3, 2, seed=6), *limits)
