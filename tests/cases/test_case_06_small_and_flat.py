"""Case 6: no triangle, one or two; flat meshes; rows sorted along a line, or reversed; all in one plane; a spiral."""

import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_true
from tests.many_rays import RAYS, assert_many_true, at_weak_places
from tests.rays import around, at_features, joined
from tests.variants import every_precision, every_tree, every_tree_of_many_rays


@every_precision
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("triangles", [None, np.empty((0, 3), np.int32)])
def test_no_triangle(variant, dtype, triangles):
    vertices = np.empty((0, 3), dtype) if triangles is None else np.ones((7, 3), dtype)
    tree = variant.tree(vertices, triangles)
    tree.validate()
    hits = tree.intersect([[0, 0, 0], [1, 1, 1]], [[0, 0, 1.0], [1, 0, 0]])
    assert hits.triangle.tolist() == [-1, -1]
    expected = np.float64 if variant.options.get("precision") == "exact" else dtype
    assert np.isinf(hits.t).all() and hits.t.dtype == expected
    assert tree.occluded([[0, 0, 0]], [[0, 0, 1.0]]).tolist() == [False]
    assert len(tree.order()) == 0
    assert tree.stats.triangles == tree.stats.rejected == 0
    assert tree.stats.tree_bytes <= tree.stats.bound_bytes


@every_tree
@pytest.mark.parametrize("count", [1, 2])
def test_one_and_two_triangles(variant, count):
    mesh = meshes.soup(count, 1.0, seed=3)
    tree = variant.tree(*mesh)
    tree.validate()
    rng = np.random.default_rng(1)
    hits = assert_true(tree, mesh, *joined(around(mesh, 60, rng), at_features(mesh, 60, rng)))
    assert set(hits.triangle) == set(range(-1, count))
    table = tree.nodes()
    leaves = table[table["kind"] == 1]
    assert leaves["count"].sum() == count


@every_tree
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("height", [0.0, 0.3])
def test_flat(variant, axis, height):
    flat = meshes.grid(6, 5)
    vertices = flat.vertices + np.float32([0, 0, height])
    mesh = meshes.Triangles(np.roll(vertices, axis + 1, axis=1), flat.triangles)
    tree = variant.tree(*mesh)
    tree.validate()
    box = tree.bounds
    assert box[0, axis] == box[1, axis] == np.float32(height)
    rng = np.random.default_rng(1)
    hits = assert_true(tree, mesh, *joined(around(mesh, 60, rng), at_features(mesh, 60, rng)))
    assert hits.hit.sum() > 60


@every_tree
@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("axis", range(3))
def test_a_line_of_triangles_sorted_or_reversed(variant, turn, axis):
    corners = np.array([[0, 0, 0], [0.5, 0, 0.25], [0, 0.5, 0]]) + np.arange(200)[:, None, None] * [1, 0, 0]
    mesh = meshes.from_corners(np.roll(corners, axis, axis=2)[::turn])
    tree = variant.tree(*mesh)
    tree.validate()
    assert tree.stats.depth <= 8 + 1
    rng = np.random.default_rng(1)
    rays = joined(around(mesh, 40, rng), at_features(mesh, 60, rng))
    assert assert_true(tree, mesh, *rays).hit.any()
    along = np.roll([[-1, 0.125, 0.0625]], axis, axis=1), np.roll([[1.0, 0, 0]], axis, axis=1)
    assert assert_true(tree, mesh, *along).triangle.tolist() == [0 if turn == 1 else 199]


@every_tree
def test_all_in_one_slanted_plane(variant):
    flat = meshes.grid(8, 8)
    mesh = meshes.Triangles(
        (flat.vertices @ np.array([[1, 0, 2], [0, 1, -1], [0, 0, 0]])).astype(np.float32), flat.triangles
    )
    rng = np.random.default_rng(1)
    rays = joined(around(mesh, 60, rng), at_features(mesh, 60, rng))
    assert assert_true(variant.tree(*mesh), mesh, *rays).hit.sum() > 60


@every_tree
def test_a_spiral(variant):
    mesh = meshes.spiral(1500)
    tree = variant.tree(*mesh)
    tree.validate()
    rng = np.random.default_rng(1)
    rays = joined(around(mesh, 60, rng), at_features(mesh, 60, rng))
    assert assert_true(tree, mesh, *rays).hit.any()


@every_tree_of_many_rays
def test_a_hundred_thousand_rays(variant):
    """At one triangle, two, a flat mesh, a line of triangles and a spiral: twenty thousand each."""
    line = np.array([[0, 0, 0], [0.5, 0, 0.25], [0, 0.5, 0]]) + np.arange(60)[:, None, None] * [1, 0, 0]
    some = [meshes.soup(1, 1.0, seed=3), meshes.soup(2, 1.0, seed=3), meshes.grid(4, 4), meshes.spiral(100)]
    for mesh in [*some, meshes.from_corners(line)]:
        assert_many_true(variant, mesh, at_weak_places(mesh, RAYS // 5))
