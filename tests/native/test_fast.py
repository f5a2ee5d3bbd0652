"""precision="fast": what single precision gives, the same bits however it is asked."""

import os

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests import rays as make
from tests.agreement import assert_same
from tests.cases.test_case_03_invalid_rays import every_ray
from tests.meshes import shared_mesh
from tests.variants import every_fast_tree


def random_rays(mesh, count, seed=1):
    return make.around(mesh, count, np.random.default_rng(seed))


@every_fast_tree
@pytest.mark.parametrize("name", ["stanford-bunny", "dragon-res3", "cube-40k", "legocar"])
def test_random_rays_hit_what_embree_hits(variant, name):
    """embreex without its robust mode, which is single precision too."""
    if not os.environ.get("CI"):
        pytest.importorskip("embreex", reason="embreex, the peer, is not installed: python -m pip install embreex")
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    mesh = shared_mesh(name).astype(np.float32)
    rays = random_rays(mesh, 20_000)
    scene = EmbreeScene()
    TriangleMesh(scene, mesh.vertices, mesh.triangles)
    peer = scene.run(*rays, query="DISTANCE")
    hits = variant.tree(*mesh).intersect(*rays)
    # Which of two triangles is hit at an edge that they share is left to rounding; where it is hit is not.
    scale = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    length = np.linalg.norm(rays.directions, axis=1)
    with np.errstate(invalid="ignore"):
        apart = np.abs(np.where(hits.hit, hits.t, np.inf) - np.where(peer < 1e30, peer, np.inf)) * length
    agree = (hits.hit == (peer < 1e30)) & ~(apart > 1e-4 * scale)
    assert hits.hit.sum() > 2000
    assert agree.mean() >= 0.999, f"{(~agree).sum()} of {len(agree)} rays"


@every_fast_tree
def test_the_watertight_answer_within_rounding(variant):
    mesh = meshes.terrain(60)
    rays = random_rays(mesh, 20_000)
    fast = variant.tree(*mesh).intersect(*rays)
    truth = bihtree.Tree(*mesh).intersect(*rays)
    assert (fast.triangle == truth.triangle).mean() >= 0.999
    same = truth.hit & (fast.triangle == truth.triangle)
    assert np.abs(fast.t[same] / truth.t[same] - 1).max() < 1e-3
    assert np.abs(fast.u[same] - truth.u[same]).max() < 1e-2
    assert np.abs(fast.v[same] - truth.v[same]).max() < 1e-2
    assert not fast.u[~fast.hit].any() and not fast.v[~fast.hit].any() and np.isinf(fast.t[~fast.hit]).all()


@every_fast_tree
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_one_answer_however_it_is_asked(variant, dtype):
    """Any number of threads, rays alone or together, float32 or the same in float64; any hit where there is one."""
    mesh = meshes.joined(meshes.gears(6, 30), meshes.gears(6, 30)).astype(dtype)
    rng = np.random.default_rng(1)
    rays = make.joined(make.around(mesh, 3000, rng), make.at_features(mesh, 3000, rng))
    hits = variant.tree(*mesh).intersect(*rays)
    assert hits.t.dtype == hits.u.dtype == hits.v.dtype == dtype
    assert hits.hit.sum() > 1000
    for threads in (1, 2, 5):
        tree = variant.tree(*mesh, threads=threads)
        assert_same(tree.intersect(*rays), hits)
        assert_same(tree.intersect(*(part.astype(np.float64) for part in rays)), hits)
        assert np.array_equal(tree.occluded(*rays), hits.hit)
    for ray in range(0, len(hits), 97):
        alone = variant.tree(*mesh).intersect(rays.origins[ray : ray + 1], rays.directions[ray : ray + 1])
        assert (alone.triangle[0], alone.t[0]) == (hits.triangle[ray], hits.t[ray])


@every_fast_tree
def test_of_equal_distances_the_lower_row(variant):
    one = meshes.terrain(10)
    mesh = meshes.joined(one, one, one)
    rays = random_rays(mesh, 2000)
    hits = variant.tree(*mesh).intersect(*rays)
    assert hits.hit.sum() > 200
    assert hits.triangle.max() < len(one.triangles)


@every_fast_tree
def test_invalid_rays_are_counted_misses(variant):
    mesh = meshes.sheets(3, 0.5)
    origins, directions, t_min, t_max = every_ray()
    with np.errstate(invalid="ignore"):
        truth = bihtree.Tree(*mesh).intersect(origins, directions, t_min=t_min, t_max=t_max)
        hits = variant.tree(*mesh).intersect(origins, directions, t_min=t_min, t_max=t_max)
    assert hits.invalid == truth.invalid > 1000
    assert_same(hits, truth)


@every_fast_tree
def test_limits_are_of_the_distance(variant):
    mesh = meshes.sheets(3, 0.5)
    tree = variant.tree(*mesh)
    down = np.array([[0.25, 0.25, 4.0]]), np.array([[0.0, 0.0, -1.0]])
    every = np.sort(tree.intersect(*down).t)
    t = float(every[0])
    for t_min, t_max, is_hit in [(0, t, True), (t, np.inf, True), (t, t, True), (0, np.nextafter(t, 0), False)]:
        hits = tree.intersect(*down, t_min=t_min, t_max=t_max)
        assert bool(hits.hit[0]) is is_hit and tree.occluded(*down, t_min=t_min, t_max=t_max)[0] == is_hit
    assert tree.intersect(*down, t_min=np.nextafter(t, np.inf)).t[0] > t
    assert tree.intersect(*down, t_min=-np.inf).t[0] <= t


@every_fast_tree
def test_numbers_of_any_size_do_no_harm(variant):
    """Overflow and underflow may lose hits, but nothing hangs, fails or is not a number."""
    rng = np.random.default_rng(3)
    size = 10.0 ** rng.integers(-42, 38, (400, 1, 1))
    soup = (rng.uniform(-1, 1, (400, 3, 3)) * size).astype(np.float32)
    tree = variant.tree(soup.reshape(-1, 3))
    scale = 10.0 ** rng.integers(-300, 300, (4000, 1))
    origins = rng.uniform(-1, 1, (4000, 3)) * 10.0 ** rng.integers(-42, 38, (4000, 1))
    hits = tree.intersect(origins, rng.uniform(-1, 1, (4000, 3)) * scale)
    assert hits.hit.any()
    for part in (hits.t, hits.u, hits.v):
        assert not np.isnan(part).any()
    assert np.isfinite(hits.t[hits.hit]).all()
    assert (hits.u >= 0).all() and (hits.v >= 0).all() and (hits.u + hits.v <= 1 + 2**-22).all()


def test_the_stats_say_so():
    assert bihtree.Tree(*meshes.box(), precision="fast").stats.precision == "fast"
    assert bihtree.Tree(*meshes.box()).stats.precision == "watertight"
