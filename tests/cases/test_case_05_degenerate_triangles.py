"""Case 5: triangles without area, duplicates, and very many with one centre: bounded depth, each still found."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_true
from tests.many_rays import assert_many_true, on_a_lattice
from tests.rays import around
from tests.variants import every_precision, every_tree, every_tree_of_many_rays

DEEPEST = 125  # 96 halvings of cells, then at most 29 of a range of 2^29


@every_tree
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_triangles_without_area_are_rejected_and_counted(variant, dtype):
    good = [[0, 0, 1], [4, 0, 1], [0, 4, 1]]
    corners = [
        [[1, 1, 1]] * 3,
        [[0, 0, 0], [3, 1, 0], [3, 1, 0]],
        good,
        [[0, 0, 0], [0.1, 0.2, 0.3], [0.2, 0.4, 0.6]],
        [[5, 5, 0], [6, 6, 0], [8, 8, 0]],
        [[0, 0, 2], [4, 0, 2], [4, 2.0**-20, 2]],
    ]
    mesh = meshes.from_corners(corners, dtype)
    tree = variant.tree(*mesh)
    tree.validate()
    assert tree.stats.rejected == 4
    assert sorted(tree.order()[-4:].tolist()) == [0, 1, 3, 4]
    origins = [[1, 1, 3], [3, 1, 3], [1, 1, -1], [0.1, 0.2, -1], [6, 6, 3], [2, 2.0**-22, 3]]
    hits = assert_true(tree, mesh, origins, [[0, 0, -1.0]] * 2 + [[0, 0, 1.0]] * 2 + [[0, 0, -1.0]] * 2)
    assert hits.triangle.tolist() == [2, 2, 2, 2, -1, 5]


@every_tree
@pytest.mark.parametrize("name", ["box-repeated", "spider-degenerate", "capsule-degenerate", "testplate"])
def test_models_with_degenerate_triangles(variant, name):
    mesh = meshes.shared_mesh(name)
    corners = mesh.corners()
    repeated = [(corners[:, i] == corners[:, j]).all(axis=1) for i, j in ((0, 1), (1, 2), (2, 0))]
    tree = variant.tree(*mesh)
    tree.validate()
    assert tree.stats.rejected >= np.any(repeated, axis=0).sum()
    rays = around(mesh, 60, np.random.default_rng(1))
    assert assert_true(tree, mesh, *rays).hit.any()


def fans(count):
    """`count` triangles with one centre, of bounds and of corners; row i crosses x = 0.5 at z = (i + 1) / 2^21."""
    height = np.arange(1, count + 1)[:, None] / 2.0**20
    corners = np.tile(np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float64), (count, 1, 1))
    corners[:, :, 2] = height * [-1, 1, 0]
    return meshes.from_corners(corners)


def probes(rows):
    """A ray each, down x = 0.5, y = -0.5, and the t at which it crosses the triangle of that row."""
    origins = np.tile(np.float32([0.5, -0.5, 2]), (len(rows), 1))
    return origins, np.tile(np.float32([0, 0, -1]), (len(rows), 1)), 2 - (rows + 1) / 2.0**21


@every_precision
def test_each_of_two_thousand_with_one_centre_is_found(variant):
    mesh = fans(2000)
    tree = variant.tree(*mesh)
    tree.validate()
    assert tree.stats.depth <= DEEPEST
    origins, directions, t = probes(np.arange(2000))
    assert np.array_equal(tree.intersect(origins, directions, t_min=t, t_max=t).triangle, np.arange(2000))
    assert tree.intersect(origins[:1], directions[:1]).triangle.tolist() == [1999]


def test_a_million_with_one_centre():
    mesh = fans(1_000_000)
    tree = bihtree.Tree(*mesh)
    assert tree.stats.depth <= DEEPEST
    assert tree.stats.tree_bytes <= tree.stats.bound_bytes
    tree.validate()
    rows = np.array([0, 1, 499_999, 777_777, 999_999])
    origins, directions, t = probes(rows)
    assert np.array_equal(tree.intersect(origins, directions, t_min=t, t_max=t).triangle, rows)


def test_a_million_times_the_same_triangle():
    mesh = meshes.sheets(1)
    tree = bihtree.Tree(mesh.vertices, np.repeat(mesh.triangles, 1_000_000, axis=0))
    assert tree.stats.depth <= DEEPEST
    assert np.array_equal(np.sort(tree.order()), np.arange(1_000_000))
    assert tree.intersect([[0.25, 0.25, 1]], [[0, 0, -1.0]]).triangle.tolist() == [0]
    assert tree.occluded([[0.25, 0.25, 1], [0.75, 0.75, 1]], [[0, 0, -1.0]] * 2).tolist() == [True, False]


@every_tree_of_many_rays
def test_a_hundred_thousand_rays(variant):
    """Triangles on a lattice, a quarter of them points or lines, each of them three times."""
    rng = np.random.default_rng(3)
    corners = rng.integers(-2, 3, (40, 3, 3))
    corners[::8, 1] = corners[::8, 0]
    corners[1::8] = corners[1::8, :1]
    mesh = meshes.from_corners(np.concatenate([corners] * 3))
    assert assert_many_true(variant, mesh, on_a_lattice(-3, 3, 2)).stats.rejected >= 30
