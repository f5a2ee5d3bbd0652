"""Small whole numbers make edges, vertices, planes and ties the rule: every answer is the oracle's."""

import os

import bihtree
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests import meshes
from tests.agreement import assert_same, assert_true
from tests.variants import VARIANTS, every_tree

EXAMPLES = int(os.environ.get("BIHTREE_EXAMPLES", "60"))

coordinate = st.integers(-2, 2)
point = st.tuples(coordinate, coordinate, coordinate)
limit = st.one_of(st.sampled_from([-np.inf, np.inf, np.nan]), st.integers(-8, 8).map(lambda i: i / 2))
signs = st.tuples(*[st.sampled_from([0.0, -0.0])] * 3)
ray = st.tuples(point, point, signs, st.one_of(st.just(0.0), limit), st.one_of(st.just(np.inf), limit))


@settings(max_examples=EXAMPLES, deadline=None, derandomize=True)
@given(
    triangles=st.lists(st.tuples(point, point, point), min_size=1, max_size=12),
    rays=st.lists(ray, min_size=1, max_size=12),
    dtype=st.sampled_from([np.float32, np.float64]),
)
def test_any_mesh_any_rays_any_limits(triangles, rays, dtype):
    mesh = meshes.from_corners(triangles, dtype)
    origins, directions, zeros, t_min, t_max = (np.array(part, np.float64) for part in zip(*rays, strict=True))
    directions = np.where(directions == 0, zeros, directions)
    answers: dict[str, bihtree.Hits] = {}
    for variant in VARIANTS:
        tree = variant.tree(*mesh)
        tree.validate()
        hits = assert_true(tree, mesh, origins, directions, t_min, t_max)
        # Those of exact have more digits.
        assert_same(answers.setdefault(variant.precision, hits), hits)
        assert np.array_equal(answers["watertight"].triangle, hits.triangle)


@settings(max_examples=EXAMPLES, deadline=None, derandomize=True)
@given(
    triangles=st.lists(st.tuples(point, point, point), min_size=1, max_size=6),
    targets=st.lists(
        st.tuples(point, st.integers(0, 5), st.integers(0, 8), st.integers(0, 8)), min_size=1, max_size=12
    ),
    scale=st.sampled_from([1.0, 1 / 3, 1e-20, 7e15]),
    offset=st.sampled_from([0.0, 1 / 7, 1e3]),
)
def test_rays_at_eighths_of_triangles_scaled_and_moved(triangles, targets, scale, offset):
    """Aimed at vertices, edges and points inside; a rounded target is beside the edge as often as on it."""
    corners = (np.array(triangles, np.float64) + offset) * scale
    mesh = meshes.from_corners(corners, np.float64)
    origins, aims = [], []
    for origin, row, b, c in targets:
        one, two, three = corners[row % len(corners)]
        origins.append((np.array(origin) * 1.5 + offset) * scale)
        aims.append(one + (two - one) * (b / 8) + (three - one) * (c * (8 - b) / 64))
    directions = np.array(aims) - np.array(origins)
    for variant in VARIANTS:
        assert_true(variant.tree(*mesh), mesh, origins, directions)


@every_tree
@pytest.mark.parametrize("seed", range(3))
def test_many_lattice_rays(variant, seed):
    """40 triangles, 200 rays; more than half of the hits are on an edge or in a tie."""
    rng = np.random.default_rng(seed)
    mesh = meshes.from_corners(rng.integers(-2, 3, (40, 3, 3)))
    origins, directions = rng.integers(-3, 4, (200, 3)), rng.integers(-2, 3, (200, 3))
    hits = assert_true(variant.tree(*mesh), mesh, origins, directions)
    edge = hits.hit & ((hits.u == 0) | (hits.v == 0) | (hits.u + hits.v == 1))
    assert edge.sum() > 20
