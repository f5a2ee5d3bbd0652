"""Case 3: rays that no answer can be given for are misses and counted, whatever stands around them."""

import itertools

import numpy as np

from tests import meshes
from tests.agreement import assert_true
from tests.many_rays import RAYS, assert_many_true
from tests.rays import Rays
from tests.variants import every_precision, every_tree, every_tree_of_many_rays

INF, NAN = np.inf, np.nan


def every_ray():
    """All origins, directions and limits with one or two special values, each beside a valid ray."""
    special = (NAN, INF, -INF)
    good_o, good_d = (0.25, 0.25, 2.0), (0.0, 0.0, -1.0)
    origins = [good_o] + [tuple(np.where(np.arange(3) == i, value, good_o)) for i in range(3) for value in special]
    directions = [good_d, (0.0, 0.0, 0.0), (-0.0, 0.0, -0.0)]
    directions += [tuple(np.where(np.arange(3) == i, value, good_d)) for i in range(3) for value in special]
    limits = [
        (0.0, INF),
        (-INF, INF),
        (-INF, 3.0),
        (NAN, INF),
        (0.0, NAN),
        (INF, INF),
        (-INF, -INF),
        (2.0, 1.0),
        (INF, -INF),
    ]
    rays = list(itertools.product(origins, directions, limits))
    o, d, limit = (np.array(part) for part in zip(*rays, strict=True))
    return o, d, limit[:, 0], limit[:, 1]


@every_tree
def test_invalid_rays_are_counted_misses_and_their_neighbours_are_not_disturbed(variant):
    mesh = meshes.sheets(3, 0.5)
    tree = variant.tree(*mesh)
    origins, directions, t_min, t_max = every_ray()
    for dtype in (np.float32, np.float64):
        with np.errstate(invalid="ignore"):
            hits = assert_true(tree, mesh, origins.astype(dtype), directions.astype(dtype), t_min, t_max)
        assert hits.hit.sum() == 3
        assert hits.invalid > 1000
        assert not np.isnan(hits.u[~hits.hit]).any() and not hits.u[~hits.hit].any() and not hits.v[~hits.hit].any()


@every_precision
def test_an_empty_but_sound_interval_is_a_plain_miss(variant):
    tree = variant.tree(*meshes.sheets(2))
    hits = tree.intersect([[0.25, 0.25, 1.0]], [[0.0, 0.0, -1.0]], t_min=2.0, t_max=0.5)
    assert hits.triangle.tolist() == [-1]
    assert hits.invalid == 0


@every_precision
def test_invalid_rays_cost_nothing(variant):
    mesh = meshes.terrain(20)
    tree = variant.tree(*mesh)
    origins, directions, _, _ = every_ray()
    bad = ~(np.isfinite(origins).all(axis=1) & np.isfinite(directions).all(axis=1) & directions.any(axis=1))
    nodes, tests = tree.traversal_cost(origins[bad], directions[bad])
    assert not nodes.any() and not tests.any()


@every_precision
def test_a_tree_of_nothing_counts_them_too(variant):
    tree = variant.tree(np.empty((0, 3), np.float32))
    hits = tree.intersect([[NAN, 0, 0], [0, 0, 0]], [[0, 0, 1.0], [0, 0, 1.0]])
    assert hits.triangle.tolist() == [-1, -1]
    assert hits.invalid == 1


@every_tree_of_many_rays
def test_a_hundred_thousand_rays_of_which_half_are_invalid(variant):
    """Each number of a ray is special now and then; valid ones hit a vertex, an edge, or sheets at their limits."""
    rng = np.random.default_rng(2)
    special = np.array([NAN, INF, -INF, 0.0, -0.0, 5e-324, 1e300])

    def spoilt(values):
        return np.where(rng.random(values.shape) < 0.1, special[rng.integers(0, 7, values.shape)], values)

    origins = rng.choice([0.0, 0.25, 0.5, 1.0], (RAYS, 3)) + [0, 0, 1]
    directions = np.stack([rng.choice([0.0, -0.0, 0.25], RAYS), np.zeros(RAYS), -np.ones(RAYS)], axis=1)
    limits = spoilt(rng.choice([0.0, 1.0, 1.5, INF], (RAYS, 2)))
    with np.errstate(invalid="ignore"):
        rays = Rays(spoilt(origins), spoilt(directions))
        assert_many_true(variant, meshes.sheets(3, 0.5), rays, limits[:, 0] - 1, limits[:, 1])
