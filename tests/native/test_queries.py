"""intersect and occluded: the arrays in and out, and that one answer does not depend on the others."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_same, assert_true
from tests.rays import around, at_features, joined, parallel, pinhole
from tests.variants import every_tree

MESHES = {
    "terrain": meshes.terrain(12),
    "sphere": meshes.icosphere(3),
    "soup": meshes.soup(300, 0.3),
    "gears": meshes.gears(4, 8),
    "spiral": meshes.spiral(300),
    "grid": meshes.grid(12, 9),
    "box": meshes.box((-1, -2, -3), (3, 2, 1)),
}


@every_tree
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", MESHES)
def test_closest_and_any_hit_are_the_oracles(variant, name, dtype):
    mesh = MESHES[name].astype(dtype)
    rng = np.random.default_rng(1)
    rays = joined(
        around(mesh, 30, rng, dtype),
        at_features(mesh, 30, rng, dtype),
        pinhole(mesh, 7, 5, dtype=dtype),
        parallel(mesh, 7, 5),
    )
    t_min = rng.choice([0.0, -np.inf, 0.5], len(rays.origins))
    t_max = rng.choice([np.inf, 1.0, 2.0], len(rays.origins))
    assert assert_true(variant.tree(*mesh), mesh, *rays, t_min, t_max).hit.any()


@every_tree
@pytest.mark.parametrize("mesh_dtype", [np.float32, np.float64])
@pytest.mark.parametrize("ray_dtype", [np.float32, np.float64])
def test_dtypes_of_the_answers(variant, mesh_dtype, ray_dtype):
    mesh = meshes.icosphere(2, dtype=mesh_dtype)
    tree = variant.tree(*mesh)
    rays = around(mesh, 50, np.random.default_rng(1), ray_dtype)
    hits = tree.intersect(*rays)
    result = np.float64 if variant.precision == "exact" else mesh_dtype
    assert (hits.t.dtype, hits.u.dtype, hits.v.dtype) == (result,) * 3
    assert (hits.triangle.dtype, hits.instance.dtype) == (np.int32, np.int32)
    assert hits.hit.dtype == np.bool_ == tree.occluded(*rays).dtype
    assert len(hits) == 50
    for name in ("t", "triangle", "u", "v", "instance", "hit"):
        array = getattr(hits, name)
        assert array.shape == (50,) and array.flags.c_contiguous
    assert type(hits.invalid) is int
    assert np.array_equal(hits.hit, hits.triangle >= 0)


@every_tree
def test_a_miss_is_minus_one_infinity_and_zeros(variant):
    hits = variant.tree(*meshes.box()).intersect([[5, 5, 5]], [[1.0, 0, 0]])
    assert (hits.triangle[0], hits.t[0], hits.instance[0]) == (-1, np.inf, -1)
    assert (hits.u[0], hits.v[0], hits.invalid) == (0, 0, 0)
    assert not hits.hit[0]


@every_tree
def test_no_rays(variant):
    tree = variant.tree(*meshes.box())
    for dtype in (np.float32, np.float64):
        empty = np.empty((0, 3), dtype)
        hits = tree.intersect(empty, empty)
        assert len(hits) == 0 and hits.t.shape == hits.triangle.shape == hits.hit.shape == (0,)
        assert tree.occluded(empty, empty).shape == (0,)
        assert [cost.shape for cost in tree.traversal_cost(empty, empty)] == [(0,), (0,)]


@every_tree
def test_t_is_in_units_of_the_directions_length(variant):
    tree = variant.tree(*meshes.box((-1, -1, -1)))
    lengths = np.array([0.125, 0.3, 1.0, 7.0, 1e10])
    hits = tree.intersect(np.zeros((5, 3)), lengths[:, None] * [0, 0, -1.0])
    assert np.array_equal(hits.t.astype(np.float32), (1 / lengths).astype(np.float32))


@every_tree
def test_float32_rays_mean_the_numbers_they_hold(variant):
    mesh = MESHES["soup"]
    tree = variant.tree(*mesh)
    rays = around(mesh, 300, np.random.default_rng(5))
    wide = tree.intersect(rays.origins.astype(np.float64), rays.directions.astype(np.float64))
    assert_same(tree.intersect(*rays), wide)


@every_tree
def test_limits_are_numbers_or_one_a_ray(variant):
    mesh = MESHES["sphere"]
    tree = variant.tree(*mesh)
    rays = around(mesh, 200, np.random.default_rng(5))
    expected = tree.intersect(*rays, t_min=np.full(200, 0.75), t_max=np.full(200, 1.25))
    assert 0 < expected.hit.sum() < tree.intersect(*rays).hit.sum()
    for t_min, t_max in [
        (0.75, 1.25),
        (np.float32(0.75), np.array(1.25)),
        (np.full(200, 0.75, np.float32), [1.25] * 200),
        (np.full(400, 0.75)[::2], np.full(200, np.float64(1.25))),
    ]:
        assert_same(tree.intersect(*rays, t_min=t_min, t_max=t_max), expected)
        assert np.array_equal(tree.occluded(*rays, t_min=t_min, t_max=t_max), expected.hit)


@every_tree
def test_each_ray_is_answered_for_itself(variant):
    mesh = MESHES["gears"]
    tree = variant.tree(*mesh)
    rays = around(mesh, 3000, np.random.default_rng(5))
    t_max = np.random.default_rng(6).uniform(0.5, 1.5, 3000)
    whole = tree.intersect(*rays, t_max=t_max)
    shuffle = np.random.default_rng(7).permutation(3000)
    shuffled = tree.intersect(rays.origins[shuffle], rays.directions[shuffle], t_max=t_max[shuffle])
    for name in ("t", "triangle", "u", "v", "instance"):
        assert getattr(whole, name)[shuffle].tobytes() == getattr(shuffled, name).tobytes()
    for ray in range(0, 3000, 100):
        alone = tree.intersect(rays.origins[ray : ray + 1], rays.directions[ray : ray + 1], t_max=t_max[ray])
        assert (alone.t[0], alone.triangle[0]) == (whole.t[ray], whole.triangle[ray])


@every_tree
def test_answers_outlive_the_tree_and_the_hits(variant):
    tree = variant.tree(*meshes.box())
    hits = tree.intersect([[0.5, 0.25, 0.5]], [[1.0, 0, 0]])
    t, triangle, table, order, box = hits.t, hits.triangle, tree.nodes(), tree.order(), tree.bounds
    del tree, hits
    bihtree.Tree(*meshes.soup(2000))
    assert (t.tolist(), triangle.tolist()) == ([0.5], [3])
    assert table["count"][0] == 12 and sorted(order) == list(range(12)) and box.tolist() == [[0, 0, 0], [1, 1, 1]]


@every_tree
def test_a_soup_equals_the_indexed_mesh(variant):
    mesh = MESHES["sphere"]
    rays = around(mesh, 300, np.random.default_rng(5))
    soup, indexed = variant.tree(mesh.corners().reshape(-1, 3)), variant.tree(*mesh)
    assert_same(soup.intersect(*rays), indexed.intersect(*rays))
    for tree in (soup, indexed):
        tree.build_all()
    assert soup.nodes().tobytes() == indexed.nodes().tobytes()


def test_float64_vertices_are_not_rounded():
    """Two sheets closer than float32 can tell apart, far from the origin."""
    height = 1e6 + np.array([0.0, 1e-9])
    mesh = meshes.from_corners([[[0, 0, z], [1, 0, z], [0, 1, z]] for z in height], np.float64)
    hits = assert_true(bihtree.Tree(*mesh), mesh, [[0.25, 0.25, 0], [0.25, 0.25, 2e6]], [[0, 0, 1.0], [0, 0, -1.0]])
    assert hits.triangle.tolist() == [0, 1]
