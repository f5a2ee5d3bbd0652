"""Stats: what a tree says of itself, counted again."""

import numpy as np
import pytest
from bihtree import Tree

from tests import meshes
from tests.rays import around
from tests.variants import every_kd_tree, every_tree, every_tree_of_one_reference

MESHES = {
    "terrain": meshes.terrain(60),
    "soup": meshes.soup(3000, 0.1),
    "coincident": meshes.sheets(500),
    "one": meshes.sheets(1),
    "spiral": meshes.spiral(2000),
}


@every_tree_of_one_reference
@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_bytes_are_those_of_the_records_and_four_a_reference_within_the_bound(variant, name, dtype):
    mesh = MESHES[name].astype(dtype)
    stats, count = variant.tree(*mesh).stats, len(mesh.triangles)
    if stats.build == "on_demand":
        assert stats.bound_bytes > variant.tree(*mesh, build="eager").stats.bound_bytes
    elif stats.layout == "classic":
        assert stats.tree_bytes == 12 * stats.nodes + 4 * count
        assert stats.bound_bytes <= 12 * 2 * count + 4 * count
        assert stats.nodes == 2 * stats.leaves - 1
    else:
        records = stats.nodes - stats.leaves
        size = 96 if stats.layout == "compact" else 256
        corners = 4 * (9 * count + 8) if stats.layout == "wide" and dtype == np.float32 else 0
        assert stats.tree_bytes == size * records + corners + 4 * count
        pieces = min(count, 1 + 125 * (count // 1024))
        assert stats.bound_bytes == size * (1 + 3 * (count + pieces) // 5) + corners + 4 * count
        assert 5 * records <= 3 * stats.leaves - 1 or stats.leaves == 1
    assert stats.tree_bytes <= stats.bound_bytes
    assert stats.peak_build_bytes >= stats.tree_bytes
    assert stats.mesh_bytes == mesh.vertices.nbytes + mesh.triangles.nbytes
    assert stats.build_seconds > 0


@every_kd_tree
@pytest.mark.parametrize("name", MESHES)
def test_bytes_of_a_kd_tree_are_not_known_before(variant, name):
    stats = variant.tree(*MESHES[name]).stats
    assert stats.tree_bytes == 8 * stats.nodes + 4 * (stats.references + stats.rejected)
    assert stats.bound_bytes == 0
    assert stats.nodes == 2 * stats.leaves - 1
    assert stats.peak_build_bytes >= stats.tree_bytes


@pytest.mark.parametrize("layout", ["wide", "compact", "classic"])
def test_the_bound_does_not_depend_on_the_shape(layout):
    bounds = {
        Tree(*mesh, layout=layout, leaf_size=size).stats.bound_bytes
        for mesh in (meshes.sheets(64), meshes.soup(64))
        for size in (1, 8)
    }
    assert len(bounds) == 1


def test_the_bound_of_the_papers_nodes_is_reached():
    stats = Tree(*meshes.soup(64), layout="classic", leaf_size=1).stats
    assert stats.tree_bytes == stats.bound_bytes == 12 * 127 + 4 * 64


@every_tree
def test_names_and_counts(variant):
    mesh = MESHES["terrain"]
    stats = variant.tree(*mesh).stats
    build = variant.options.get("build", "eager")
    names = (stats.structure, stats.layout, stats.build, stats.heuristic, stats.precision)
    assert names == (variant.structure, variant.layout, build, variant.heuristic, variant.precision)
    assert (stats.triangles, stats.rejected) == (len(mesh.triangles), 0)
    assert (stats.unbuilt > 0) == (build == "on_demand")
    assert stats.presorted == variant.options.get("presort", False)
    assert ("presort" in stats.left_out) != stats.presorted
    assert all(isinstance(part, str) and isinstance(reason, str) for part, reason in stats.left_out.items())


def test_the_bucket_sort_is_left_out_of_small_meshes_and_says_so():
    small, large = (Tree(*mesh).stats for mesh in (meshes.terrain(181), meshes.terrain(182)))
    assert (small.triangles, small.presorted) == (65_522, False)
    assert small.left_out["presort"] == "65536 triangles or fewer"
    assert (large.triangles, large.presorted) == (66_248, True) and "presort" not in large.left_out


def test_halvings_that_have_all_triangles_on_one_side_are_counted():
    shape = np.array([[0, 0, 0], [0.02, 0, 0.01], [0, 0.02, 0.01]])
    places = np.array([[0, 0, 0], [0.3, 0, 0], [7.98, 0.98, 0.98]])  # centres 0.01 and 0.31 and beside x = 8
    # x = 4 parts the last one off; x = 2, 1, 0.5 and y, z = 0.5 have all on one side; x = 0.25 parts the others.
    stats = Tree(*meshes.from_corners(shape + places[:, None]), leaf_size=1).stats
    assert stats.left_out["nodes of empty halves"].startswith("5 ")
    apart = Tree(*meshes.from_corners(shape + places[::2, None]), leaf_size=1).stats
    assert "nodes of empty halves" not in apart.left_out


@every_tree
def test_to_dict_holds_every_field(variant):
    stats = variant.tree(*MESHES["soup"]).stats
    as_dict = stats.to_dict()
    fields = [name for name in dir(stats) if not name.startswith("_") and name != "to_dict"]
    assert sorted(as_dict) == sorted(fields)
    assert all(getattr(stats, name) == value for name, value in as_dict.items())
    assert {"triangles", "nodes", "leaves", "depth", "tree_bytes", "bound_bytes", "mesh_bytes", "left_out"} <= set(
        as_dict
    )


@every_tree
def test_traversal_cost_is_far_below_testing_everything(variant):
    mesh = MESHES["terrain"]
    tree = variant.tree(*mesh)
    rays = around(mesh, 500, np.random.default_rng(1))
    nodes, tests = tree.traversal_cost(*rays)
    assert nodes.dtype == tests.dtype == np.int32
    assert nodes.shape == tests.shape == (500,)
    hit = tree.intersect(*rays).hit
    assert (nodes[hit] > 0).all() and (tests[hit] > 0).all()
    assert (nodes <= tree.stats.nodes).all() and (tests <= len(mesh.triangles)).all()
    assert tests.mean() < 0.1 * len(mesh.triangles)
    away = tree.traversal_cost([[0, 0, 50.0]], [[0, 0, 1.0]])
    assert away[0][0] <= 1 and away[1][0] == 0


@every_tree
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_an_axis_parallel_ray_beside_the_mesh_costs_nothing(variant, axis, sign, zero):
    """0 · inf at the sides of the boxes must not open the tree."""
    tree = variant.tree(*MESHES["soup"])
    directions = np.full((8, 3), zero)
    directions[:, axis] = sign
    origins = np.full((8, 3), 0.5)
    others = [(a, b) for a in (-1.0, 0.5, 2.0) for b in (-1.0, 0.5, 2.0) if (a, b) != (0.5, 0.5)]
    origins[:, [(axis + 1) % 3, (axis + 2) % 3]] = others
    nodes, tests = tree.traversal_cost(origins, directions)
    assert nodes.max() <= 1 and tests.max() == 0
