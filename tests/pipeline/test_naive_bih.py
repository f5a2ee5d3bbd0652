"""The native tree's nodes() against the table written down from the definition."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.pipeline.naive_bih import naive_nodes
from tests.pipeline.overlay_scene import spheres_on_a_floor

MESHES = {
    "spheres on a floor": spheres_on_a_floor(),
    "soup": meshes.soup(300, 0.3),
    "terrain": meshes.terrain(12),
    "gears": meshes.gears(4, 6),
    "box": meshes.box(),
}


@pytest.mark.parametrize("leaf_size", [2, 4])  # the two triangles of a square have one centre
@pytest.mark.parametrize("name", MESHES)
def test_the_native_table_is_the_naive_one(name, leaf_size):
    mesh = MESHES[name]
    tree = bihtree.Tree(*mesh, leaf_size=leaf_size)
    expected, order = naive_nodes(*mesh, leaf_size=leaf_size)
    table = tree.nodes()
    assert len(table) == len(expected) > 1
    for field in expected.dtype.names:
        np.testing.assert_array_equal(table[field], expected[field], err_msg=field)
    np.testing.assert_array_equal(tree.order(), order)


@pytest.mark.parametrize("max_depth", [0, 3])
def test_a_depth_cuts_both_tables_alike(max_depth):
    mesh = MESHES["spheres on a floor"]
    expected, _ = naive_nodes(*mesh, max_depth=max_depth)
    table = bihtree.Tree(*mesh, leaf_size=4).nodes(max_depth=max_depth)
    assert table["depth"].max() == max_depth
    for field in expected.dtype.names:
        np.testing.assert_array_equal(table[field], expected[field], err_msg=field)
