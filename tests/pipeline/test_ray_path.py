"""The picked ray's walk is the one that the tree makes, and the colours of the cost map are those of its cost."""

from __future__ import annotations

import bihtree
import numpy as np
import pytest

from addon.pipeline import cost_map, overlay_legend_lines
from addon.pipeline.ray_path import child_of, numbers, parent_of, ray_path
from tests.meshes import icosphere

BALL = icosphere(3)
RNG = np.random.default_rng(7)


def rays(count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    origins = RNG.normal(size=(count, 3)) * 2
    return list(zip(origins, RNG.normal(size=(count, 3)) * 0.5 - origins, strict=True))


@pytest.mark.parametrize("structure", ["bih", "kd_tree"])
def test_the_walk_visits_what_the_tree_counts(structure):
    """In the classic layout, whose nodes are those of nodes()."""
    tree = bihtree.Tree(*BALL, layout="classic", structure=structure)
    same = 0
    for origin, direction in rays(200):
        path = ray_path(tree, origin, direction)
        hit = tree.intersect(origin[None], direction[None])
        assert path.triangle == hit.triangle[0]
        assert len(set(path.visited.tolist())) == len(path.visited)
        same += len(path.visited) == path.nodes
    assert same >= 190, "in a few, a box is touched to rounding"


@pytest.mark.parametrize("options", [{}, {"structure": "bvh"}, {"structure": "kd_tree"}, {"build": "on_demand"}])
def test_the_leaf_that_is_hit_is_visited(options):
    tree = bihtree.Tree(*BALL, **options)
    for origin, direction in rays(50):
        path = ray_path(tree, origin, direction)
        if not path.is_hit:
            continue
        nodes, order = tree.nodes(), tree.order()
        leaves = [row for row in path.visited if nodes["kind"][row] == 1]
        held = [order[nodes["first"][row] : nodes["first"][row] + nodes["count"][row]] for row in leaves]
        assert any(path.triangle in rows for rows in held)
        assert all(nodes["parent"][row] in path.visited for row in path.visited[1:])


def test_a_ray_that_misses_the_box_visits_nothing_or_the_root():
    tree = bihtree.Tree(*BALL)
    path = ray_path(tree, (5, 5, 5), (1, 0, 0))
    assert len(path.visited) == 0 and not path.is_hit and np.isfinite(path.ends).all()
    assert overlay_legend_lines.entries(tree.nodes(), "ray", 0, 9, path=path)[0][1].startswith("The ray hits nothing")
    assert overlay_legend_lines.entries(tree.nodes(), "ray", 0, 9)[0][1].startswith("Pick a ray")


def test_the_ray_ends_where_it_hits():
    path = ray_path(bihtree.Tree(*BALL), (0.1, 0.2, 7.0), (0.0, 0.0, -2.0))
    assert np.isclose(np.linalg.norm(path.ends[1]), 1.0, atol=0.02) and path.ends[1, 2] > 0.9


def test_numbers_are_those_of_the_node():
    tree = bihtree.Tree(*BALL)
    nodes = tree.nodes()
    rows = dict(numbers(nodes, 0))
    assert rows["Axis"] == "xyz"[nodes["axis"][0]] and rows["Triangles"] == "1,280, from 0 on"
    assert float(rows["Left ends"]) == pytest.approx(float(nodes["clip"][0, 0]), rel=1e-5)
    assert ("Overlap" in rows) == (nodes["clip"][0, 1] < nodes["clip"][0, 0])
    leaf = int(np.flatnonzero(nodes["kind"] == 1)[0])
    assert dict(numbers(nodes, leaf))["Kind"] == "Leaf" and "Axis" not in dict(numbers(nodes, leaf))


def test_from_node_to_node():
    nodes = bihtree.Tree(*BALL).nodes()
    assert parent_of(nodes, 0) == 0
    for row in range(1, 40):
        parent = parent_of(nodes, row)
        assert row in (child_of(nodes, parent, 0), child_of(nodes, parent, 1))
    left, right = child_of(nodes, 0, 0), child_of(nodes, 0, 1)
    axis = nodes["axis"][0]
    assert nodes["upper"][left, axis] == nodes["clip"][0, 0]
    assert nodes["lower"][right, axis] == nodes["clip"][0, 1]
    leaf = int(np.flatnonzero(nodes["kind"] == 1)[0])
    assert child_of(nodes, leaf, 0) == leaf


def test_costs_are_those_of_the_rays():
    tree = bihtree.Tree(*BALL)
    made = cost_map.cost_map(tree, BALL.vertices, (0.0, 0.0, 9.0))
    directions = BALL.vertices.astype(float) - (0.0, 0.0, 9.0)
    nodes, tests = tree.traversal_cost(np.tile([0.0, 0.0, 9.0], (len(directions), 1)), directions)
    np.testing.assert_array_equal(made.cost, nodes + tests)
    assert made.least == made.cost[made.cost > 0].min() and made.least < made.most <= made.cost.max()
    parallel = cost_map.cost_map(tree, BALL.vertices, (0.0, 0.0, 9.0), (0.0, 0.0, -2.0))
    above = BALL.vertices.astype(float).copy()
    above[:, 2] = 9.0
    nodes, tests = tree.traversal_cost(above, np.tile([0.0, 0.0, -1.0], (len(above), 1)))
    np.testing.assert_array_equal(parallel.cost, nodes + tests)


def test_the_ramp_grows_lighter():
    lightness = cost_map.ramp(np.linspace(0, 1, 50)) @ (0.3, 0.6, 0.1)
    assert (np.diff(lightness) > 0).all()
    colours = cost_map.CostMap(np.array([0, 5, 10, 99]), 5, 10).colours()
    np.testing.assert_allclose(colours[[0, 1]], colours[[1, 1]])
    np.testing.assert_allclose(colours[2], colours[3])
    assert (colours[:, 3] == 1).all()
