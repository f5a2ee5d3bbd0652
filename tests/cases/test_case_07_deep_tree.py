"""Case 7: a tree as deep as the build allows is built without recursion and traced within the proven stack."""

import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_true
from tests.many_rays import RAYS, assert_many_true
from tests.rays import Rays
from tests.variants import every_tree, every_tree_of_many_rays

SPATIAL = 96  # cells are halved down to this depth
DEEPEST = 125  # and ranges of what is left 29 times more at most


def towards_zero(steps, bunch, dtype):
    """One triangle about 2^-k (1, 1, 1) for each k, parted off by a halving, and `bunch` coincident ones at the end."""
    size = 2.0 ** -np.arange(steps)[:, None, None]
    shape = np.array([[1.0, 1.0, 1.0], [1.25, 1.0, 1.0], [1.0, 1.25, 1.125]])
    corners = np.vstack([shape * size, np.repeat(shape[None] * size[-1:], bunch, axis=0)])
    return meshes.from_corners(corners, dtype)


@every_tree
@pytest.mark.parametrize(("dtype", "steps"), [(np.float32, 125), (np.float64, 125)])
def test_the_deepest_tree(variant, dtype, steps):
    mesh = towards_zero(steps, 64, dtype)
    tree = variant.tree(*mesh)
    tree.validate()
    depth = tree.nodes()["depth"].max()
    leaf_size = variant.options.get("leaf_size", 4 if tree.stats.layout == "classic" else 8)
    assert depth <= DEEPEST
    if tree.stats.heuristic == "global":
        assert depth >= SPATIAL - leaf_size
        assert depth > SPATIAL or leaf_size > 1
    if tree.stats.layout == "classic":
        assert depth == tree.stats.depth

    corners = mesh.corners().astype(np.float64)
    targets = corners.mean(axis=1)
    along_diagonal = np.ones((len(targets), 3))
    from_above = targets + [0, 0, 1] * targets[:, 2:]
    assert_true(tree, mesh, from_above, [0, 0, -1.0] * targets[:, 2:])
    assert_true(tree, mesh, from_above, targets - from_above)
    origins = np.vstack([-targets, 2 * targets])
    assert_true(tree, mesh, origins, np.vstack([along_diagonal, -along_diagonal]))
    behind = np.array([[4, 4, 4.0], [-1, -1, -1], [4, 1e-30, 1e-30], [1e-30, -3, 1e-30]])
    assert_true(tree, mesh, behind, -behind)


@every_tree
def test_nested_clusters(variant):
    """A cluster in the corner of a cluster, 12 times over, each 1000 times smaller: deep and wide at once."""
    clusters = [meshes.soup(12, seed=level) for level in range(12)]
    mesh = meshes.joined(
        *(
            meshes.Triangles(part.vertices * np.float32(10.0 ** (-3 * level)), part.triangles)
            for level, part in enumerate(clusters)
        )
    )
    tree = variant.tree(*mesh)
    tree.validate()
    assert tree.stats.depth <= DEEPEST
    targets = mesh.corners().astype(np.float64).mean(axis=1)
    rng = np.random.default_rng(1)
    away = rng.normal(size=targets.shape) * 10.0 ** rng.integers(-36, 1, (len(targets), 1))
    hits = assert_true(tree, mesh, targets + away, -away)
    assert hits.hit.mean() > 0.5


@every_tree_of_many_rays
def test_a_hundred_thousand_rays(variant):
    """At vertices and middles of edges of all sizes, from beside them and from afar."""
    mesh = towards_zero(120, 8, np.float32)
    rng = np.random.default_rng(5)
    corners = mesh.corners().astype(np.float64)
    row = rng.integers(0, len(corners), RAYS)
    weights = np.array([[1, 0, 0], [0, 1, 0], [0.5, 0, 0.5], [1 / 3, 1 / 3, 1 / 3]])[rng.integers(0, 4, RAYS)]
    target = (weights[:, :, None] * corners[row]).sum(axis=1)
    away = rng.normal(size=(RAYS, 3)) * target[:, :1] * 10.0 ** rng.integers(-1, 4, (RAYS, 1))
    assert_many_true(variant, mesh, Rays(target + away, -away))
