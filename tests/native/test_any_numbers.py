"""Numbers of every size and sign, the smallest and largest too, in meshes, rays and limits: the oracle's answers."""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests import meshes
from tests.agreement import assert_true
from tests.variants import MANY_RAYS_VARIANTS

EXAMPLES = int(os.environ.get("BIHTREE_EXAMPLES", "40"))


def points(number, least, most):
    return st.lists(st.tuples(number, number, number), min_size=least, max_size=most)


@pytest.mark.parametrize(("dtype", "width"), [(np.float32, 32), (np.float64, 64)])
def test_any_numbers(dtype, width):
    """A few points are shared by the triangles and the rays, so that rays run through vertices and edges."""
    number = st.one_of(
        st.floats(width=width, allow_nan=False, allow_infinity=False),
        st.integers(-3, 3).map(float),
        st.sampled_from([0.0, -0.0, *(sign * float(x) for x in _ends(dtype) for sign in (1, -1))]),
    )

    @settings(max_examples=EXAMPLES, deadline=None, derandomize=True)
    @given(
        shared=points(number, 3, 6),
        rows=st.lists(st.tuples(*[st.integers(0, 5)] * 3), min_size=1, max_size=8),
        ends=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=6),
        others=points(number, 2, 6),
        limits=st.lists(st.one_of(st.just(0.0), st.just(np.inf), number), min_size=2, max_size=2),
    )
    def any_mesh_any_rays(shared, rows, ends, others, limits):
        vertices = np.array(shared, dtype)
        triangles = np.array(rows) % len(shared)
        aims = np.array([(shared[i % len(shared)], shared[j % len(shared)]) for i, j, _ in ends], np.float64)
        away = np.array([others[k % len(others)] for *_, k in ends], np.float64)
        with np.errstate(all="ignore"):
            target = aims[:, 0] / 2 + aims[:, 1] / 2
            origins = np.concatenate([away, target, target - away])
            directions = np.concatenate([target - away, away, away])
        mesh = meshes.Triangles(vertices, triangles.astype(np.int32))
        for variant in MANY_RAYS_VARIANTS:
            assert_true(variant.tree(*mesh), mesh, origins, directions, *limits)

    any_mesh_any_rays()


def _ends(dtype):
    """The smallest, the smallest normal, beside 1, and the largest."""
    info = np.finfo(dtype)
    return info.smallest_subnormal, info.tiny, 1 - info.epsneg, 1 + info.eps, info.max
