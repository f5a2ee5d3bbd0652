"""Same bits for any number of threads, the tree's own or the caller's."""

import threading
from concurrent.futures import ThreadPoolExecutor

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_same
from tests.rays import around, at_features, joined
from tests.variants import every_tree


def many_rays(mesh):
    rng = np.random.default_rng(1)
    return joined(around(mesh, 3000, rng), at_features(mesh, 3000, rng))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_same_bits_for_any_number(dtype):
    mesh = meshes.joined(meshes.gears(6, 30), meshes.gears(6, 30)).astype(dtype)
    rays = many_rays(mesh)
    one = bihtree.Tree(*mesh, threads=1)
    for threads in (0, 2, 3, 16):
        other = bihtree.Tree(*mesh, threads=threads)
        assert_same(one.intersect(*rays), other.intersect(*rays))
        assert np.array_equal(one.occluded(*rays), other.occluded(*rays))
        assert np.array_equal(one.traversal_cost(*rays), other.traversal_cost(*rays))


@every_tree
def test_several_python_threads_on_one_tree(variant):
    mesh = meshes.terrain(80)
    tree = variant.tree(*mesh)
    rays = many_rays(mesh)
    expected = tree.intersect(*rays)
    occluded = tree.occluded(*rays)
    start = threading.Barrier(6)

    def work(number):
        start.wait()
        return tree.occluded(*rays) if number % 3 == 2 else tree.intersect(*rays)

    with ThreadPoolExecutor(6) as pool:
        for number, answer in enumerate(pool.map(work, range(6))):
            if number % 3 == 2:
                assert np.array_equal(answer, occluded)
            else:
                assert_same(answer, expected)


def test_several_python_threads_build_at_once():
    mesh = meshes.terrain(80)
    with ThreadPoolExecutor(4) as pool:
        tables = list(pool.map(lambda _: bihtree.Tree(*mesh).nodes().tobytes(), range(8)))
    assert len(set(tables)) == 1


def test_other_python_threads_run_during_a_query():
    """The interpreter is handed over only by a query that releases it: the switch interval is longer than the test."""
    import sys

    sheets = meshes.sheets(1)
    tree = bihtree.Tree(sheets.vertices, np.repeat(sheets.triangles, 20_000, axis=0), threads=1)
    origins, directions = np.tile([0.75, 0.75, 1.0], (5000, 1)), np.tile([0, 0, -1.0], (5000, 1))
    asked, answered, seen = threading.Event(), threading.Event(), []

    def watch():
        asked.wait()
        seen.append(answered.is_set())

    watcher = threading.Thread(target=watch)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        watcher.start()
        asked.set()
        tree.intersect(origins, directions)
        answered.set()
        watcher.join()
    finally:
        sys.setswitchinterval(interval)
    assert seen == [False]
