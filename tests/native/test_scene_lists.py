"""All hits of a ray among instances, and how often it crosses their surfaces: those of the flattened mesh."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.instances import anywhere, flattened, moved
from tests.rays import around, at_features, joined
from tests.variants import FAST_VARIANTS, VARIANTS

SHOWN = (meshes.icosphere(1), meshes.gears(2, 5), meshes.soup(30, 0.4), meshes.box())
ROWS = np.array([0, 1, 2, 3, 0, 2])
TREES = tuple(variant for variant in VARIANTS + FAST_VARIANTS if variant.precision != "exact")


def scene_and_mesh(variant):
    matrices = anywhere(len(ROWS), np.random.default_rng(6), 2.0)
    shown = [SHOWN[row] for row in ROWS]
    scene = bihtree.Scene([variant.tree(*mesh) for mesh in SHOWN], ROWS, matrices)
    return scene, shown, flattened(shown, matrices)


@pytest.mark.parametrize("variant", TREES, ids=str)
def test_lists_and_crossings_are_those_of_the_flattened_mesh(variant):
    scene, shown, world = scene_and_mesh(variant)
    rng = np.random.default_rng(1)
    rays = joined(around(world, 40, rng), at_features(world, 60, rng))
    tree = bihtree.Tree(*world)
    expected, lists = tree.intersect_all(*rays), scene.intersect_all(*rays)
    starts = np.cumsum([0] + [len(mesh.triangles) for mesh in shown])
    assert lists.offsets.tolist() == expected.offsets.tolist() and len(lists) == len(rays.origins)
    assert (lists.triangle + starts[lists.instance]).tolist() == expected.triangle.tolist()
    assert np.allclose(lists.t, expected.t, rtol=1e-6) and np.allclose(lists.u, expected.u, atol=1e-6)
    assert lists.instance.dtype == np.int32 and lists.offsets.dtype == np.int64
    assert scene.count(*rays).tolist() == tree.count(*rays).tolist()
    assert len(lists.t) > 2 * len(rays.origins)


def test_the_nearest_so_many_and_limits():
    tree = bihtree.Tree(*meshes.sheets(1))
    scene = bihtree.Scene([tree], np.zeros(5, int), [moved(np.eye(3), (0, 0, z)) for z in (0, 4, 2, 1, 2)])
    rays = [[0.25, 0.25, 5]], [[0, 0, -1.0]]
    assert scene.intersect_all(*rays).instance.tolist() == [1, 2, 4, 3, 0]
    for most in range(1, 6):
        lists = scene.intersect_all(*rays, max_hits=most)
        assert lists.instance.tolist() == [1, 2, 4, 3, 0][:most] and lists.offsets.tolist() == [0, most]
    assert scene.intersect_all(*rays, t_min=1.5, t_max=4).t.tolist() == [3, 3, 4]
    assert (scene.count(*rays).tolist(), scene.count(*rays, t_min=1.5, t_max=4).tolist()) == ([5], [3])
    with pytest.raises(ValueError, match="max_hits: 0 is below 1"):
        scene.intersect_all(*rays, max_hits=0)
    invalid = scene.intersect_all([[np.nan, 0, 0], [0.25, 0.25, 5]], [[0, 0, -1.0]] * 2)
    assert invalid.offsets.tolist() == [0, 0, 5]


def test_a_closed_surface_is_crossed_an_even_number_of_times_at_every_vertex():
    matrices = anywhere(20, np.random.default_rng(8), 1.0)
    mesh = meshes.icosphere(1)
    scene = bihtree.Scene([bihtree.Tree(*mesh)], np.zeros(20, int), matrices)
    world = flattened([mesh] * 20, matrices)
    rays = at_features(world, 300, np.random.default_rng(2), np.float64)
    counts = scene.count(*rays)
    assert (counts % 2 == 0).all() and (counts <= np.diff(scene.intersect_all(*rays).offsets)).all()
    assert counts.max() > 4
