"""Case 2: rays in the plane of a node's side, of a clip plane or of a triangle, where a slab test meets 0 · inf."""

import itertools

import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_true
from tests.many_rays import assert_many_true, on_a_lattice
from tests.variants import every_tree, every_tree_of_many_rays


def lattice_rays(rng, count, size):
    """Origins on a lattice of halves about [0, size]^3, directions towards the 26 neighbours, zeros of both signs."""
    origins = rng.integers(-2, 2 * size + 3, (count, 3)) / 2
    neighbours = [step for step in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(step)]
    directions = np.array(neighbours)[rng.integers(0, 26, count)]
    return origins, np.where(directions == 0, np.copysign(0.0, rng.uniform(-1, 1, (count, 3))), directions)


def blocks(size):
    """Every second cell of a cube of unit cells as a box: clip planes and triangles all lie on integers."""
    cells = [cell for cell in itertools.product(range(size), repeat=3) if sum(cell) % 2 == 0]
    return meshes.joined(*(meshes.box(cell, np.add(cell, 1)) for cell in cells))


@every_tree
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_rays_along_the_faces_of_blocks(variant, dtype):
    mesh = blocks(3)
    rays = lattice_rays(np.random.default_rng(1), 150, 3)
    hits = assert_true(variant.tree(*mesh.astype(dtype)), mesh, *(part.astype(dtype) for part in rays))
    assert 40 < hits.hit.sum() < 150


@every_tree
@pytest.mark.parametrize("axis", range(3))
def test_rays_in_the_plane_of_a_flat_mesh_miss_and_others_hit(variant, axis):
    flat = meshes.grid(4, 4)
    mesh = meshes.Triangles(np.roll(flat.vertices, axis + 1, axis=1), flat.triangles)
    origins, directions = lattice_rays(np.random.default_rng(2), 150, 4)
    origins[:60, axis] = 0
    directions[:60, axis] = 0
    directions[:60][~directions[:60].any(axis=1)] = np.roll([0, 1, 0], axis)
    hits = assert_true(variant.tree(*mesh), mesh, origins, directions)
    assert not hits.hit[:60].any()
    assert hits.hit[60:].any()


@every_tree
def test_rays_in_the_sides_of_the_bounds(variant):
    """Along each of the 12 edges and in each of the 6 sides of the box around two slanted triangles."""
    mesh = meshes.from_corners([[[0, 0, 0], [4, 0, 4], [0, 4, 4]], [[8, 8, 8], [8, 4, 0], [4, 8, 0]]])
    tree = variant.tree(*mesh)
    origins, directions = [], []
    for axis, other, third in itertools.permutations(range(3)):
        for side, place in itertools.product((0, 8), (0, 2, 4, 8)):
            for sign in (-1.0, 1.0):
                origin, direction = np.zeros(3), np.full(3, -0.0)
                origin[axis], origin[other], origin[third] = 4 - 6 * sign, side, place
                direction[axis] = sign
                origins.append(origin)
                directions.append(direction)
    hits = assert_true(tree, mesh, origins, directions)
    assert hits.hit.any() and not hits.hit.all()


@every_tree_of_many_rays
def test_a_hundred_thousand_rays_along_the_faces_of_blocks(variant):
    """On a lattice of whole numbers, the middles of the blocks' edges included: the blocks are two wide."""
    mesh = blocks(2)
    mesh = meshes.Triangles(2 * mesh.vertices, mesh.triangles)
    assert_many_true(variant, mesh, on_a_lattice(-2, 6, 1))


@every_tree
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("height", [0.1, 0.7, -0.1, 1e-40, 1e300])
def test_flat_meshes_between_two_numbers_of_single_precision(variant, axis, height):
    """Their boxes are flat too, but for the rounding outward: a ray that ends in the plane still hits."""
    flat = meshes.grid(3, 3, np.float64)
    mesh = meshes.Triangles(np.roll(flat.vertices + [0, 0, height], axis + 1, axis=1), flat.triangles)
    tree = variant.tree(*mesh)
    tree.validate()
    rng = np.random.default_rng(1)
    origins = np.roll(np.hstack([rng.uniform(0, 3, (40, 2)), np.full((40, 1), height)]), axis + 1, axis=1)
    directions = rng.choice([-1.0, 1.0], (40, 3)) * rng.integers(0, 2, (40, 3))
    directions[:, axis] = rng.choice([-1.0, 1.0], 40)
    hits = assert_true(tree, mesh, origins, directions, 0.0, 0.0)
    assert hits.hit.all()
