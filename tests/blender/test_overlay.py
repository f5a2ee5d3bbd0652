"""What looks at built trees, without a window: operators, the layers that are drawn, real geometry, and scripts."""

from __future__ import annotations

import bihtree
import bpy
import numpy as np
import pytest

from addon.blender import compare, overlay_layers, scripting
from addon.blender.overlay_properties import BihOverlaySettings
from addon.blender.trees import TREES
from addon.pipeline.errors import UserError
from tests.blender.scenes import add, add_camera, add_mesh, depsgraph
from tests.meshes import Triangles, icosphere


@pytest.fixture
def ball(registered):
    """A ball whose tree is built."""
    add_mesh("Ball", icosphere(3))
    add_camera()
    bpy.ops.bih.build()
    return registered


def test_every_property_says_what_it_costs(registered):
    properties = [p for p in BihOverlaySettings.bl_rna.properties if p.identifier not in {"rna_type", "name"}]
    assert len(properties) == 10
    for p in properties:
        for word in ("time", "memory", "error"):
            assert word in p.description, (p.identifier, word)


def test_a_picked_ray_is_shown_and_its_last_node_selected(ball):
    trees = TREES.of(ball)
    assert bpy.ops.bih.pick_ray(origin=(0.1, 0.2, 5.0), direction=(0.0, 0.0, -1.0)) == {"FINISHED"}
    hit = trees.main.tree.intersect([[0.1, 0.2, 5.0]], [[0.0, 0.0, -1.0]])
    assert trees.path.triangle == hit.triangle[0] >= 0
    assert trees.selected == trees.path.visited[-1]
    assert ball.bih_overlay.shown == "ray"
    with pytest.raises(RuntimeError, match="points somewhere"):
        bpy.ops.bih.pick_ray(origin=(0.1, 0.2, 5.0), direction=(0.0, 0.0, 0.0))


def test_a_picked_ray_builds_what_it_comes_to(registered):
    add_mesh("Ball", icosphere(5))
    registered.bih.build, registered.bih.leaf_size = "on_demand", 1
    bpy.ops.bih.build()
    trees = TREES.of(registered)
    before = len(trees.main.nodes)
    bpy.ops.bih.pick_ray(origin=(0.1, 0.2, 5.0), direction=(0.0, 0.0, -1.0))
    assert len(trees.main.nodes) > before
    assert trees.main.nodes["kind"][trees.selected] == 1
    assert (trees.main.nodes["kind"] == 2).any()


def test_costs_show_what_their_rays_have_built(registered):
    add_mesh("Ball", icosphere(5))
    add_camera((0.0, 0.0, 5.0))
    registered.bih.build, registered.bih.leaf_size = "on_demand", 1
    registered.camera.data.lens = 900.0
    bpy.ops.bih.build()
    bpy.ops.bih.pick_ray(origin=(0.1, 0.2, 5.0), direction=(0.0, 0.0, -1.0))
    trees = TREES.of(registered)
    before = len(trees.main.nodes)
    bpy.ops.bih.cost_map()
    assert len(trees.main.nodes) > before
    assert (trees.path, trees.selected) == (None, -1), "rows of other nodes now"


def test_a_mesh_without_area_has_nothing_to_show(registered):
    from addon.pipeline import overlay_legend_lines

    add_mesh("Flat", Triangles(np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.int32)))
    assert bpy.ops.bih.build() == {"FINISHED"}
    trees = TREES.of(registered)
    for shown in ("planes", "boxes", "leaves"):
        registered.bih_overlay.shown = shown
        assert overlay_layers.outlines(trees.main, registered.bih_overlay, None) is not None
        assert overlay_layers.faces(trees.main, registered.bih_overlay, None) == []
        overlay_legend_lines.entries(trees.main.nodes, shown, 0, 9)
    bpy.ops.bih.pick_ray(origin=(0.0, 0.0, 5.0), direction=(0.0, 0.0, -1.0))
    assert not trees.path.is_hit and np.isfinite(trees.path.ends).all()


def test_choices_can_be_undone(ball):
    """And the tree stays."""
    ball.bih.samples, ball.bih_overlay.last_depth = 5, 3
    bpy.ops.ed.undo_push(message="first")
    ball.bih.samples, ball.bih_overlay.last_depth = 9, 8
    bpy.ops.ed.undo_push(message="second")
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert (scene.bih.samples, scene.bih_overlay.last_depth) == (5, 3)
    assert TREES.of(scene).main is not None


def test_from_node_to_node(ball):
    trees = TREES.of(ball)
    bpy.ops.bih.select_node(to="root")
    bpy.ops.bih.select_node(to="right")
    assert (trees.selected, trees.main.nodes["parent"][trees.selected]) == (2, 0)
    bpy.ops.bih.select_node(to="parent")
    assert trees.selected == 0
    bpy.ops.bih.select_node(to="none")
    assert trees.selected == -1
    bpy.ops.bih.free()
    assert not bpy.ops.bih.select_node.poll()


@pytest.mark.parametrize("name", ["free", "pick_ray", "cost_map", "compare", "mesh_from_tree", "export_tree"])
def test_what_needs_a_tree_is_grey_without_one(ball, name):
    operator = getattr(bpy.ops.bih, name)
    assert operator.poll()
    bpy.ops.bih.free()
    assert not operator.poll()
    with pytest.raises(RuntimeError, match="no tree is built; press Build"):
        operator()


def test_what_was_asked_for_is_seen(ball):
    """Though the overlay was off, or planes would tint the colours of the costs."""
    chosen = ball.bih_overlay
    chosen.is_shown, chosen.cost = False, False
    bpy.ops.bih.pick_ray(origin=(0.1, 0.2, 5.0), direction=(0.0, 0.0, -1.0))
    assert (chosen.is_shown, chosen.shown) == (True, "ray")
    chosen.is_shown = False
    bpy.ops.bih.cost_map()
    assert (chosen.is_shown, chosen.shown, chosen.cost) == (True, "nothing", True)
    chosen.is_shown = False
    bpy.ops.bih.compare()
    assert chosen.is_shown
    bpy.ops.bih.mesh_from_tree()
    assert not chosen.is_shown, "the mesh lies at the same places"


def test_construction_is_played_to_its_end(ball):
    ball.bih_overlay.last_depth = 0
    bpy.ops.bih.play_construction()
    assert ball.bih_overlay.last_depth == TREES.of(ball).main.deepest > 5


def test_another_structure_over_the_same_mesh(ball):
    ball.bih.leaf_size = 2
    for structure in ("bvh", "kd_tree", "bih"):
        ball.bih_overlay.other_structure = structure
        assert bpy.ops.bih.compare() == {"FINISHED"}
        trees = TREES.of(ball)
        assert trees.other.tree.stats.structure == structure
        assert trees.other.vertices is trees.main.vertices
    way = overlay_layers.beside(trees)
    assert way[0] > np.ptp(trees.main.vertices[:, 0]) and not way[1:].any()
    assert (overlay_layers.other_mesh(trees).positions[:, 0] > trees.main.vertices[:, 0].max()).all()
    moved = overlay_layers.outlines(trees.other, ball.bih_overlay, way)
    assert min(chunk.bounds[0, 0] for chunk in moved.chunks) > trees.main.vertices[:, 0].max()


def test_the_cost_map_is_that_of_the_camera(ball):
    from addon.pipeline.cost_map import cost_map

    assert bpy.ops.bih.cost_map() == {"FINISHED"}
    trees = TREES.of(ball)
    expected = cost_map(trees.main.tree, trees.main.vertices, tuple(ball.camera.matrix_world.translation))
    np.testing.assert_array_equal(trees.cost.cost, expected.cost)
    assert overlay_layers.cost_mesh(trees).colours.shape == (3 * 1280, 4)
    ball.camera.data.type = "ORTHO"
    bpy.ops.bih.cost_map()
    assert (TREES.of(ball).cost.cost != expected.cost).any()
    ball.camera = None
    with pytest.raises(RuntimeError, match="no view"):
        bpy.ops.bih.cost_map()


def test_work_on_a_tree_that_is_gone_is_dropped(ball):
    trees = TREES.of(ball)
    made = trees.main
    assert compare.unchanged(bpy.context, made) is made
    bpy.ops.bih.build()
    with pytest.raises(UserError, match="built again"):
        compare.unchanged(bpy.context, made)


def test_layers_are_made_again_only_when_what_they_are_made_of_changes(ball):
    layers, made = overlay_layers.Layers(), []
    nodes = TREES.of(ball).main.nodes

    def layer(*made_of):
        return layers.layer("outlines", made_of, lambda: made.append(made_of) or len(made))

    assert layer(nodes, "planes", 0, 3) == layer(nodes, "planes", 0, 3) == 1
    assert layer(nodes, "planes", 0, 4) == 2
    assert layer(nodes.copy(), "planes", 0, 4) == 3
    assert len(made) == 3


def test_real_geometry_and_undo(ball):
    bpy.ops.ed.undo_push(message="before")
    nodes = TREES.of(ball).main.nodes
    assert bpy.ops.bih.mesh_from_tree(shown="boxes", last_depth=3) == {"FINISHED"}
    (made,) = (each for each in bpy.data.collections if each.name.startswith("Tree of"))
    assert sum(len(each.data.polygons) for each in made.objects) == 6 * np.count_nonzero(nodes["depth"] <= 3)
    assert all(each.modifiers[0].type == "WIREFRAME" for each in made.objects)
    assert {each.data.materials[0].name for each in made.objects} <= {"BIH Box", "BIH Leaf"}
    bpy.ops.ed.undo_push(message="made")
    bpy.ops.ed.undo()
    assert not [each for each in bpy.data.collections if each.name.startswith("Tree of")]
    assert TREES.of(bpy.context.scene).main.nodes is nodes, "undo leaves the tree"
    with pytest.raises(RuntimeError, match="nothing to show"):
        bpy.ops.bih.mesh_from_tree(first_depth=90, last_depth=91)


def test_a_script_casts_many_rays_at_what_is_shown(registered):
    near = add_mesh("Near")
    near.location.x = 5.0
    again = add("Again", near.data)
    again.location, again.scale = (50.0, 0.0, 0.0), (-1.0, 2.0, 2.0)
    shown = scripting.shown(depsgraph(), heuristic="sah")
    assert isinstance(shown.scene, bihtree.Scene)
    assert [tree.stats.heuristic for tree in shown.scene.trees] == ["sah"], "two objects, one mesh, one tree"
    assert len(shown.names) == 2
    origins = np.tile([0.0, 0.05, 0.1], (1000, 1))
    for start, expected, t in ((0.0, 0, 5.0), (20.0, 1, 29.0)):
        hits = shown.scene.intersect(origins + [start, 0.0, 0.0], np.tile([1.0, 0.0, 0.0], (1000, 1)))
        assert (hits.instance == expected).all()
        np.testing.assert_allclose(hits.t, t, rtol=1e-6)
    assert scripting.shown().scene.stats.triangles == 24


def test_a_script_is_told_what_is_wrong(registered):
    with pytest.raises(UserError, match="no triangles"):
        scripting.shown()
    add_mesh("Box")
    with pytest.raises(ValueError, match="kd_tree"):
        scripting.shown(structure="kd_tree", layout="wide")
