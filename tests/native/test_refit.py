"""refit: the same triangles over vertices that moved give the hits of a fresh tree, whatever the tree is."""

import threading

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_same, assert_true
from tests.instances import moved
from tests.rays import around, at_features, joined
from tests.variants import FAST_VARIANTS, VARIANTS

REFITTED = tuple(
    variant
    for variant in VARIANTS + FAST_VARIANTS
    if variant.structure != "kd_tree" and variant.options.get("build") != "on_demand"
)
OTHERS = tuple(variant for variant in VARIANTS + FAST_VARIANTS if variant not in REFITTED)


def bent(mesh, amount=0.5, seed=1):
    """The same triangles with every vertex moved."""
    rng = np.random.default_rng(seed)
    points = mesh.vertices.astype(np.float64)
    wave = np.sin(3 * points[:, [1, 2, 0]]) + 0.1 * rng.normal(size=points.shape)
    return meshes.Triangles((points + amount * wave).astype(mesh.vertices.dtype), mesh.triangles)


def rays_at(mesh):
    rng = np.random.default_rng(2)
    return joined(around(mesh, 60, rng), at_features(mesh, 60, rng))


@pytest.mark.parametrize("variant", REFITTED, ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_hits_are_those_of_a_fresh_tree(variant, dtype):
    for mesh in (meshes.terrain(12, dtype=dtype), meshes.box(dtype=dtype), meshes.soup(200, 0.3, dtype=dtype)):
        tree, after = variant.tree(*mesh), bent(mesh)
        nodes = tree.stats.nodes
        tree.refit(after.vertices)
        tree.validate()
        rays = rays_at(after)
        if variant.precision == "fast":
            fresh, found = variant.tree(*after).intersect(*rays), tree.intersect(*rays)
            assert np.mean(fresh.triangle == found.triangle) > 0.98
        else:
            assert_true(tree, after, *rays)
        assert tree.bounds.tolist() == variant.tree(*after).bounds.tolist()
        assert tree.stats.nodes == nodes


@pytest.mark.parametrize("variant", OTHERS, ids=str)
def test_trees_that_cannot_be_refitted_say_so(variant):
    mesh = meshes.terrain(12)
    tree = variant.tree(*mesh)
    with pytest.raises(ValueError, match=r"refit.*build it again"):
        tree.refit(bent(mesh).vertices)
    assert_true(tree, mesh, *rays_at(mesh)) if variant.precision != "fast" else tree.validate()


@pytest.mark.parametrize(
    "vertices",
    [np.zeros((3, 3), np.float32), np.zeros((8, 3)), np.zeros((8, 2), np.float32), np.zeros((8, 3), np.int32), "a"],
    ids=["rows", "dtype", "columns", "integers", "text"],
)
def test_what_does_not_fit_changes_nothing(vertices):
    mesh = meshes.box()
    tree = bihtree.Tree(*mesh)
    before = tree.nodes().tobytes()
    with pytest.raises(bihtree.GeometryError, match=r"vertices: expected \(8, 3\) float32"):
        tree.refit(vertices)
    assert tree.nodes().tobytes() == before
    assert tree.intersect([[0.5, 0.25, 5]], [[0, 0, -1.0]]).t.tolist() == [4]


def test_triangles_that_gain_or_lose_their_area_or_are_not_finite():
    mesh = meshes.terrain(6)
    flat = mesh.vertices.copy()
    flat[mesh.triangles[7]] = flat[mesh.triangles[7][0]]
    broken = mesh.vertices.copy()
    broken[11, 1] = np.nan
    tree = bihtree.Tree(flat, mesh.triangles)
    rejected = tree.stats.rejected
    assert rejected
    for vertices in (mesh.vertices, broken, flat, mesh.vertices):
        tree.refit(vertices)
        tree.validate()
        after = meshes.Triangles(vertices, mesh.triangles)
        assert_true(tree, after, *rays_at(mesh))
        assert tree.stats.rejected == bihtree.Tree(*after).stats.rejected


def test_the_array_stays_the_callers():
    mesh = meshes.box()
    tree = bihtree.Tree(mesh.vertices.copy(), mesh.triangles, copy=False)
    vertices = mesh.vertices + np.float32(1)
    tree.refit(vertices)
    vertices[:] = 9
    assert tree.intersect([[1.5, 1.25, 5]], [[0, 0, -1.0]]).t.tolist() == [3]
    assert tree.stats.mesh_bytes == mesh.vertices.nbytes
    copied = bihtree.Tree(*mesh)
    size = copied.stats.mesh_bytes
    copied.refit(mesh.vertices)
    assert copied.stats.mesh_bytes == size == mesh.vertices.nbytes + mesh.triangles.nbytes


def test_a_loaded_tree_and_a_soup(tmp_path):
    mesh = meshes.terrain(8)
    bihtree.Tree(*mesh).save(tmp_path / "a.bih")
    tree = bihtree.Tree.load(tmp_path / "a.bih")
    after = bent(mesh)
    tree.refit(after.vertices)
    assert_true(tree, after, *rays_at(after))
    soup = bihtree.Tree(mesh.corners().reshape(-1, 3))
    soup.refit(after.corners().reshape(-1, 3))
    assert_same(soup.intersect(*rays_at(after)), tree.intersect(*rays_at(after)))
    soup.save(tmp_path / "b.bih")
    assert_same(bihtree.Tree.load(tmp_path / "b.bih").intersect(*rays_at(after)), tree.intersect(*rays_at(after)))


def test_queries_go_on_while_vertices_move():
    mesh = meshes.terrain(20)
    shapes = [mesh, bent(mesh)]
    rays = rays_at(mesh)
    expected = {bihtree.Tree(*shape).intersect(*rays).t.tobytes() for shape in shapes}
    tree, found = bihtree.Tree(*mesh), []
    threads = [threading.Thread(target=lambda: found.append(tree.intersect(*rays).t.tobytes())) for _ in range(8)]
    for number, thread in enumerate(threads):
        thread.start()
        tree.refit(shapes[number % 2].vertices)
    for thread in threads:
        thread.join()
    assert len(found) == 8 and set(found) <= expected


def test_a_scene_shows_what_moved_once_its_matrices_are_set():
    mesh = meshes.box()
    tree = bihtree.Tree(*mesh)
    matrices = [moved(np.eye(3)), moved(np.eye(3), (5, 0, 0))]
    scene = bihtree.Scene([tree], [0, 0], matrices)
    rays = [[5.5, 0.25, 9]], [[0, 0, -1.0]]
    tree.refit(mesh.vertices * np.float32(2))
    assert scene.intersect(*rays).t.tolist() == [8]
    scene.set_matrices(matrices)
    assert scene.intersect(*rays).t.tolist() == [7]
