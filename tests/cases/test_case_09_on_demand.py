"""Case 9: 64 threads on a tree built on demand, from the first ray: the bits of the eager one, and nothing twice."""

import threading
from concurrent.futures import ThreadPoolExecutor

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_same
from tests.many_rays import assert_many_true, at_weak_places
from tests.rays import around, at_features, joined
from tests.variants import every_tree_of_many_rays

MESH = meshes.joined(meshes.gears(9, 60), meshes.terrain(60))
OPTIONS = [
    {"layout": layout, "heuristic": heuristic, "precision": precision}
    for layout in ("wide", "compact", "classic")
    for heuristic in ("global", "local", "sah")
    for precision in ("watertight", "fast")
]
every_option = pytest.mark.parametrize("options", OPTIONS, ids=lambda options: "-".join(options.values()))


def rays(count=1500, seed=1):
    rng = np.random.default_rng(seed)
    return joined(around(MESH, count, rng), at_features(MESH, count, rng))


def camera(tree, width=64, height=48):
    """The whole of the mesh, orthographic, along z."""
    (low, high), size = tree.bounds.astype(float), np.eye(4)
    size[:3, :3] = np.diag((high - low) * [0.6, 0.6, -2.0])
    size[:3, 3] = (low + high) / 2
    return bihtree.Camera(size, width, height)


@every_option
def test_every_answer_is_the_eager_ones(options):
    eager, lazy = bihtree.Tree(*MESH, **options), bihtree.Tree(*MESH, build="on_demand", **options)
    before = lazy.stats
    assert before.build == "on_demand" and before.unbuilt > 5 and before.leaves == 0
    picture = {"passes": ["combined", "depth", "normal", "triangle", "cost"], "samples": 2}
    expected = bihtree.render(eager, camera(eager), **picture)
    for name, answer in bihtree.render(lazy, camera(lazy), **picture).items():
        assert answer.tobytes() == expected[name].tobytes(), name
    assert lazy.stats.unbuilt < before.unbuilt
    some = rays()
    assert_same(lazy.intersect(*some), eager.intersect(*some))
    assert np.array_equal(lazy.occluded(*some), eager.occluded(*some))
    assert np.array_equal(lazy.traversal_cost(*some), eager.traversal_cost(*some))
    lazy.validate()
    lazy.build_all()
    assert lazy.nodes().tobytes() == eager.nodes().tobytes()
    assert lazy.order().tobytes() == eager.order().tobytes()


@every_option
def test_64_threads_from_the_first_ray(options):
    eager = bihtree.Tree(*MESH, **options)
    some = rays(300)
    hits, hidden = eager.intersect(*some), eager.occluded(*some)
    lazy = bihtree.Tree(*MESH, build="on_demand", threads=64, **options)
    pieces = lazy.stats.unbuilt
    start = threading.Barrier(8)

    def work(number):
        start.wait()
        if number == 7:
            lazy.validate()
            return np.sort(lazy.order())
        return lazy.occluded(*some) if number % 2 else lazy.intersect(*some)

    with ThreadPoolExecutor(8) as pool:
        for number, answer in enumerate(pool.map(work, range(8))):
            if number == 7:
                assert np.array_equal(answer, np.arange(len(MESH.triangles)))
            elif number % 2:
                assert np.array_equal(answer, hidden)
            else:
                assert_same(answer, hits)
    lazy.build_all()
    # What had been built twice would be counted twice.
    stats, expected = lazy.stats, eager.stats
    assert pieces > 0 and stats.unbuilt == 0
    assert (stats.nodes, stats.leaves, stats.depth) == (expected.nodes, expected.leaves, expected.depth)


@pytest.mark.parametrize("layout", ["wide", "compact", "classic"])
def test_what_no_ray_came_to_is_unbuilt_and_shown_so(layout):
    tree = bihtree.Tree(*MESH, layout=layout, build="on_demand")
    eager = bihtree.Tree(*MESH, layout=layout).nodes()
    sizes = [tree.stats.tree_bytes]
    for count in (0, 1, 50, 3000):
        tree.intersect(*(part[:count] for part in rays()))
        stats, table = tree.stats, tree.nodes()
        unbuilt = table["kind"] == 2
        assert unbuilt.sum() == stats.unbuilt and (table["kind"] == 1).sum() == stats.leaves
        assert (table["axis"][unbuilt] == -1).all() and np.isnan(table["clip"][unbuilt]).all()
        assert not np.isin(table["parent"][1:], np.flatnonzero(unbuilt)).any()
        assert table["count"][unbuilt].sum() + table["count"][table["kind"] == 1].sum() == stats.triangles
        assert set(table[["depth", "first", "count"]].tolist()) <= set(eager[["depth", "first", "count"]].tolist())
        assert np.array_equal(np.sort(tree.order()), np.arange(stats.triangles))
        assert stats.tree_bytes <= stats.bound_bytes and stats.peak_build_bytes >= stats.tree_bytes
        sizes.append(stats.tree_bytes)
    assert sizes[0] == sizes[1] < sizes[2] < sizes[3] <= sizes[4]


@pytest.mark.parametrize("options", OPTIONS[:6], ids=lambda options: "-".join(options.values()))
def test_vertices_are_copied_where_a_ray_comes_again(options):
    eager, tree = (bihtree.Tree(*MESH, build=build, **options) for build in ("eager", "on_demand"))
    tree.build_all()
    some, sizes = rays(20), []
    for _ in range(4):
        sizes.append(tree.stats.tree_bytes)
        assert_same(tree.intersect(*some), eager.intersect(*some))
        tree.validate()
    assert sizes[0] <= sizes[1] < sizes[2] == sizes[3] < eager.stats.tree_bytes


def test_where_there_is_no_room_for_copies_the_answers_stay():
    """Leaves of one triangle take more room than there is; the bound is kept."""
    options = {"layout": "wide", "leaf_size": 1}
    eager, tree = bihtree.Tree(*MESH, **options), bihtree.Tree(*MESH, build="on_demand", **options)
    corners = MESH.vertices[MESH.triangles].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    many = corners.mean(axis=1) + normals, -normals
    for _ in range(3):
        assert_same(tree.intersect(*many), eager.intersect(*many))
    stats = tree.stats
    tree.intersect(*many)
    assert eager.stats.tree_bytes < stats.tree_bytes == tree.stats.tree_bytes <= stats.bound_bytes


def test_the_first_picture_takes_less_than_half_the_memory():
    """All of a fine mesh in view, from one side, and about a pixel for each triangle that is seen."""
    mesh = meshes.icosphere(6)
    eager, tree = bihtree.Tree(*mesh), bihtree.Tree(*mesh, build="on_demand")
    picture = {"passes": ["combined"], "shadows": False}
    first, expected = (bihtree.render(one, camera(one, 256, 192), **picture)["combined"] for one in (tree, eager))
    assert tree.stats.tree_bytes < 0.5 * eager.stats.tree_bytes
    assert first.tobytes() == expected.tobytes()


def test_build_seconds_grow_with_what_is_built():
    tree = bihtree.Tree(*MESH, layout="wide", build="on_demand")
    before = tree.stats.build_seconds
    tree.build_all()
    after = tree.stats.build_seconds
    assert 0 < before < after
    tree.build_all()
    assert tree.stats.build_seconds == after


def test_a_cancelled_picture_leaves_a_usable_tree():
    eager, tree = (bihtree.Tree(*MESH, layout="wide", build=build) for build in ("eager", "on_demand"))
    with pytest.raises(bihtree.Cancelled):
        bihtree.render(tree, camera(tree, 2000, 2000), progress=lambda share: share == 0)
    tree.validate()
    some = rays(500)
    assert_same(tree.intersect(*some), eager.intersect(*some))


def test_a_small_mesh_is_finished_at_once_and_says_so():
    stats = bihtree.Tree(*meshes.soup(100), build="on_demand").stats
    assert (stats.build, stats.unbuilt) == ("on_demand", 0)
    assert stats.left_out["unbuilt nodes"] == "1024 triangles or fewer are finished at once"
    assert "unbuilt nodes" not in bihtree.Tree(*MESH, build="on_demand").stats.left_out


def test_an_eager_tree_has_nothing_left_to_build():
    tree = bihtree.Tree(*MESH)
    before = tree.stats.to_dict()
    tree.build_all()
    assert tree.stats.to_dict() == before and before["unbuilt"] == 0


@every_tree_of_many_rays
def test_a_hundred_thousand_rays(variant):
    """More triangles than are finished at once; where a tree is built on demand, the rays build it."""
    mesh = meshes.joined(meshes.gears(5, 20), meshes.terrain(13))
    assert len(mesh.triangles) > 1024
    tree = assert_many_true(variant, mesh, at_weak_places(mesh))
    assert tree.stats.unbuilt == 0 or tree.stats.build == "on_demand"
