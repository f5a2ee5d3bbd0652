"""Sweeps over stiffness: one number grows by orders of magnitude, and every answer is decided exactly.

Those of addon/report/sweeps.py; short here, long where BIHTREE_STRESS is set. tests/sweep_table.py counts the same.
"""

import numpy as np
import pytest

from addon.report.sweeps import SWEEPS
from tests import meshes
from tests.agreement import assert_true
from tests.many_rays import at_weak_places
from tests.oracle import Oracle
from tests.rays import Rays, bounds
from tests.variants import STRESS, every_tree

both_dtypes = pytest.mark.parametrize("dtype", [np.float32, np.float64])

# Thousands of sheets an ulp apart take the oracle minutes.
SHORT = {name: sweep.ks[:: max(1, len(sweep.ks) // 4)] for name, sweep in SWEEPS.items()}
SHORT |= {"direction": (0, 7, 20, 38, 45), "magnitude": (-140, -100, 0, 60, 120), "depth complexity": (0, 4, 9)}
EVERY = [(name, k) for name, sweep in SWEEPS.items() for k in (sweep.ks if STRESS else SHORT[name])]


@every_tree
@both_dtypes
@pytest.mark.parametrize(("name", "k"), EVERY)
def test_every_answer_is_true(variant, dtype, name, k):
    """No wrong hit and no miss of what is hit, and t, u and v within the bounds of the precision."""
    step = SWEEPS[name].at(k, 2_000 if STRESS else 60, dtype=dtype)
    mesh = meshes.Triangles(step.vertices, step.triangles.astype(np.int32))
    assert_true(variant.tree(*mesh), mesh, *Rays(step.origins, step.directions))


@pytest.mark.parametrize(("name", "k"), [(name, ks[i]) for name, ks in SHORT.items() for i in (0, -1)])
def test_most_rays_of_a_step_hit(name, k):
    """What only missed would show little; in float64, because float32 may leave nothing of the mesh."""
    step = SWEEPS[name].at(k, 60, dtype=np.float64)
    mesh = meshes.Triangles(step.vertices, step.triangles.astype(np.int32))
    truth = Oracle(*mesh).decide(step.origins, step.directions)
    assert (truth.triangle >= 0).mean() > 0.3


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


@every_tree
@pytest.mark.parametrize("k", [0, 2, 4])
def test_discs_of_teeth_on_one_axle(variant, k):
    """More and more that overlap, and are long and thin."""
    mesh = meshes.gears(2**k, 3)
    assert_true(variant.tree(*mesh), mesh, *at_weak_places(mesh, 60))
