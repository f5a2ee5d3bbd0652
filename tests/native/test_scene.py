"""Scenes of instances: the same hits as one mesh of all images, whatever the trees are; arguments, ties, moves."""

import gc
import pickle
import threading

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_same
from tests.instances import anywhere, as_one_mesh, assert_scene_true, flattened, moved
from tests.rays import Rays, around, at_features, joined, parallel, pinhole
from tests.variants import FAST_VARIANTS, VARIANTS

SHOWN = (meshes.icosphere(1), meshes.gears(2, 5), meshes.soup(30, 0.4), meshes.box())
TREES = tuple(variant for variant in VARIANTS + FAST_VARIANTS if variant.precision != "exact")
DOWN = [0, 0, -1.0]


def rays_at(mesh, count=60, dtype=np.float32, seed=1):
    rng = np.random.default_rng(seed)
    return joined(
        around(mesh, count, rng, dtype), at_features(mesh, count, rng, dtype), pinhole(mesh, 6, 5, dtype=dtype)
    )


@pytest.mark.parametrize("variant", TREES, ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_hits_are_the_oracles(variant, dtype):
    rows = np.array([0, 1, 2, 3, 0, 2, 2, 1])
    matrices = anywhere(len(rows), np.random.default_rng(2))
    kinds = [mesh.astype(dtype) for mesh in SHOWN]
    # A piece of two triangles, so that small trees have some to build on demand.
    scene = bihtree.Scene([variant.tree(*mesh) for mesh in kinds], rows, matrices)
    shown = [kinds[row] for row in rows]
    truth = assert_scene_true(scene, shown, matrices, rays_at(flattened(shown, matrices), dtype=dtype))
    assert 40 < (truth.triangle >= 0).sum() < len(truth)
    result = scene.intersect([[0, 0, 9.0]], [DOWN])
    assert result.t.dtype == scene.bounds.dtype == dtype
    assert result.instance.dtype == np.int32


@pytest.mark.parametrize("options", [{"build": "on_demand"}, {"build": "on_demand", "layout": "classic"}, {}], ids=str)
def test_pieces_are_built_when_rays_come_to_them(options):
    mesh = meshes.terrain(60)
    tree = bihtree.Tree(*mesh, **options)
    eager = bihtree.Scene([bihtree.Tree(*mesh)], [0, 0], [moved((1, 2, 3)), moved((-1, 1, 1), (0, 3, 0))])
    scene = bihtree.Scene([tree], [0, 0], [moved((1, 2, 3)), moved((-1, 1, 1), (0, 3, 0))])
    unbuilt = tree.stats.unbuilt
    assert (unbuilt > 0) == bool(options)
    origins = np.random.default_rng(1).uniform((-1, 0, 9), (1, 4, 10), (200, 3))
    rays = Rays(origins, np.tile(DOWN, (200, 1)))
    assert_same(scene.intersect(*rays), eager.intersect(*rays))
    assert eager.intersect(*rays).hit.all() or eager.intersect(*rays).hit.sum() > 50
    assert tree.stats.unbuilt < unbuilt or not options


def test_ties_go_to_the_lower_instance_and_there_to_the_lower_triangle():
    tree = bihtree.Tree(*meshes.sheets(3))
    rng = np.random.default_rng(1)
    for _ in range(5):
        order = rng.permutation(6)
        heights = np.array([0, 1, 2, 2, 2, 1.0])[order]
        scene = bihtree.Scene([tree, tree], order % 2, [moved(np.eye(3), (0, 0, height)) for height in heights])
        hits = scene.intersect([[0.25, 0.25, 5]], [DOWN])
        assert hits.instance.tolist() == [np.argmax(heights)] and hits.triangle.tolist() == [0]
        assert hits.t.tolist() == [3]


def test_limits_are_closed_and_rays_may_start_anywhere():
    scene = bihtree.Scene([bihtree.Tree(*meshes.sheets(1))], [0, 0], [moved(np.eye(3)), moved(np.eye(3), (0, 0, 1))])
    rays = [[0.25, 0.25, 2]], [DOWN]
    for t_min, t_max, instance in [
        (1, 2, 1),
        (np.nextafter(1, 2), 2, 0),
        (np.nextafter(1, 2), np.nextafter(2, 0), -1),
        (2, np.inf, 0),
        (-np.inf, 1, 1),
        (-1, 0, -1),
    ]:
        assert scene.intersect(*rays, t_min=t_min, t_max=t_max).instance.tolist() == [instance]
        assert scene.occluded(*rays, t_min=t_min, t_max=t_max).tolist() == [instance >= 0]
    mesh = meshes.joined(meshes.sheets(1), meshes.sheets(1))
    mesh.vertices[3:, 2] = 1
    up = Rays(np.array([[0.25, 0.25, 2.0]]), np.array([[0, 0, 1.0]]))
    assert_scene_true(
        scene, [meshes.sheets(1)] * 2, np.array([moved(np.eye(3)), moved(np.eye(3), (0, 0, 1))]), up, -np.inf
    )


def test_invalid_rays_are_misses_and_counted():
    scene = bihtree.Scene([bihtree.Tree(*meshes.box())], [0], [np.eye(4)])
    bad = [([np.nan, 0, 0], DOWN), ([0, 0, np.inf], DOWN), ([0, 0, 5], [0, 0, 0]), ([0.5, 0.5, 5], DOWN)]
    hits = scene.intersect(*zip(*bad, strict=True))
    assert (hits.invalid, hits.hit.tolist()) == (3, [False, False, False, True])
    assert scene.occluded(*zip(*bad, strict=True)).tolist() == [False, False, False, True]


def test_matrices_are_set_without_building_a_tree():
    mesh = meshes.icosphere(2)
    tree = bihtree.Tree(*mesh)
    first, second = anywhere(30, np.random.default_rng(1)), anywhere(30, np.random.default_rng(2))
    scene = bihtree.Scene([tree], np.zeros(30, int), first)
    built = tree.stats.to_dict()
    rays = rays_at(flattened([mesh] * 3, second[:3]))
    before = scene.intersect(*rays)
    scene.set_matrices(second)
    fresh = bihtree.Scene([tree], np.zeros(30, int), second)
    assert_same(scene.intersect(*rays), fresh.intersect(*rays))
    assert scene.nodes().tobytes() == fresh.nodes().tobytes()
    assert scene.intersect(*rays).t.tobytes() != before.t.tobytes()
    assert tree.stats.to_dict() == built and scene.trees[0] is tree
    scene.set_matrices(first)
    assert_same(scene.intersect(*rays), before)


def test_a_wrong_matrix_changes_nothing():
    scene = bihtree.Scene([bihtree.Tree(*meshes.box())], [0, 0], [np.eye(4), moved(np.eye(3), (2, 0, 0))])
    bounds = scene.bounds.tolist()
    wrong = np.tile(np.eye(4), (2, 1, 1))
    wrong[1, 0, 2] = np.nan
    with pytest.raises(bihtree.GeometryError, match="matrices: row 1 holds NaN"):
        scene.set_matrices(wrong)
    with pytest.raises(bihtree.GeometryError, match="matrices: 1 rows, but instances has 2"):
        scene.set_matrices(wrong[:1])
    assert scene.bounds.tolist() == bounds
    assert np.allclose(bounds, [[0, 0, 0], [3, 1, 1]], atol=1e-6)


@pytest.mark.parametrize(
    ("trees", "instances", "matrices", "error", "text"),
    [
        ("bb", [0, 2], 2, bihtree.GeometryError, "instances: row 1 refers to tree 2, but there are 2 trees"),
        ("bb", [-1], 1, bihtree.GeometryError, "instances: row 0 refers to tree -1"),
        ("b", [0.0], 1, bihtree.GeometryError, r"instances: expected \(M,\) integers"),
        ("b", [[0]], 1, bihtree.GeometryError, r"instances: expected \(M,\) integers"),
        ("b", [2**64 - 1], 1, bihtree.GeometryError, "instances: row 0 refers to tree 18446744073709551615"),
        ("b", [0], 2, bihtree.GeometryError, "matrices: 2 rows, but instances has 1"),
        ("b", [0], np.eye(3)[None], bihtree.GeometryError, r"matrices: expected \(M, 4, 4\) real numbers"),
        ("b", [0], np.eye(4)[None].astype(complex), bihtree.GeometryError, "complex128"),
        ("b", [0], -np.eye(4)[None], bihtree.GeometryError, r"matrices: row 0 ends with \(-0, -0, -0, -1\)"),
        ("b", [0], np.full((1, 4, 4), np.inf), bihtree.GeometryError, "matrices: row 0 holds inf"),
        ("bn", [0], 1, TypeError, "trees: row 1 is a NoneType; expected a bihtree.Tree"),
        ("bf", [0], 1, ValueError, 'trees: row 1 has precision "fast", row 0 "watertight"'),
    ],
)
def test_what_is_wrong_is_named(trees, instances, matrices, error, text):
    kinds = {"b": bihtree.Tree(*meshes.box()), "n": None, "f": bihtree.Tree(*meshes.box(), precision="fast")}
    matrices = np.tile(np.eye(4), (matrices, 1, 1)) if isinstance(matrices, int) else matrices
    with pytest.raises(error, match=text):
        bihtree.Scene([kinds[letter] for letter in trees], instances, matrices)


def test_what_is_no_sequence_of_trees_and_other_arguments():
    with pytest.raises(TypeError, match="trees: expected a sequence"):
        bihtree.Scene(None, [], np.zeros((0, 4, 4)))
    with pytest.raises(ValueError, match="threads: -1 is below 0"):
        bihtree.Scene([], [], np.zeros((0, 4, 4)), threads=-1)
    with pytest.raises(TypeError, match="cannot be pickled"):
        pickle.dumps(bihtree.Scene([], [], np.zeros((0, 4, 4))))


def test_scenes_of_nothing():
    empty = bihtree.Tree(np.zeros((0, 3), np.float32))
    for scene in (
        bihtree.Scene([], [], np.zeros((0, 4, 4))),
        bihtree.Scene([empty], [0], [np.eye(4)]),
        bihtree.Scene([bihtree.Tree(*meshes.box())], [], np.zeros((0, 4, 4))),
    ):
        hits = scene.intersect([[0, 0, 5.0]], [DOWN])
        assert (hits.triangle.tolist(), hits.instance.tolist(), hits.t.tolist()) == ([-1], [-1], [np.inf])
        assert scene.bounds.tolist() == [[np.inf] * 3, [-np.inf] * 3]
        assert len(scene.nodes()) == 0
        assert [cost.tolist() for cost in scene.traversal_cost([[0, 0, 5.0]], [DOWN])] == [[0], [0]]
    assert len(scene.intersect(np.zeros((0, 3)), np.zeros((0, 3)))) == 0


def test_nodes_are_those_of_the_upper_tree():
    count = 40
    matrices = anywhere(count, np.random.default_rng(3))
    mesh = meshes.box()
    scene = bihtree.Scene([bihtree.Tree(*mesh)], np.zeros(count, int), matrices)
    nodes = scene.nodes()
    leaves = nodes[nodes["kind"] == 1]
    assert leaves["count"].tolist() == [1] * count and len(nodes) == 2 * count - 1
    assert sorted(leaves["first"]) == list(range(count))
    assert np.array_equal(nodes["lower"][0], scene.bounds[0]) and np.array_equal(nodes["upper"][0], scene.bounds[1])
    points = flattened([mesh] * count, matrices).vertices
    assert (scene.bounds[0] <= points.min(axis=0)).all() and (points.max(axis=0) <= scene.bounds[1]).all()
    assert np.allclose(scene.bounds, [points.min(axis=0), points.max(axis=0)], rtol=1e-5)
    assert len(scene.nodes(max_depth=1)) == 3 and len(scene.nodes(limit=5)) == 5
    stats = scene.stats
    assert (stats.triangles, stats.references, stats.rejected, stats.leaves) == (12 * count, count, 0, count)
    assert 0 < stats.tree_bytes <= stats.bound_bytes


def test_only_what_a_ray_comes_near_to_is_visited():
    count = 1000
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, 0, 3] = 3 * np.arange(count)
    tree = bihtree.Tree(*meshes.icosphere(3))
    scene = bihtree.Scene([tree], np.zeros(count, int), matrices)
    across = scene.traversal_cost([[1500.25, 0.1, 9]], [DOWN])
    alone = tree.traversal_cost([[0.25, 0.1, 9]], [DOWN])
    assert alone[0][0] < across[0][0] <= alone[0][0] + 20
    # Along the row the nearest sphere hides the others.
    along = scene.traversal_cost([[-9.0, 0.1, 0.1]], [[1.0, 0, 0]])
    assert along[1][0] < 100 and scene.intersect([[-9.0, 0.1, 0.1]], [[1.0, 0, 0]]).instance[0] == 0


def test_memory_does_not_grow_with_what_is_shared():
    """A thousand instances of one mesh: some hundred bytes each, and the mesh once."""
    tree = bihtree.Tree(*meshes.icosphere(5))
    bytes_of = {
        count: bihtree.Scene([tree], np.zeros(count, int), anywhere(count, np.random.default_rng(1))).stats.tree_bytes
        for count in (1, 1000, 2000)
    }
    assert (bytes_of[2000] - bytes_of[1000]) / 1000 < 350 < tree.stats.tree_bytes / 1000


def test_the_same_bits_for_any_number_of_threads():
    rows, matrices = np.arange(200) % 4, anywhere(200, np.random.default_rng(5), 8.0)
    trees = [bihtree.Tree(*mesh) for mesh in SHOWN]
    rays = rays_at(meshes.Triangles(np.array([[-8, -8, -8], [8, 8, 8.0]]), np.array([[0, 1, 0]])), 2000)
    one, many = (bihtree.Scene(trees, rows, matrices, threads=threads) for threads in (1, 3))
    assert_same(one.intersect(*rays), many.intersect(*rays))
    assert one.nodes().tobytes() == many.nodes().tobytes()
    assert [a.tobytes() for a in one.traversal_cost(*rays)] == [a.tobytes() for a in many.traversal_cost(*rays)]


def test_queries_go_on_while_matrices_are_set():
    mesh = meshes.icosphere(2)
    first, second = anywhere(50, np.random.default_rng(1)), anywhere(50, np.random.default_rng(2))
    scene = bihtree.Scene([bihtree.Tree(*mesh)], np.zeros(50, int), first)
    rays = rays_at(flattened([mesh] * 2, first[:2]), 300)
    expected = {scene.intersect(*rays).t.tobytes()}
    scene.set_matrices(second)
    expected.add(scene.intersect(*rays).t.tobytes())
    found = []
    threads = [threading.Thread(target=lambda: found.append(scene.intersect(*rays).t.tobytes())) for _ in range(8)]
    for number, thread in enumerate(threads):
        thread.start()
        scene.set_matrices((first, second)[number % 2])
    for thread in threads:
        thread.join()
    assert len(found) == 8 and set(found) <= expected


def test_a_scene_keeps_its_trees():
    scene = bihtree.Scene([bihtree.Tree(*meshes.box())], [0], [np.eye(4)])
    gc.collect()
    assert scene.intersect([[0.5, 0.25, 5]], [DOWN]).t.tolist() == [4]
    assert scene.trees[0].stats.triangles == 12


def test_parallel_rays_along_axes_of_turned_instances():
    """Components of directions that are zero, and such as the inverse makes nearly zero."""
    matrices = np.array(
        [
            moved([[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
            moved(np.round(anywhere(1, np.random.default_rng(4))[0, :3, :3]) + 3 * np.eye(3), (4, 0, 0)),
        ]
    )
    mesh = meshes.grid(4, 4)
    scene = bihtree.Scene([bihtree.Tree(*mesh)], [0, 0], matrices)
    world = flattened([mesh] * 2, matrices)
    for axis in range(3):
        assert_scene_true(scene, [mesh] * 2, matrices, parallel(world, 9, 9, axis))


def test_rows_of_the_answers_are_those_of_the_instances():
    rows, matrices = np.array([3, 0, 3]), anywhere(3, np.random.default_rng(7))
    scene = bihtree.Scene([bihtree.Tree(*mesh) for mesh in SHOWN], rows, matrices)
    shown = [SHOWN[row] for row in rows]
    world = flattened(shown, matrices)
    rays = rays_at(world, 300)
    hits = as_one_mesh(scene.intersect(*rays), shown)
    alone = bihtree.Tree(*world).intersect(*rays)
    assert np.array_equal(hits.triangle, alone.triangle)
    assert np.allclose(hits.t, alone.t, rtol=1e-6) and len(set(scene.intersect(*rays).instance)) == 4
