"""contains: inside a closed mesh or on it, by the oracle's parity in directions by chance."""

import os

import bihtree
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests import meshes, parity
from tests.variants import FAST_VARIANTS, VARIANTS, every_tree

EXAMPLES = int(os.environ.get("BIHTREE_EXAMPLES", "40"))

every_precision = pytest.mark.parametrize("variant", VARIANTS + FAST_VARIANTS, ids=str)

coordinate = st.integers(-2, 2)
point = st.tuples(coordinate, coordinate, coordinate)


@settings(max_examples=EXAMPLES, deadline=None, derandomize=True)
@given(
    corners=st.lists(st.tuples(point, point, point, point), min_size=1, max_size=4),
    points=st.lists(point, min_size=1, max_size=8),
    dtype=st.sampled_from([np.float32, np.float64]),
    seed=st.integers(0, 100),
)
def test_closed_meshes_of_whole_numbers(corners, points, dtype, seed):
    """Tetrahedra, flat ones too, through each other: vertices, edges and planes are met all the time."""
    sides = [[t[i], t[j], t[k]] for t in corners for i, j, k in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))]
    mesh = meshes.from_corners(sides, dtype)
    half = np.array(points, np.float64) / 2
    everywhere = np.concatenate([half, 2 * half, mesh.vertices[: len(points)]])
    expected = list(parity.insides(mesh, everywhere, seed))
    for variant in (*VARIANTS, *FAST_VARIANTS):
        assert variant.tree(*mesh).contains(everywhere).tolist() == expected


@every_precision
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_sphere(variant, dtype):
    mesh = meshes.icosphere(2).astype(dtype)
    tree = variant.tree(*mesh)
    rng = np.random.default_rng(1)
    corners = mesh.corners().astype(np.float64)
    middles = corners.mean(axis=1)
    points = np.concatenate(
        [mesh.vertices, rng.uniform(-1.1, 1.1, (60, 3)), middles * (1 - 1e-9), middles * (1 + 1e-9)]
    )
    inside = tree.contains(points)
    assert inside.dtype == np.bool_ and inside.shape == (len(points),)
    assert inside[: len(mesh.vertices)].all()
    assert inside[-2 * len(middles) : -len(middles)].all() and not inside[-len(middles) :].any()
    some = np.arange(len(mesh.vertices) - 10, len(mesh.vertices) + 70)
    assert inside[some].tolist() == list(parity.insides(mesh, points[some]))


@every_precision
def test_a_box_and_points_of_its_grid(variant):
    """Points below, above and beside vertices, edges and diagonals, on upright sides too."""
    tree = variant.tree(*meshes.box())
    z, y, x = np.mgrid[-1:4, -1:4, -1:4] / 2
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    expected = ((points >= 0) & (points <= 1)).all(axis=1)
    assert np.array_equal(tree.contains(points), expected)
    tiny = np.nextafter(1, 2) - 1
    assert not tree.contains(points[expected & (points[:, 2] == 1)] + [0, 0, tiny]).any()
    assert not tree.contains(points[expected & (points[:, 0] == 0)] - [5e-324, 0, 0]).any()


@every_tree
def test_a_torus_and_a_hollow(variant):
    """A wall between two boxes: inside is between them; and bodies that overlap take each other away."""
    hollow = meshes.joined(meshes.box((0, 0, 0), (4, 4, 4)), meshes.box((1, 1, 1), (3, 3, 3)))
    points = [[0.5, 2, 2], [2, 2, 2], [1, 2, 2], [2, 2, 3], [3.5, 3.5, 3.5], [5, 2, 2], [4, 4, 4], [2, 2, -1]]
    assert variant.tree(*hollow).contains(points).tolist() == [True, False, True, True, True, False, True, False]


@pytest.mark.parametrize("name", ["stanford-bunny"])
def test_a_scan_with_points_on_its_vertices(name):
    """Some vertices are exactly below others; the hole-free part of the parity is tested by directions by chance."""
    mesh = meshes.shared_mesh(name)
    tree = bihtree.Tree(*mesh)
    assert tree.contains(mesh.vertices[np.unique(mesh.triangles)]).all()
    rng = np.random.default_rng(1)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    points = rng.uniform(low, high, (3000, 3))
    inside = tree.contains(points)
    assert 300 < inside.sum() < 2000
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    assert np.array_equal(inside, tree.count(points, up) % 2 == 1)
    for variant in VARIANTS + FAST_VARIANTS:
        assert np.array_equal(variant.tree(*mesh).contains(points), inside), variant


def edges_used_twice(mesh):
    edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()


@pytest.mark.parametrize("make", [lambda: meshes.icosphere(3), lambda: meshes.icosphere(2, 0.7), meshes.box])
def test_the_same_for_any_direction(make):
    """Of a closed mesh: crossings in any direction, aimed at vertices above all, have the parity that contains has."""
    mesh = make()
    assert edges_used_twice(mesh)
    tree = bihtree.Tree(*mesh)
    rng = np.random.default_rng(2)
    points = np.repeat(rng.uniform(-1, 1, (100, 3)).astype(np.float32), 30, axis=0)
    aims = mesh.vertices[rng.integers(0, len(mesh.vertices), len(points))]
    inside = tree.contains(points)
    assert 200 < inside.sum() < 3000
    assert np.array_equal(tree.count(points, aims.astype(np.float64) - points) % 2 == 1, inside)


@every_tree
def test_an_open_mesh_by_what_is_above(variant):
    tree = variant.tree(*meshes.grid(2, 2))
    points = [
        [0.5, 0.25, -1],
        [0.5, 0.25, 1],
        [0.5, 0.25, 0],
        [1, 1, -1],
        [0, 0, -1],
        [2, 2, -1],
        [2, 2, 0],
        [3, 1, -1],
    ]
    assert tree.contains(points).tolist() == [True, False, True, True, True, False, True, False]


@every_precision
def test_points_that_are_no_points(variant):
    nan, inf = np.nan, np.inf
    tree = variant.tree(*meshes.box())
    points = [
        [0.5, 0.5, nan],
        [inf, 0.5, 0.5],
        [0.5, -inf, 0.5],
        [0.5, 0.5, 0.5],
        [1e300, 0.5, 0.5],
        [0.5, 0.5, -1e300],
    ]
    assert tree.contains(points).tolist() == [False, False, False, True, False, False]
    assert tree.contains(np.zeros((0, 3))).shape == (0,)
    assert variant.tree(np.zeros((0, 3))).contains([[0, 0, 0]]).tolist() == [False]


def test_float64_meshes_far_from_the_origin_and_small_ones():
    for scale, offset in ((1.0, 1e6), (1e-30, 0.0), (1e200, 0.0), (1.0, 1e12)):
        mesh = meshes.box(dtype=np.float64)
        mesh = mesh._replace(vertices=mesh.vertices * scale + offset)
        z, y, x = np.mgrid[-1:4, -1:4, -1:4] / 2
        points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
        expected = ((points >= 0) & (points <= 1)).all(axis=1)
        for variant in VARIANTS + FAST_VARIANTS:
            assert np.array_equal(variant.tree(*mesh).contains(points * scale + offset), expected), (variant, scale)


def test_same_for_any_number_of_threads_and_on_demand():
    mesh = meshes.icosphere(4)
    points = np.random.default_rng(3).uniform(-1.1, 1.1, (20_000, 3))
    expected = bihtree.Tree(*mesh, threads=1).contains(points)
    for options in ({"threads": 4}, {"threads": 4, "build": "on_demand"}, {"threads": 1, "build": "on_demand"}):
        assert np.array_equal(bihtree.Tree(*mesh, **options).contains(points), expected)


@pytest.mark.parametrize(
    "points", [np.zeros((4, 2)), np.zeros(3), 3.0, np.full((4, 3), None), np.zeros((4, 3), complex)]
)
def test_bad_points(points):
    with pytest.raises(bihtree.GeometryError, match="points"):
        bihtree.Tree(*meshes.box()).contains(points)
