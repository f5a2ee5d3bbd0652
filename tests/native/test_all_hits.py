"""intersect_all and count: every hit is the oracle's, in its order; crossings are those of a ray moved by an ε."""

import os
import subprocess
import sys
from pathlib import Path

import bihtree
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests import meshes, parity
from tests import rays as make
from tests.agreement import distance_error, promise, weight_error
from tests.oracle import Oracle
from tests.variants import FAST_VARIANTS, VARIANTS, every_fast_tree, every_tree

EXAMPLES = int(os.environ.get("BIHTREE_EXAMPLES", "40"))
ROOT = Path(__file__).resolve().parents[2]

NAMES = ("offsets", "t", "triangle", "u", "v", "instance")


def lists(found):
    """The rows of each ray."""
    return [found.triangle[start:end].tolist() for start, end in zip(found.offsets, found.offsets[1:], strict=False)]


def assert_lists(tree, mesh, origins, directions, t_min=0.0, t_max=np.inf):
    """All hits and the number of crossings are the oracle's."""
    found = tree.intersect_all(origins, directions, t_min=t_min, t_max=t_max)
    truth = list(Oracle(*mesh).crossings(origins, directions, t_min, t_max))
    assert lists(found) == [[hit.triangle for hit in hits] for hits in truth]
    promised = promise(tree.stats.precision, found.t.dtype)
    for place, hit in enumerate(hit for hits in truth for hit in hits):
        assert distance_error(found.t[place], hit.t, promised) <= 1
        assert weight_error(found.u[place], hit.u, promised) <= 1
        assert weight_error(found.v[place], hit.v, promised) <= 1
    crossings = tree.count(origins, directions, t_min=t_min, t_max=t_max)
    assert crossings.dtype == np.int32
    assert crossings.tolist() == list(parity.counts(mesh, origins, directions, t_min, t_max))
    return found


def assert_same_lists(a, b):
    for name in NAMES:
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name


coordinate = st.integers(-2, 2)
point = st.tuples(coordinate, coordinate, coordinate)
limit = st.one_of(st.sampled_from([-np.inf, np.inf, np.nan]), st.integers(-8, 8).map(lambda i: i / 2))
ray = st.tuples(point, point, st.one_of(st.just(0.0), limit), st.one_of(st.just(np.inf), limit))


@settings(max_examples=EXAMPLES, deadline=None, derandomize=True)
@given(
    triangles=st.lists(st.tuples(point, point, point), min_size=1, max_size=10),
    rays=st.lists(ray, min_size=1, max_size=8),
    dtype=st.sampled_from([np.float32, np.float64]),
)
def test_any_mesh_any_rays_any_limits(triangles, rays, dtype):
    mesh = meshes.from_corners(triangles, dtype)
    origins, directions, t_min, t_max = (np.array(part, np.float64) for part in zip(*rays, strict=True))
    crossings = VARIANTS[0].tree(*mesh).count(origins, directions, t_min=t_min, t_max=t_max)
    expected = {}
    for variant in VARIANTS + FAST_VARIANTS:
        tree = variant.tree(*mesh)
        assert np.array_equal(crossings, tree.count(origins, directions, t_min=t_min, t_max=t_max))
        precision = tree.stats.precision
        if precision in expected:
            assert_same_lists(expected[precision], tree.intersect_all(origins, directions, t_min=t_min, t_max=t_max))
        elif precision != "fast":
            expected[precision] = assert_lists(tree, mesh, origins, directions, t_min, t_max)


@every_tree
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_rays_at_vertices_edges_and_insides(variant, dtype):
    mesh = meshes.joined(meshes.icosphere(1), meshes.soup(150, 0.6), meshes.box()).astype(dtype)
    rng = np.random.default_rng(1)
    rays = make.joined(make.around(mesh, 60, rng), make.at_features(mesh, 90, rng))
    tree = variant.tree(*mesh)
    found = assert_lists(tree, mesh, *rays)
    expected = np.float64 if tree.stats.precision == "exact" else dtype
    assert found.t.dtype == found.u.dtype == found.v.dtype == expected
    assert found.offsets.dtype == np.int64 and found.triangle.dtype == found.instance.dtype == np.int32
    assert len(found) == 150 and len(found.offsets) == 151 and found.offsets[-1] == len(found.triangle) > 400
    assert not found.instance.any()


@every_tree
def test_axis_parallel_rays_on_a_grid(variant):
    """Each meets a vertex, an edge or a diagonal: all triangles there are hit, and the surface is crossed once."""
    mesh = meshes.grid(4, 4)
    tree = variant.tree(*mesh)
    y, x = np.mgrid[0:9, 0:9] / 2
    origins = np.stack([x.ravel(), y.ravel(), np.ones(81)], axis=1)
    down = np.tile([0.0, -0.0, -1.0], (81, 1))
    found = assert_lists(tree, mesh, origins, down)
    hits = np.diff(found.offsets).reshape(9, 9)
    assert hits[2, 2] == 6 and hits[2, 3] == 2 and hits[3, 3] == 2 and hits.min() >= 1
    crossings = tree.count(origins, down).reshape(9, 9)
    assert (crossings[:8, :8] == 1).all() and not crossings[8].any() and not crossings[:, 8].any()
    assert np.array_equal(tree.count(origins, -down, t_min=-np.inf), crossings.ravel())
    assert not tree.count(origins, np.tile([1.0, 0, 0], (81, 1))).any()
    inside = tree.intersect_all(origins - [0, 0, 1], np.tile([1.0, 0, 0], (81, 1)))
    assert len(inside.triangle) == 0 and inside.offsets.tolist() == [0] * 82


@every_tree
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_closed_mesh_is_crossed_an_even_number_of_times(variant, dtype):
    mesh = meshes.icosphere(2).astype(dtype)
    tree = variant.tree(*mesh)
    rng = np.random.default_rng(2)
    origins, directions = make.joined(make.at_features(mesh, 300, rng, dtype), make.around(mesh, 100, rng, dtype))
    assert not (tree.count(origins, directions) % 2).any()
    # From a point inside: odd in any direction.
    aims = mesh.vertices[rng.integers(0, len(mesh.vertices), 200)]
    start = np.full_like(aims, 0.125)
    assert (tree.count(start, aims - start) == 1).all()


@every_tree
def test_the_first_is_the_nearest(variant):
    mesh = meshes.joined(meshes.gears(4, 20), meshes.gears(4, 20))
    rng = np.random.default_rng(3)
    rays = make.joined(make.around(mesh, 200, rng), make.at_features(mesh, 200, rng))
    tree = variant.tree(*mesh)
    hits, every = tree.intersect(*rays), tree.intersect_all(*rays)
    assert np.array_equal(np.diff(every.offsets) > 0, hits.hit)
    first = every.offsets[:-1][hits.hit]
    for name in ("t", "triangle", "u", "v"):
        assert np.array_equal(getattr(every, name)[first], getattr(hits, name)[hits.hit]), name
    for most in (1, 2, 3, 5, 1000):
        some = tree.intersect_all(*rays, max_hits=most)
        assert lists(some) == [rows[:most] for rows in lists(every)]
        starts = zip(every.offsets, lists(some), strict=False)
        keep = [start + place for start, rows in starts for place in range(len(rows))]
        assert np.array_equal(some.t, every.t[keep]), most


@every_fast_tree
def test_fast(variant):
    """In order, no row twice; the first is the nearest; crossings are exact all the same."""
    mesh = meshes.joined(meshes.soup(400, 0.5), meshes.box())
    rng = np.random.default_rng(4)
    rays = make.joined(make.around(mesh, 200, rng), make.at_features(mesh, 100, rng))
    tree, exact = variant.tree(*mesh), bihtree.Tree(*mesh)
    found, expected = tree.intersect_all(*rays), exact.intersect_all(*rays)
    assert found.t.dtype == np.float32
    same = [set(a) == set(b) for a, b in zip(lists(found), lists(expected), strict=True)]
    assert np.mean(same[:200]) > 0.95
    for start, end in zip(found.offsets, found.offsets[1:], strict=False):
        t, rows = found.t[start:end], found.triangle[start:end]
        assert len(set(rows)) == len(rows)
        assert sorted(zip(t.tolist(), rows.tolist(), strict=True)) == list(zip(t.tolist(), rows.tolist(), strict=True))
    hits = tree.intersect(*rays)
    first = found.offsets[:-1][hits.hit]
    if variant.layout != "classic":
        assert np.array_equal(found.triangle[first], hits.triangle[hits.hit])
    assert lists(tree.intersect_all(*rays, max_hits=2)) == [rows[:2] for rows in lists(found)]
    assert np.array_equal(tree.count(*rays), exact.count(*rays))


@every_tree
def test_coincident_triangles_in_the_order_of_rows(variant):
    """Also such as are the same only in fact: their corners begin elsewhere."""
    corners = np.array([[0, 0, 0.1], [1.3, 0, 0.7], [0, 1.7, 0.3]], np.float32)
    turned = [np.roll(corners, shift, axis=0)[::step] for shift in range(3) for step in (1, -1)]
    mesh = meshes.from_corners(np.stack(turned * 20))
    tree = variant.tree(*mesh)
    origins, directions = np.float32([[0.3, 0.4, 5], [0.2, 0.7, -3]]), np.float32([[0.01, 0.02, -1], [0, 0.03, 1]])
    assert lists(assert_lists(tree, mesh, origins, directions)) == [list(range(120))] * 2
    assert lists(tree.intersect_all(origins, directions, max_hits=7)) == [list(range(7))] * 2
    assert tree.count(origins, directions).tolist() == [120, 120]


def test_a_million_coincident_triangles():
    mesh = meshes.sheets(1)
    tree = bihtree.Tree(mesh.vertices, np.repeat(mesh.triangles, 1_000_000, axis=0))
    ray = ([[0.25, 0.25, 1], [2, 2, 1]], [[0, 0, -1.0]] * 2)
    found = tree.intersect_all(*ray)
    assert found.offsets.tolist() == [0, 1_000_000, 1_000_000]
    assert np.array_equal(found.triangle, np.arange(1_000_000)) and (found.t == 1).all()
    for most in (1, 2, 3):
        assert tree.intersect_all(*ray, max_hits=most).triangle.tolist() == list(range(most))
    assert tree.count(*ray).tolist() == [1_000_000, 0]


@every_tree
def test_ends_are_hit(variant):
    """t_min and t_max themselves count, for hits and for crossings, also at a shared edge."""
    mesh = meshes.box()
    tree = variant.tree(*mesh)
    for x, y in ((0.25, 0.5), (0.5, 0.5), (0, 0)):
        for t_min, t_max, expected in ((0, 1, 1), (1, 2, 2), (np.nextafter(1, 2), 2, 1), (1, 1, 1), (1.25, 1.75, 0)):
            origins, directions = [[x, y, -1.0]], [[0, 0, 1.0]]
            assert tree.count(origins, directions, t_min=t_min, t_max=t_max).tolist() == [expected]
            assert_lists(tree, mesh, origins, directions, t_min, t_max)
    assert tree.count([[0.5, 0.5, 0.0]], [[0, 0, 1.0]]).tolist() == [2]


@every_tree
def test_invalid_rays_hit_and_cross_nothing(variant):
    nan, inf = np.nan, np.inf
    tree = variant.tree(*meshes.box())
    origins = [[0.5, 0.5, -1]] * 5 + [[nan, 0, 0], [inf, 0, 0]]
    directions = [[0, 0, 1], [0, 0, 0], [nan, 0, 1], [inf, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1]]
    t_min = [0, 0, 0, 0, inf, 0, 0]
    assert np.diff(tree.intersect_all(origins, directions, t_min=t_min).offsets).tolist() == [4, 0, 0, 0, 0, 0, 0]
    assert tree.count(origins, directions, t_min=t_min).tolist() == [2, 0, 0, 0, 0, 0, 0]


@every_tree
def test_no_rays_and_no_triangles(variant):
    none = np.zeros((0, 3))
    for tree in (variant.tree(*meshes.box()), variant.tree(none), variant.tree([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]])):
        found = tree.intersect_all(none, none)
        assert len(found) == 0 and found.offsets.tolist() == [0] and found.t.shape == (0,)
        assert tree.count(none, none).shape == (0,)
    empty = variant.tree(none)
    assert empty.intersect_all([[0, 0, 0]], [[0, 0, 1]]).offsets.tolist() == [0, 0]
    assert empty.count([[0, 0, 0]], [[0, 0, 1]]).tolist() == [0]


@every_tree
def test_rejected_triangles_are_not_hit(variant):
    corners = [
        [[0, 0, 0], [4, 0, 0], [0, 4, 0]],
        [[0, 0, np.nan], [4, 0, 0], [0, 4, 0]],
        [[0, 0, 1], [2, 2, 1], [4, 4, 1]],
        [[0, 0, 2], [4, 0, 2], [0, 4, 2]],
    ]
    tree = variant.tree(*meshes.from_corners(corners))
    ray = ([[1, 1, 5.0]], [[0, 0, -1.0]])
    assert tree.intersect_all(*ray).triangle.tolist() == [3, 0]
    assert tree.count(*ray).tolist() == [2]


@pytest.mark.parametrize("threads", [1, 4])
def test_same_bits_for_any_number_of_threads(threads):
    mesh = meshes.gears(6, 30)
    rng = np.random.default_rng(5)
    rays = make.joined(make.around(mesh, 1500, rng), make.at_features(mesh, 1500, rng))
    one, other = bihtree.Tree(*mesh, threads=3), bihtree.Tree(*mesh, threads=threads, build="on_demand")
    assert_same_lists(one.intersect_all(*rays), other.intersect_all(*rays))
    assert np.array_equal(one.count(*rays), bihtree.Tree(*mesh, threads=threads, build="on_demand").count(*rays))


def test_bad_arguments():
    tree = bihtree.Tree(*meshes.box())
    origins, directions = np.zeros((4, 3)), np.ones((4, 3))
    for query in (tree.intersect_all, tree.count):
        with pytest.raises(bihtree.GeometryError, match="origins"):
            query(np.zeros((4, 2)), directions)
        with pytest.raises(bihtree.GeometryError, match="directions"):
            query(origins, np.full((4, 3), None))
        with pytest.raises(bihtree.GeometryError, match=r"directions.*\b3\b.*\b4\b"):
            query(origins, directions[:3])
        with pytest.raises(bihtree.GeometryError, match=r"t_max"):
            query(origins, directions, t_max=[1.0, 2.0])
        with pytest.raises(TypeError):
            query(origins, directions, 0.0)
    for most in (0, -1, -(2**40)):
        with pytest.raises(ValueError, match=rf"max_hits: {most}\b"):
            tree.intersect_all(origins, directions, max_hits=most)
    with pytest.raises(TypeError, match="max_hits"):
        tree.intersect_all(origins, directions, max_hits="many")
    assert len(tree.intersect_all(origins, directions, max_hits=np.int64(2))) == 4


INTERRUPTED = """
import os, signal, threading
import bihtree
from tests import meshes

mesh = meshes.sheets(1)
tree = bihtree.Tree(mesh.vertices, mesh.triangles.repeat(1_000_000, axis=0), threads=2)
ray = [[[0.25, 0.25, -1.0]] * 5000, [[0.0, 0.0, 1.0]] * 5000]
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    tree.{call}
except KeyboardInterrupt:
    print("stopped")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
@pytest.mark.parametrize("call", ["intersect_all(*ray, max_hits=2)", "count(*ray)", "contains(ray[0])"])
def test_control_c(call):
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED.format(call=call)], cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    assert done.stdout == "stopped\n", done.stderr
