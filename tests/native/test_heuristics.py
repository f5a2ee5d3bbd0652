"""Where nodes are split: every split of a tree against what its heuristic is defined to choose."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.rays import around

MESHES = {
    "terrain": meshes.terrain(40),
    "soup": meshes.soup(3000, 0.1),
    "gears": meshes.gears(6, 20),
    "spiral": meshes.spiral(2000),
    "large": meshes.terrain(80),
}
every_mesh = pytest.mark.parametrize("name", MESHES)
INNER = 0


def splits(mesh, **options):
    """For each inner node of the tree: its axis, and the triangles of its lower and upper part."""
    tree = bihtree.Tree(*mesh, **options)
    tree.validate()
    table, order = tree.nodes(), tree.order()
    children = {}
    for row, parent in enumerate(table["parent"].tolist()):
        children.setdefault(parent, []).append(row)
    for row in np.flatnonzero(table["kind"] == INNER).tolist():
        parts = (order[table["first"][child] :][: table["count"][child]] for child in children[row])
        yield (int(table["axis"][row]), *parts)


def boxes(mesh):
    corners = mesh.corners().astype(np.float64)
    return corners.min(axis=1), corners.max(axis=1)


@every_mesh
@pytest.mark.parametrize("layout", ["classic", "wide"])
def test_local_halves_the_longest_side_of_the_centres(name, layout):
    low, high = boxes(MESHES[name])
    centres = (low + high) / 2
    rounding = 1e-6 * np.ptp(centres, axis=0).max()
    for axis, lower, upper in splits(MESHES[name], heuristic="local", layout=layout):
        both = np.concatenate([lower, upper])
        sides = np.ptp(centres[both], axis=0)
        if sides.max() == 0:
            continue
        assert sides[axis] >= sides.max() - rounding
        plane = (centres[both, axis].min() + centres[both, axis].max()) / 2
        assert centres[lower, axis].max() <= plane + rounding
        assert centres[upper, axis].min() >= plane - rounding


def cost(low, high, part):
    """Half the surface of the box of a part times the leaves of eight that it fills."""
    x, y, z = high[part].max(axis=0) - low[part].min(axis=0)
    return (x * y + y * z + z * x) * -(-len(part) // 8)


@every_mesh
def test_sah_takes_the_cheapest_plane_between_bins(name):
    low, high = boxes(MESHES[name])
    centres = (low + high) / 2
    checked = 0
    for _, lower, upper in splits(MESHES[name], heuristic="sah"):
        both = np.concatenate([lower, upper])
        if len(both) > 256:
            continue  # a sample stands for all
        least, side = centres[both].min(axis=0), np.ptp(centres[both], axis=0)
        bins = 8 if len(both) < 64 else 16
        axes = np.flatnonzero(side) if len(both) >= 16 else np.flatnonzero(side > 0.999 * side.max())[:1]
        if len(both) < 16 and (side > 0.999 * side.max()).sum() > 1:
            continue  # rounding decides which axis is longest
        costs = []
        for axis in axes:
            place = (centres[both, axis] - least[axis]) / side[axis] * bins
            for plane in range(1, bins):
                left = place < plane
                if left.any() and not left.all() and np.abs(place - plane).min() > 1e-3:
                    costs.append(cost(low, high, both[left]) + cost(low, high, both[~left]))
        if costs:
            assert cost(low, high, lower) + cost(low, high, upper) <= min(costs) * (1 + 1e-5)
            checked += 1
    assert checked > 20


def test_sah_keeps_boxes_that_overlap_apart():
    """Discs side by side on one axle, long thin triangles in each: the halvings cut across them."""
    mesh = meshes.gears(12, 24)
    rays = around(mesh, 2000, np.random.default_rng(1))
    nodes = {
        heuristic: bihtree.Tree(*mesh, heuristic=heuristic, layout="wide").traversal_cost(*rays)[0].mean()
        for heuristic in ("global", "sah")
    }
    assert nodes["sah"] < nodes["global"]


@pytest.mark.parametrize("heuristic", ["global", "local", "sah"])
@pytest.mark.parametrize("layout", ["classic", "wide"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_same_bits_for_any_number_of_threads(heuristic, layout, dtype):
    mesh = meshes.joined(meshes.terrain(70), meshes.gears(6, 30), meshes.sheets(5000)).astype(dtype)
    built = [
        bihtree.Tree(*mesh, heuristic=heuristic, layout=layout, presort=presort, threads=threads)
        for threads in (1, 2, 5)
        for presort in ((True, False) if heuristic == "global" else (None,))
    ]
    tables = {tree.nodes().tobytes() for tree in built}
    orders = {tree.order().tobytes() for tree in built}
    counts = {(tree.stats.nodes, tree.stats.leaves, tree.stats.depth, tree.stats.tree_bytes) for tree in built}
    assert (len(tables), len(orders), len(counts)) == (1, 1, 1)


@pytest.mark.parametrize("presort", [True, False])
def test_details_far_smaller_than_the_scene_are_told_apart(presort):
    """A mesh of a billionth of the scene falls into one cell of its grid, and is coded again on a grid of its own."""
    detail = meshes.terrain(40)
    tiny = meshes.Triangles((detail.vertices * np.float32(1e-9)).astype(np.float32), detail.triangles)
    stadium = meshes.joined(tiny, meshes.box((-1, -1, -1), (1, 1, 1)))
    rows = len(tiny.triangles)
    origins = tiny.corners()[:: rows // 50].mean(axis=1).astype(np.float64) + [0, 0, 1e-9]
    down = np.tile([0, 0, -1.0], (len(origins), 1))
    tree = bihtree.Tree(*stadium, presort=presort, layout="wide")
    nodes, tests = tree.traversal_cost(origins, down)
    alone = bihtree.Tree(*tiny, layout="wide").traversal_cost(origins, down)
    assert (tree.intersect(origins, down).triangle >= 0).all()
    assert nodes.mean() <= 2 * alone[0].mean() and tests.mean() <= 2 * alone[1].mean()
