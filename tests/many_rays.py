"""A hundred thousand rays of a hard case, each decided by the oracle: nearly all leave every filter."""

from __future__ import annotations

import bihtree
import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from tests.agreement import assert_true
from tests.meshes import Triangles
from tests.rays import Rays, around, at_features, joined
from tests.variants import STRESS, Variant

RAYS = 1_000_000 if STRESS else 100_000
FEWER_RAYS = 100_000 if STRESS else 10_000  # where rays are not what makes a case hard
BATCH = 100_000  # so that the oracle remembers what it has decided for other trees


def assert_many_true(
    variant: Variant, mesh: Triangles, rays: Rays, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
) -> bihtree.Tree:
    """A new tree answers all of them as the oracle does."""
    tree = variant.tree(*mesh)
    assert_all_true(tree, mesh, rays, t_min, t_max)
    return tree


def assert_all_true(
    tree: bihtree.Tree, mesh: Triangles, rays: Rays, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
) -> None:
    """The tree answers all of them as the oracle does."""
    count = len(rays.origins)
    near, far = (np.broadcast_to(np.asarray(limit, np.float64), count) for limit in (t_min, t_max))
    for first in range(0, count, BATCH):
        part = slice(first, first + BATCH)
        assert_true(tree, mesh, rays.origins[part], rays.directions[part], near[part], far[part])


def at_weak_places(mesh: Triangles, count: int = RAYS, seed: int = 1, dtype: DTypeLike = np.float32) -> Rays:
    """From around the mesh: nine of ten at its vertices, the middles of its edges and other points of them."""
    rng = np.random.default_rng(seed)
    return joined(around(mesh, count // 10, rng, dtype), at_features(mesh, count - count // 10, rng, dtype))


def on_a_lattice(low: int, high: int, reach: int, count: int = RAYS, seed: int = 1) -> Rays:
    """Whole numbers: origins low … high, components of directions -reach … reach, not all 0; zeros of both signs."""
    rng = np.random.default_rng(seed)
    origins = rng.integers(low, high + 1, (count, 3)).astype(np.float64)
    directions = rng.integers(-reach, reach + 1, (count, 3)).astype(np.float64)
    directions[~directions.any(axis=1)] = [0, 0, 1]
    return Rays(origins, np.where(directions == 0, np.copysign(0.0, rng.uniform(-1, 1, (count, 3))), directions))
