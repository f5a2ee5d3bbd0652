"""nodes(), order(), bounds, validate: the tree as a table, checked against a construction of its own."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.variants import (
    GLOBAL,
    VARIANTS,
    every_bvh,
    every_hierarchy,
    every_kd_tree,
    every_tree,
    every_tree_of_one_reference,
)

FIELDS = {
    "parent": "<i4", "depth": "<i4", "kind": "u1", "axis": "i1", "clip": "<f4", "lower": "<f4", "upper": "<f4",
    "first": "<i8", "count": "<i8",
}  # fmt: skip
INNER, LEAF = 0, 1
MESHES = {
    "terrain": meshes.terrain(15),
    "sphere": meshes.icosphere(3),
    "soup": meshes.soup(500, 0.2),
    "gears": meshes.gears(5, 8),
    "spiral": meshes.spiral(400),
    "one": meshes.sheets(1),
    "coincident": meshes.sheets(50),
    "degenerate": meshes.joined(meshes.soup(30), meshes.from_corners(np.zeros((7, 3, 3))), meshes.soup(30, seed=2)),
}
every_mesh = pytest.mark.parametrize("name", MESHES)


def boxes(mesh):
    """Lower and upper corners (T, 3) of the triangles."""
    corners = mesh.corners()
    return corners.min(axis=1), corners.max(axis=1)


def children(table):
    """For each inner row of the table, (row, left, right); the left child is the first of the two with that parent."""
    found = {}
    for row, parent in enumerate(table["parent"].tolist()):
        found.setdefault(parent, []).append(row)
    assert found.pop(-1) == [0]
    assert sorted(found) == np.flatnonzero(table["kind"] == INNER).tolist()
    assert all(len(rows) == 2 for rows in found.values())
    return [(parent, left, right) for parent, (left, right) in found.items()]


def finished(variant, mesh):
    """A tree with nothing unbuilt; tests/cases/test_case_09_on_demand.py looks at what is unbuilt."""
    tree = variant.tree(*mesh)
    tree.build_all()
    return tree


def fixed_table(variant, mesh):
    return finished(variant, mesh).nodes()


@every_tree
@every_mesh
def test_fields_and_breadth_first_order(variant, name):
    table = fixed_table(variant, MESHES[name])
    assert {field: table.dtype[field].base.str.lstrip("|") for field in table.dtype.names} == FIELDS
    assert [table.dtype[field].shape for field in ("clip", "lower", "upper")] == [(2,), (3,), (3,)]
    assert (np.diff(table["depth"]) >= 0).all()
    assert (table["parent"][0], table["depth"][0]) == (-1, 0)
    assert (table["parent"] < np.arange(len(table))).all()
    assert np.array_equal(table["depth"][1:], table["depth"][table["parent"][1:]] + 1)
    assert np.isin(table["kind"], [INNER, LEAF]).all()
    is_cut = (table["kind"] == INNER) & (variant.structure != "bvh")
    assert np.isin(table["axis"][is_cut], [0, 1, 2]).all()
    assert (table["axis"][~is_cut] == -1).all() and np.isnan(table["clip"][~is_cut]).all()
    assert not np.isnan(table["clip"][is_cut]).any()


@every_tree
@every_mesh
def test_ranges(variant, name):
    mesh = MESHES[name]
    tree = finished(variant, mesh)
    table, order, stats = tree.nodes(), tree.order(), tree.stats
    assert (table["first"][0], table["count"][0]) == (0, stats.references)
    for parent, left, right in children(table):
        assert table["first"][left] == table["first"][parent]
        assert table["first"][right] == table["first"][left] + table["count"][left]
        assert table["count"][left] + table["count"][right] == table["count"][parent]
    leaf = table["kind"] == LEAF
    assert table["count"][leaf].sum() == stats.references
    assert stats.leaves == leaf.sum()
    if stats.layout == "classic":
        assert (stats.nodes, stats.depth) == (len(table), table["depth"].max())
    corners = mesh.corners().astype(np.float64)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = np.flatnonzero(~area.any(axis=1))
    assert np.array_equal(np.unique(order), np.arange(len(mesh.triangles)))
    assert np.array_equal(order[stats.references :], flat) and len(flat) == stats.rejected


@every_tree_of_one_reference
@every_mesh
def test_the_order_is_a_permutation_and_no_leaf_is_empty(variant, name):
    mesh = MESHES[name]
    tree = variant.tree(*mesh)
    assert np.array_equal(np.sort(tree.order()), np.arange(len(mesh.triangles)))
    assert tree.stats.references == tree.stats.triangles - tree.stats.rejected
    assert (tree.nodes()["count"] > 0).all()


@every_hierarchy
@every_mesh
def test_clip_planes_are_exactly_the_childrens_bounds_and_boxes_are_cut_by_them(variant, name):
    mesh = MESHES[name]
    tree = finished(variant, mesh)
    table, order = tree.nodes(), tree.order()
    low, high = (part[order] for part in boxes(mesh))
    reachable = slice(0, tree.stats.triangles - tree.stats.rejected)
    assert np.array_equal(tree.bounds, [low[reachable].min(axis=0), high[reachable].max(axis=0)])
    assert np.array_equal([table["lower"][0], table["upper"][0]], tree.bounds)

    def below(row):
        return slice(table["first"][row], table["first"][row] + table["count"][row])

    for parent, left, right in children(table):
        axis, clip = table["axis"][parent], table["clip"][parent]
        assert clip[0] == high[below(left), axis].max()
        assert clip[1] == low[below(right), axis].min()
        expected = table[["lower", "upper"]][parent].copy()
        upper, lower = expected["upper"].copy(), expected["lower"].copy()
        upper[axis], lower[axis] = clip
        assert np.array_equal(table["lower"][left], expected["lower"]) and np.array_equal(table["upper"][left], upper)
        assert np.array_equal(table["upper"][right], expected["upper"]) and np.array_equal(table["lower"][right], lower)
    for row in range(len(table)):
        assert (table["lower"][row] <= low[below(row)]).all() and (high[below(row)] <= table["upper"][row]).all()
    inner = table["parent"][1:]
    assert (table["lower"][1:] >= table["lower"][inner]).all() and (table["upper"][1:] <= table["upper"][inner]).all()


@every_kd_tree
@every_mesh
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_kd_trees_planes_divide_its_cells_and_leaves_refer_to_what_reaches_into_them(variant, name, dtype):
    mesh = MESHES[name].astype(dtype)
    tree = variant.tree(*mesh)
    table, order = tree.nodes(), tree.order()
    assert np.array_equal([table["lower"][0], table["upper"][0]], tree.bounds)
    for parent, left, right in children(table):
        axis, clip = table["axis"][parent], table["clip"][parent]
        assert clip[0] == clip[1]
        assert table["lower"][parent, axis] < clip[0] < table["upper"][parent, axis]
        upper, lower = table["upper"][parent].copy(), table["lower"][parent].copy()
        upper[axis], lower[axis] = clip
        assert np.array_equal(table["lower"][left], table["lower"][parent])
        assert np.array_equal(table["upper"][left], upper)
        assert np.array_equal(table["upper"][right], table["upper"][parent])
        assert np.array_equal(table["lower"][right], lower)
    low, high = boxes(mesh)
    for leaf in table[table["kind"] == LEAF]:
        rows = order[leaf["first"] : leaf["first"] + leaf["count"]]
        assert (np.diff(rows) > 0).all()
        assert (low[rows] <= leaf["upper"]).all() and (high[rows] >= leaf["lower"]).all()


@every_kd_tree
def test_a_kd_tree_says_how_often_it_refers_to_triangles(variant):
    tree = variant.tree(*MESHES["terrain"])
    stats = tree.stats
    assert stats.references > stats.triangles
    assert len(tree.order()) == stats.references + stats.rejected
    assert stats.to_dict()["references"] == stats.references


@every_bvh
@every_mesh
def test_a_bvhs_boxes_are_those_of_what_lies_below(variant, name):
    mesh = MESHES[name]
    tree = variant.tree(*mesh)
    table = tree.nodes()
    low, high = (part[tree.order()] for part in boxes(mesh))
    assert np.array_equal([table["lower"][0], table["upper"][0]], tree.bounds)
    for node in table:
        below = slice(node["first"], node["first"] + node["count"])
        assert np.array_equal(node["lower"], low[below].min(axis=0))
        assert np.array_equal(node["upper"], high[below].max(axis=0))


@every_hierarchy
def test_clip_planes_of_float64_are_the_next_float32_outward(variant):
    mesh = meshes.soup(200, 0.2, dtype=np.float64)
    mesh = meshes.Triangles(mesh.vertices + 1000 / 3, mesh.triangles)
    tree = finished(variant, mesh)
    table = tree.nodes()
    low, high = (part[tree.order()] for part in boxes(mesh))
    for parent, left, right in children(table):
        axis, clip = table["axis"][parent], table["clip"][parent].astype(np.float64)
        step = np.spacing(np.abs(table["clip"][parent])).astype(np.float64)
        first, last = table["first"], table["first"] + table["count"]
        most = high[first[left] : last[left], axis].max()
        least = low[first[right] : last[right], axis].min()
        assert most <= clip[0] < most + step[0]
        assert least - step[1] < clip[1] <= least
    assert tree.bounds.dtype == np.float64
    assert (tree.bounds[0] <= low.min(axis=0)).all() and (tree.bounds[1] >= high.max(axis=0)).all()


def construct(low, high, leaf_size):
    """The slides' construction with plain lists: cells halved on their longest side, empty halves without a node.

    Rows whose centres coincide are halved by number, on the axis on which they are longest.
    Returns {path from the root, 0 left and 1 right: (axis or None, sorted rows)}.
    """
    centres = ((low + high) / 2).tolist()
    nodes = {}

    def divide(path, rows, lower, upper):
        if len(rows) <= leaf_size:
            nodes[path] = (None, rows)
        elif all(centres[row] == centres[rows[0]] for row in rows):
            side = high[rows].max(axis=0) - low[rows].min(axis=0)
            nodes[path] = (int(np.argmax(side)), rows)
            divide((*path, 0), rows[: len(rows) // 2], lower, upper)
            divide((*path, 1), rows[len(rows) // 2 :], lower, upper)
        else:
            side = [upper[i] - lower[i] for i in range(3)]
            axis = side.index(max(side))
            plane = (lower[axis] + upper[axis]) / 2
            left = [row for row in rows if centres[row][axis] < plane]
            right = [row for row in rows if centres[row][axis] >= plane]
            below = [plane if i == axis else upper[i] for i in range(3)]
            above = [plane if i == axis else lower[i] for i in range(3)]
            if left and right:
                nodes[path] = (axis, rows)
                divide((*path, 0), left, lower, below)
                divide((*path, 1), right, above, upper)
            elif left:
                divide(path, left, lower, below)
            else:
                divide(path, right, above, upper)

    divide((), list(range(len(centres))), low.min(axis=0).tolist(), high.max(axis=0).tolist())
    return nodes


@pytest.mark.parametrize("variant", GLOBAL, ids=str)
@pytest.mark.parametrize("name", ["terrain", "sphere", "soup", "gears", "spiral"])
def test_the_tree_is_the_one_of_the_slides(variant, name):
    """Same axes and same sets of triangles below each node as a construction that knows nothing of arrays in place."""
    mesh = MESHES[name]
    leaf_size = variant.options.get("leaf_size", 4)
    tree = variant.tree(*mesh, leaf_size=leaf_size)
    tree.build_all()
    expected = construct(*(part.astype(np.float64) for part in boxes(mesh)), leaf_size)
    table, order = tree.nodes(), tree.order()
    paths = {0: ()}
    for parent, left, right in sorted(children(table)):
        paths[left], paths[right] = (*paths[parent], 0), (*paths[parent], 1)
    found = {}
    for row, path in paths.items():
        below = order[table["first"][row] : table["first"][row] + table["count"][row]]
        found[path] = (None if table["axis"][row] < 0 else int(table["axis"][row]), sorted(below.tolist()))
    assert found == expected


def test_the_slides_box_of_18_by_10_by_10_is_cut_at_9_then_5_then_5():
    """Small triangles just beside the planes x = 9, y = 5, z = 5, x = 4.5 and in the corners, which set the bounds."""
    places = [(x, y, z) for x in (0, 4.4, 4.6, 8.9, 9.1, 18) for y in (0, 4.9, 5.1, 10) for z in (0, 4.9, 5.1, 10)]
    inward = np.where(np.array(places) > [9, 5, 5], -0.05, 0.05)
    shape = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 1]])
    mesh = meshes.from_corners(np.array(places)[:, None] + inward[:, None] * shape)
    tree = bihtree.Tree(*mesh, leaf_size=1)
    assert np.array_equal(tree.bounds, [[0, 0, 0], [18, 10, 10]])
    table, order = tree.nodes(), tree.order()
    low, high = (part[order] for part in boxes(mesh))
    planes = {0: (0, 9.0), 1: (1, 5.0), 2: (2, 5.0)}
    for parent, left, right in children(table):
        depth = int(table["depth"][parent])
        if depth > 2:
            continue
        axis, plane = planes[depth]
        assert table["axis"][parent] == axis
        first, last = table["first"], table["first"] + table["count"]
        assert high[first[left] : last[left], axis].max() < plane < low[first[right] : last[right], axis].min()
    at_three = table[(table["depth"] == 3) & (table["kind"] == INNER)]
    assert len(at_three) == 8 and (at_three["axis"] == 0).all()


@every_tree
@every_mesh
def test_max_depth_and_limit_give_the_first_rows(variant, name):
    tree = finished(variant, MESHES[name])
    table = tree.nodes()
    for depth in (0, 1, 2, 5, 1000):
        assert tree.nodes(max_depth=depth).tobytes() == table[table["depth"] <= depth].tobytes()
    for limit in (0, 1, 2, 3, 10, len(table), len(table) + 5):
        assert tree.nodes(limit=limit).tobytes() == table[:limit].tobytes()
    assert tree.nodes(max_depth=3, limit=4).tobytes() == table[table["depth"] <= 3][:4].tobytes()
    assert tree.nodes(max_depth=None, limit=None).tobytes() == table.tobytes()
    for arguments in ({"max_depth": -1}, {"limit": -1}):
        with pytest.raises((ValueError, OverflowError)):
            tree.nodes(**arguments)


@every_tree
@every_mesh
def test_validate(variant, name):
    assert variant.tree(*MESHES[name]).validate() is None


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_same_tree_for_any_number_of_threads(dtype):
    mesh = meshes.terrain(150, dtype=dtype)
    trees = [bihtree.Tree(*mesh, threads=threads) for threads in (0, 1, 2, 7)]
    for tree in trees[1:]:
        assert tree.nodes().tobytes() == trees[0].nodes().tobytes()
        assert tree.order().tobytes() == trees[0].order().tobytes()


def test_leaf_size_bounds_the_leaves():
    mesh = MESHES["soup"]
    for size in (1, 2, 3, 5, 16, 1000):
        table = bihtree.Tree(*mesh, layout="classic", leaf_size=size).nodes()
        assert table["count"][table["kind"] == LEAF].max() <= size
        inner = table["count"][table["kind"] == INNER]
        assert (inner > size).all()
        wide = bihtree.Tree(*mesh, leaf_size=size).nodes()
        assert wide["count"][wide["kind"] == LEAF].max() <= min(size, 8)
    assert len(bihtree.Tree(*mesh, layout="classic", leaf_size=1000).nodes()) == 1


def test_every_variant_of_an_empty_tree():
    for variant in VARIANTS:
        tree = variant.tree(np.empty((0, 3), np.float32))
        assert len(tree.nodes()) == tree.stats.nodes <= 1
        assert tree.order().shape == (0,)
