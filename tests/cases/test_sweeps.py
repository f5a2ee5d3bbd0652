"""Short sweeps over stiffness: one number grows by orders of magnitude, and every answer is decided exactly."""

import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_true
from tests.rays import around, at_features, bounds, joined
from tests.variants import every_tree

both_dtypes = pytest.mark.parametrize("dtype", [np.float32, np.float64])


def rays_at(mesh, dtype, seed=1):
    rng = np.random.default_rng(seed)
    return joined(around(mesh, 20, rng, dtype), at_features(mesh, 30, rng, dtype))


@every_tree
@both_dtypes
@pytest.mark.parametrize("k", [0, 2, 4, 6, 9])
def test_offset(variant, dtype, k):
    """The mesh moved by 10^k of its size; as float32 it is soon no more than a few distinct points."""
    sphere = meshes.icosphere(2, dtype=np.float64)
    mesh = meshes.Triangles((sphere.vertices + [10.0**k, -(10.0**k), 0.3 * 10**k]).astype(dtype), sphere.triangles)
    assert_true(variant.tree(*mesh), mesh, *rays_at(mesh, dtype))


@every_tree
@both_dtypes
@pytest.mark.parametrize("k", [0, 2, 4, 6, 9])
def test_origin_distance(variant, dtype, k):
    mesh = meshes.icosphere(2, dtype=dtype)
    rng = np.random.default_rng(1)
    away = rng.normal(size=(50, 3))
    origins = (away / np.linalg.norm(away, axis=1, keepdims=True) * 10.0**k).astype(dtype)
    targets = mesh.vertices[rng.integers(0, len(mesh.vertices), 50)] * np.where(rng.random((50, 1)) < 0.5, 1, 0.9)
    assert_true(variant.tree(*mesh), mesh, origins, targets.astype(dtype) - origins)


@every_tree
@both_dtypes
@pytest.mark.parametrize("k", [0, 3, 6, 9, 12])
def test_sliver(variant, dtype, k):
    """Triangles whose height is 10^-k of their length, edge to edge, so that the rays through them hit one or two."""
    step = np.arange(40)
    points = np.stack([step % 2 + 0.01 * step, step * 10.0**-k, 0.1 * (step % 3)], axis=1)
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    mesh = meshes.Triangles((points @ turn).astype(dtype), (step[:-2, None] + [0, 1, 2]).astype(np.int32))
    assert_true(variant.tree(*mesh), mesh, *rays_at(mesh, dtype))


@every_tree
@both_dtypes
@pytest.mark.parametrize("k", [0, 3, 6, 9, 12])
def test_grazing(variant, dtype, k):
    """Rays at an angle of 10^-k to the sides of a box that is turned, aimed at vertices and at the sides themselves."""
    box = meshes.box((-1, -1, -1), dtype=np.float64)
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    mesh = meshes.Triangles((box.vertices @ turn).astype(dtype), box.triangles)
    rng = np.random.default_rng(1)
    corners = mesh.corners().astype(np.float64)[rng.integers(0, 12, 60)]
    weights = rng.dirichlet([1, 1, 1], 60)
    weights[::3] = [1, 0, 0]
    targets = (weights[:, :, None] * corners).sum(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 4
    along = corners[:, 1] - corners[:, 0] + rng.normal(size=(60, 1)) * (corners[:, 2] - corners[:, 0])
    origins = (targets - 3 * along + 10.0**-k * normal).astype(dtype)
    assert_true(variant.tree(*mesh), mesh, origins, (targets - origins).astype(dtype))


@every_tree
@pytest.mark.parametrize("k", [0, 3, 6, 9])
def test_scale_ratio(variant, k):
    """A sphere of size 10^-k in a corner of a room of size 1: the teapot in the stadium."""
    small = meshes.icosphere(2, 10.0**-k, np.float64)
    small = meshes.Triangles((small.vertices + 10.0**-k).astype(np.float32), small.triangles)
    mesh = meshes.joined(meshes.box(), small)
    tree = variant.tree(*mesh)
    rays = joined(rays_at(small, np.float32), rays_at(mesh, np.float32))
    hits = assert_true(tree, mesh, *rays)
    assert (hits.triangle >= 12).any()


@every_tree
@pytest.mark.parametrize("spacing", [0.0, 2.0**-40])
@pytest.mark.parametrize("k", [0, 4, 8, 12])
def test_depth_complexity(variant, k, spacing):
    """2^k sheets at one place or a hair apart; a ray from above meets the last one first."""
    count = 2**k
    mesh = meshes.sheets(count, spacing, np.float64)
    tree = variant.tree(*mesh)
    origins = np.array([[0.25, 0.25, 1], [0.5, 0.5, 1], [0, 0, 1], [1, 0, 1], [0.75, 0.75, 1]])
    hits = tree.intersect(origins, np.tile([0, 0, -1.0], (5, 1)))
    first = 0 if spacing == 0 else count - 1
    assert hits.triangle.tolist() == [first] * 4 + [-1]
    assert np.allclose(hits.t[:4], 1 - (count - 1) * spacing, rtol=2.0**-40, atol=0)
    from_below = tree.intersect(origins * [1, 1, -1], np.tile([0, 0, 1.0], (5, 1)))
    assert from_below.triangle.tolist() == [0] * 4 + [-1]


@every_tree
@pytest.mark.parametrize("k", [0, 2, 4])
def test_overlap(variant, k):
    """Random triangles 2^k times as long as they are far apart, and discs of teeth on one axle."""
    mesh = meshes.soup(100, 2.0**k / 100 ** (1 / 3))
    assert_true(variant.tree(*mesh), mesh, *rays_at(mesh, np.float32))
    mesh = meshes.gears(2**k, 3)
    assert_true(variant.tree(*mesh), mesh, *rays_at(mesh, np.float32))


@every_tree
@both_dtypes
@pytest.mark.parametrize("k", [None, 1, 7, 20, 38, 45])
def test_direction(variant, dtype, k):
    """One or two components of the direction are 0, -0 or 10^-k of the largest, then subnormal in float32."""
    mesh = meshes.icosphere(2, dtype=dtype)
    rng = np.random.default_rng(1)
    small = 0.0 if k is None else 10.0**-k
    directions = rng.normal(size=(60, 3))
    directions[np.arange(60), np.arange(60) % 3] = np.copysign(small, rng.uniform(-1, 1, 60))
    directions[::2][np.arange(30), np.arange(1, 31) % 3] = np.copysign(small, rng.uniform(-1, 1, 30))
    targets = mesh.vertices[rng.integers(0, len(mesh.vertices), 60)].astype(np.float64)
    targets[::3] *= 0.9
    with np.errstate(under="ignore"):
        directions = directions.astype(dtype)
    origins = (targets - 4 * directions.astype(np.float64)).astype(dtype)
    hits = assert_true(variant.tree(*mesh), mesh, origins, directions)
    assert hits.hit.any()


@every_tree
@pytest.mark.parametrize("k", [-140, -100, -60, 60, 120])
def test_magnitude(variant, k):
    """All coordinates times 2^k: products of three underflow or overflow float32."""
    sphere = meshes.icosphere(2)
    mesh = meshes.Triangles(np.ldexp(sphere.vertices, k), sphere.triangles)
    hits = assert_true(variant.tree(*mesh), mesh, *rays_at(mesh, np.float32))
    assert hits.hit.any()


@every_tree
@pytest.mark.parametrize("k", [-1060, -600, -300, 300, 600, 1010])
def test_magnitude_of_float64(variant, k):
    """Beyond float32 at both ends, where boxes rounded outward are infinite or of the smallest size there is."""
    sphere = meshes.icosphere(1, dtype=np.float64)
    mesh = meshes.Triangles(np.ldexp(sphere.vertices, k), sphere.triangles)
    box, rng = np.array(bounds(meshes.icosphere(1))), np.random.default_rng(1)
    away = rng.normal(size=(24, 3)) * 2
    targets = np.where(rng.random((24, 1)) < 0.5, sphere.vertices[rng.integers(0, 42, 24)], rng.uniform(*box, (24, 3)))
    origins = np.ldexp(away, k)
    hits = assert_true(variant.tree(*mesh), mesh, origins, np.ldexp(targets, k) - origins)
    assert hits.hit.any()


@every_tree
@both_dtypes
@pytest.mark.parametrize("k", [-149, -126, -60, 60, 126])
def test_length_of_the_direction(variant, dtype, k):
    """t is in units of it; where it is too large for float32 it is the largest float32, and the triangle is named."""
    mesh = meshes.icosphere(2, dtype=dtype)
    rng = np.random.default_rng(1)
    directions = np.where(rng.random((40, 3)) < 0.4, 0, rng.choice([-1.0, 1.0], (40, 3)))
    directions[~directions.any(axis=1)] = [0, 1, 0]
    targets = mesh.vertices[rng.integers(0, len(mesh.vertices), 40)].astype(np.float64)
    origins = (targets - 3 * directions).astype(dtype)
    hits = assert_true(variant.tree(*mesh), mesh, origins, np.ldexp(directions, k).astype(dtype))
    assert hits.hit.any()
