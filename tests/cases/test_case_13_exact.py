"""Case 13 in precision exact: images are the real numbers M·v, decided and measured by fractions."""

from fractions import Fraction

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.instances import KINDS, exact_images, moved
from tests.oracle import Hit, crossing, exact
from tests.variants import EXACT

SPHERE = meshes.icosphere(1)


def crossings(corners, origin, direction):
    """Every hit of one ray with t >= 0, nearest first and the lower row first where t is equal."""
    found = []
    for row, triangle in enumerate(corners):
        met = crossing(exact(origin), exact(direction), *triangle)
        if met and met[0] >= 0:
            found.append(Hit(met[0], row, *met[1:]))
    return sorted(found, key=lambda hit: (hit.t, hit.triangle))


def aimed(corners, count, seed=1):
    """Rays at images of vertices, of middles of edges and of points inside, as near as doubles come."""
    rng = np.random.default_rng(seed)
    points = np.array([[[float(x) for x in corner] for corner in triangle] for triangle in corners])
    middle, reach = points.mean(axis=(0, 1)), np.abs(points - points.mean(axis=(0, 1))).max()
    weights = rng.dirichlet(np.ones(3), count)
    weights[: count // 3] = [1, 0, 0]
    weights[count // 3 : 2 * count // 3] = [0.5, 0.5, 0]
    targets = (points[rng.integers(0, len(points), count)] * weights[:, :, None]).sum(axis=1)
    origins = middle + 3 * reach * rng.normal(size=(count, 3))
    return origins, targets - origins


def assert_exact(scene, corners, origins, directions):
    hits, lists = scene.intersect(origins, directions), scene.intersect_all(origins, directions)
    occluded = scene.occluded(origins, directions)
    assert hits.t.dtype == np.float64
    for ray, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        truth = crossings(corners, origin, direction)
        rows = slice(lists.offsets[ray], lists.offsets[ray + 1])
        assert lists.triangle[rows].tolist() == [hit.triangle for hit in truth]
        assert occluded[ray] == hits.hit[ray] == bool(truth)
        if truth:
            assert hits.triangle[ray] == truth[0].triangle
            assert (hits.t[ray], hits.u[ray]) == (lists.t[rows][0], lists.u[rows][0])
        for place, hit in enumerate(truth):
            for name, value in (("t", hit.t), ("u", hit.u), ("v", hit.v)):
                found = getattr(lists, name)[rows][place]
                assert abs(Fraction(float(found)) - value) <= Fraction(float(np.spacing(abs(found)))), (ray, name)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("kind", KINDS)
def test_hits_are_those_of_the_real_images(kind, dtype):
    mesh = SPHERE.astype(dtype)
    corners = exact_images(mesh, KINDS[kind])
    scene = bihtree.Scene([bihtree.Tree(*mesh, precision="exact")], [0], [KINDS[kind]])
    assert_exact(scene, corners, *aimed(corners, 9))


@pytest.mark.parametrize("variant", EXACT, ids=str)
def test_the_same_bits_through_every_tree(variant):
    mesh, matrices = meshes.soup(40, 0.5), np.array([KINDS["sheared"], KINDS["turned"], KINDS["mirrored"]])
    rays = aimed(exact_images(mesh, matrices[0]), 60)
    one, other = (
        bihtree.Scene([tree], [0, 0, 0], matrices).intersect(*rays)
        for tree in (bihtree.Tree(*mesh, precision="exact"), variant.tree(*mesh))
    )
    assert [getattr(one, name).tobytes() for name in ("t", "triangle", "u", "v", "instance")] == [
        getattr(other, name).tobytes() for name in ("t", "triangle", "u", "v", "instance")
    ]
    assert one.hit.any()


def test_what_rounding_would_turn_round_is_told_apart():
    """Two sheets whose images are nearer to each other than doubles are there: the true order, and no tie."""
    sheet = meshes.from_corners([[[0, 0, 1], [1, 0, 1], [0, 1, 1]]], np.float64)
    tree = bihtree.Tree(*sheet, precision="exact")
    tiny = 2.0**-60
    for shift, instance in ((tiny, 1), (-tiny, 0), (0, 0)):
        # z is 1 · 1 + 0 · x + … : the second one is higher by less than half a unit in the last place.
        second = moved([[1, 0, 0], [0, 1, 0], [shift, 0, 1]])
        scene = bihtree.Scene([tree, tree], [0, 1], [np.eye(4), second])
        hits = scene.intersect([[0.25, 0.25, 3]], [[0, 0, -1.0]])
        assert (hits.instance[0], hits.t[0]) == (instance, 2)
        rounded = bihtree.Tree(*sheet)
        tied = bihtree.Scene([rounded, rounded], [0, 1], [np.eye(4), second])
        assert tied.intersect([[0.25, 0.25, 3]], [[0, 0, -1.0]]).instance[0] == 0
