"""Case 1: no ray from inside a closed mesh gets out between its triangles."""

import numpy as np
import pytest

from tests import meshes
from tests.many_rays import RAYS as MANY
from tests.many_rays import assert_many_true
from tests.rays import Rays
from tests.variants import STRESS, every_tree, every_tree_of_many_rays

RAYS = 420_000 if STRESS else 5_000  # of each kind and placement: 10 million in all, or 120,000
BATCH = 500_000

PLACEMENTS = [
    pytest.param(np.float32, 1.0, 0.0, id="unit"),
    pytest.param(np.float32, 1e-30, 0.0, id="tiny"),
    pytest.param(np.float32, 1e25, 0.0, id="huge"),
    pytest.param(np.float32, 1e-38, 0.0, id="subnormal"),
    pytest.param(np.float32, 1e38, 0.0, id="largest"),
    pytest.param(np.float32, 1.0, 1000.0, id="far"),
    pytest.param(np.float32, 1.0, 1e5, id="farther"),
    pytest.param(np.float64, 1.0, 4e5, id="far-float64"),
]


def targets(mesh, kind, count, rng):
    """(count, 3) float64 points of the mesh: vertices, or points of edges."""
    corner = mesh.triangles[rng.integers(0, len(mesh.triangles), count)]
    start = mesh.vertices[corner[:, 0]].astype(np.float64)
    if kind == "vertex":
        return start
    end = mesh.vertices[corner[:, 1]].astype(np.float64)
    weight = 0.5 if kind == "midpoint" else rng.random((count, 1))
    return start + weight * (end - start)


@every_tree_of_many_rays
@pytest.mark.parametrize("kind", ["vertex", "midpoint", "edge"])
@pytest.mark.parametrize(("dtype", "scale", "offset"), PLACEMENTS)
def test_nothing_leaks_out_of_a_sphere(variant, dtype, scale, offset, kind):
    sphere = meshes.icosphere(5 if STRESS else 4, dtype=np.float64)
    with np.errstate(under="ignore"):
        mesh = meshes.Triangles(((sphere.vertices + offset) * scale).astype(dtype), sphere.triangles)
    tree = variant.tree(*mesh)
    rng = np.random.default_rng(1)
    leaks = 0
    for first in range(0, RAYS, BATCH):
        count = min(BATCH, RAYS - first)
        with np.errstate(under="ignore"):
            origins = ((rng.uniform(-0.4, 0.4, (count, 3)) + offset) * scale).astype(dtype)
            directions = (targets(mesh, kind, count, rng) - origins.astype(np.float64)).astype(dtype)
        hits = tree.intersect(origins, directions)
        assert hits.invalid == 0
        leaks += int((~hits.hit).sum())
        assert np.array_equal(tree.occluded(origins, directions), hits.hit)
    assert leaks == 0


def cells_of_a_cube(size):
    """A closed cube [0, size]^3 of unit squares, each two triangles, every edge shared by two of them."""
    flat = meshes.grid(size, size, np.float64)
    sides = []
    for axis in range(3):
        for height in (0, size):
            vertices = np.roll(flat.vertices + [0, 0, height], axis + 1, axis=1)
            sides.append(meshes.Triangles(vertices.astype(np.float32), flat.triangles))
    return meshes.joined(*sides)


@every_tree
def test_axis_parallel_rays_on_an_integer_grid(variant):
    """Every ray runs through a vertex; components that are 0 come with both signs."""
    size = 12
    mesh = cells_of_a_cube(size)
    tree = variant.tree(*mesh)
    inside = np.stack(np.meshgrid(*[np.arange(1, size)] * 3), axis=-1).reshape(-1, 3).astype(np.float32)
    for axis in range(3):
        for sign in (-1, 1):
            for zero in (0.0, -0.0):
                direction = np.full((len(inside), 3), zero, np.float32)
                direction[:, axis] = sign
                hits = tree.intersect(inside, direction)
                assert np.array_equal(hits.t, size - inside[:, axis] if sign > 0 else inside[:, axis])
                assert tree.occluded(inside, direction).all()


@every_tree
def test_diagonal_rays_on_an_integer_grid(variant):
    """From lattice points along lattice diagonals: through vertices and along the squares' own diagonals."""
    size = 8
    tree = variant.tree(*cells_of_a_cube(size))
    inside = np.stack(np.meshgrid(*[np.arange(1, size)] * 3), axis=-1).reshape(-1, 3).astype(np.float32)
    for direction in np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 3):
        if np.count_nonzero(direction) < 2:
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = np.where(direction > 0, size - inside, inside) / np.abs(direction)
        expected = np.where(direction == 0, np.inf, reach).min(axis=1)
        hits = tree.intersect(inside, np.broadcast_to(direction.astype(np.float32), inside.shape))
        assert np.array_equal(hits.t, expected)


def inside(mesh, kind, count, rng):
    """Rays from near the middle of a mesh around the origin, at its vertices or edges."""
    origins = rng.uniform(-0.4, 0.4, (count, 3)).astype(np.float32)
    return Rays(origins, (targets(mesh, kind, count, rng) - origins).astype(np.float32))


@every_tree_of_many_rays
@pytest.mark.parametrize("kind", ["vertex", "midpoint", "edge"])
def test_a_hundred_thousand_rays_from_inside_a_sphere(variant, kind):
    mesh, rng = meshes.icosphere(1), np.random.default_rng(7)
    count = MANY // 4
    assert_many_true(variant, mesh, inside(mesh, kind, count, rng))


@every_tree_of_many_rays
def test_a_hundred_thousand_rays_on_an_integer_grid(variant):
    size, count, rng = 3, MANY // 4, np.random.default_rng(8)
    origins = rng.integers(1, size, (count, 3)).astype(np.float32)
    directions = rng.integers(-1, 2, (count, 3)).astype(np.float32)
    directions[~directions.any(axis=1)] = [0, 1, 0]
    directions = np.where(directions == 0, np.copysign(np.float32(0), rng.uniform(-1, 1, (count, 3))), directions)
    assert_many_true(variant, cells_of_a_cube(size), Rays(origins, directions.astype(np.float32)))
