"""precision="exact": distances and weights within one unit in the last place, the same bits in every tree."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_same, assert_true
from tests.meshes import Triangles
from tests.rays import around, at_features, joined, parallel
from tests.variants import EXACT, every_exact_tree

DTYPES = (np.float32, np.float64)


def moved(mesh: Triangles, scale: float, offset: float, dtype: type) -> Triangles:
    return Triangles((mesh.vertices.astype(np.float64) * scale + offset).astype(dtype), mesh.triangles)


def stadium(dtype: type) -> Triangles:
    """A small mesh in a scene 10^9 times as large: the bounds of the scene say nothing about it."""
    return meshes.joined(moved(meshes.icosphere(2), 1e-9, 0.0, dtype), moved(meshes.box(), 2.0, -1.0, dtype))


def slivers(dtype: type) -> Triangles:
    rng = np.random.default_rng(7)
    corners = rng.normal(size=(60, 3, 3))
    corners[:, 2] = (corners[:, 0] + corners[:, 1]) / 2 + 1e-6 * rng.normal(size=(60, 3))
    return meshes.from_corners(corners, dtype)


MESHES = {
    "terrain": lambda dtype: meshes.terrain(12).astype(dtype),
    "gears": lambda dtype: meshes.gears(3, 9).astype(dtype),
    "sheets": lambda dtype: meshes.sheets(12).astype(dtype),
    "offset": lambda dtype: moved(meshes.icosphere(2), 1e3 if dtype == np.float64 else 1e5, 1e9, dtype),
    "stadium": stadium,
    "slivers": slivers,
    "subnormal": lambda dtype: moved(meshes.icosphere(1), 1e-42 if dtype == np.float32 else 1e-318, 0.0, dtype),
    "huge": lambda dtype: moved(meshes.icosphere(1), 1e36 if dtype == np.float32 else 1e290, 0.0, dtype),
}


def rays_at(mesh: Triangles, dtype: type) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    return joined(around(mesh, 60, rng, dtype), at_features(mesh, 60, rng, dtype), parallel(mesh, 6, 6, dtype=dtype))


@every_exact_tree
@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("dtype", DTYPES)
def test_within_a_unit_in_the_last_place(variant, name, dtype):
    mesh = MESHES[name](dtype)
    for ray_dtype in {np.float64, dtype}:
        hits = assert_true(variant.tree(*mesh), mesh, *rays_at(mesh, ray_dtype))
        assert hits.t.dtype == hits.u.dtype == hits.v.dtype == np.float64
        for weight in (hits.u, hits.v):
            assert ((weight >= 0) & (weight <= 1)).all()


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("dtype", DTYPES)
def test_the_same_bits_in_every_tree(name, dtype):
    mesh = MESHES[name](dtype)
    rays = rays_at(mesh, np.float64)
    expected = bihtree.Tree(*mesh, precision="exact").intersect(*rays)
    for variant in EXACT:
        assert_same(variant.tree(*mesh).intersect(*rays), expected)
    watertight = bihtree.Tree(*mesh).intersect(*rays)
    assert np.array_equal(watertight.triangle, expected.triangle)


@every_exact_tree
def test_origins_in_the_surface_are_at_zero(variant):
    mesh = meshes.terrain(10)
    corners = mesh.vertices[mesh.triangles].astype(np.float64)
    rng = np.random.default_rng(5)
    at_vertices = corners[:, 0]
    hits = assert_true(variant.tree(*mesh), mesh, at_vertices, rng.normal(size=at_vertices.shape))
    assert (hits.t == 0).mean() > 0.9
    # Beside a surface by a few units in the last place.
    beside = corners.mean(axis=1)
    assert_true(variant.tree(*mesh), mesh, beside, rng.normal(size=beside.shape), t_min=-np.inf)


@every_exact_tree
@pytest.mark.parametrize("distance", [1e6, 1e12, 1e30])
def test_origins_far_away(variant, distance):
    mesh = meshes.icosphere(2)
    rng = np.random.default_rng(11)
    away = rng.normal(size=(80, 3))
    targets = mesh.vertices[rng.integers(len(mesh.vertices), size=80)].astype(np.float64)
    hits = assert_true(variant.tree(*mesh), mesh, distance * away, targets - distance * away)
    assert hits.hit.any() or distance > 1e20


@every_exact_tree
def test_t_at_the_limits_is_not_beyond_them(variant):
    mesh = meshes.box()
    tree = variant.tree(*mesh)
    origins, directions = np.full((3, 3), 0.5), np.eye(3) * [[3.0], [0.7], [1e-5]]
    t = tree.intersect(origins, directions).t
    at = assert_true(tree, mesh, origins, directions, t_min=t, t_max=t)
    assert np.array_equal(at.t[at.hit], t[at.hit])
    assert_true(tree, mesh, origins, directions, t_min=np.nextafter(t, np.inf))
    assert_true(tree, mesh, origins, directions, t_max=np.nextafter(t, -np.inf))


def test_a_third_is_the_nearest_double():
    hits = bihtree.Tree(*meshes.box(), precision="exact").intersect([[0.25, 0.75, -1.0]], [[0.0, 0.0, 3.0]])
    assert hits.t.tolist() == [1 / 3]
