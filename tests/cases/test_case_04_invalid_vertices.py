"""Case 4: a triangle with a vertex that is not finite is rejected and counted, the rest works."""

import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_true
from tests.many_rays import assert_many_true, at_weak_places
from tests.rays import around
from tests.variants import every_precision, every_tree, every_tree_of_many_rays


def with_bad_vertices(dtype):
    """A sphere of 320 triangles in which three vertices are spoilt, and the rows that use them."""
    mesh = meshes.icosphere(2, dtype=dtype)
    vertices = mesh.vertices.copy()
    vertices[5], vertices[60, 1], vertices[100, 2] = np.nan, np.inf, -np.inf
    return meshes.Triangles(vertices, mesh.triangles), np.flatnonzero(np.isin(mesh.triangles, [5, 60, 100]).any(axis=1))


@every_tree
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_rest_is_traced(variant, dtype):
    mesh, bad = with_bad_vertices(dtype)
    tree = variant.tree(*mesh)
    tree.validate()
    assert tree.stats.rejected == len(bad)
    assert tree.stats.triangles == len(mesh.triangles)
    assert sorted(tree.order()[-len(bad) :]) == bad.tolist()
    good = np.delete(mesh.triangles, bad, axis=0)
    used = mesh.vertices[np.unique(good)]
    box = np.array([used.min(axis=0), used.max(axis=0)])
    assert (tree.bounds[0] <= box[0]).all() and (tree.bounds[1] >= box[1]).all()
    outward = 0 if dtype == np.float32 else np.spacing(np.float32(1))
    assert np.abs(tree.bounds - box).max() <= outward
    rays = around(mesh, 150, np.random.default_rng(1), dtype)
    hits = assert_true(tree, mesh, *rays)
    assert hits.hit.sum() > 50
    assert not np.isin(hits.triangle, bad).any()


@every_precision
def test_all_triangles_bad_is_an_empty_tree(variant):
    tree = variant.tree(np.full((9, 3), np.nan, np.float32))
    tree.validate()
    assert tree.stats.rejected == 3
    assert sorted(tree.order().tolist()) == [0, 1, 2]
    assert tree.intersect([[0, 0, 0]], [[0, 0, 1.0]]).triangle.tolist() == [-1]


@every_precision
def test_a_bad_vertex_that_no_triangle_uses_does_no_harm(variant):
    mesh = meshes.box((-1, -1, -1))
    vertices = np.vstack([mesh.vertices, [[np.nan, np.inf, 0]]]).astype(np.float32)
    tree = variant.tree(vertices, mesh.triangles)
    assert tree.stats.rejected == 0
    assert np.array_equal(tree.bounds, [[-1, -1, -1], [1, 1, 1]])
    assert tree.intersect([[0.3, 0.2, 0]], [[0, 0, 1.0]]).t.tolist() == [1]


@every_tree
@pytest.mark.parametrize(
    ("dtype", "size"),
    [(np.float32, 3.4e38), (np.float32, 1e20), (np.float64, 1e30), (np.float64, 1e39), (np.float64, 1e300)],
)
def test_the_largest_finite_vertices_are_traced(variant, dtype, size):
    """Sums of such coordinates overflow float32, and for the last one float64."""
    sphere = meshes.icosphere(1, dtype=np.float64)
    limit = float(np.finfo(dtype).max)
    vertices = np.clip(sphere.vertices * size, -limit, limit).astype(dtype)
    mesh = meshes.joined(meshes.Triangles(vertices, sphere.triangles), meshes.box((-1, -1, -1), dtype=dtype))
    tree = variant.tree(*mesh)
    tree.validate()
    rng = np.random.default_rng(1)
    directions = np.vstack([rng.normal(size=(25, 3)), np.eye(3), -np.eye(3)]).astype(dtype)
    origins = np.zeros_like(directions)
    inner = assert_true(tree, mesh, origins, directions)
    assert (inner.triangle >= len(sphere.triangles)).all()
    outer = assert_true(tree, mesh, origins, directions, 10.0)
    assert (0 <= outer.triangle).all() and (outer.triangle < len(sphere.triangles)).all()


@every_tree_of_many_rays
def test_a_hundred_thousand_rays(variant):
    mesh, bad = with_bad_vertices(np.float32)
    good = meshes.Triangles(mesh.vertices, np.delete(mesh.triangles, bad, axis=0))
    assert_many_true(variant, mesh, at_weak_places(good))
