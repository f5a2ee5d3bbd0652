"""Building trees to look at, freeing them, and writing them to files: what scripts call and buttons press."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import bihtree
import bpy
import numpy as np
import pytest

from addon.blender.export import contents
from addon.blender.trees import TREES
from addon.blender.worker import Worker
from addon.pipeline import built
from addon.pipeline.errors import UserError
from tests.blender.scenes import add_camera, add_mesh
from tests.meshes import icosphere


@pytest.fixture
def ball(registered):
    add_mesh("Ball", icosphere(3))
    add_camera()
    return registered


def test_build_and_free(ball):
    assert not bpy.ops.bih.free.poll()
    ball.bih.structure, ball.bih.layout = "bvh", "compact"
    assert bpy.ops.bih.build() == {"FINISHED"}
    made = TREES.of(ball).main
    assert (made.tree.stats.structure, made.tree.stats.layout) == ("bvh", "compact")
    assert made.tree.stats.triangles == 1280
    assert bpy.ops.bih.free() == {"FINISHED"}
    assert TREES.of(ball).main is None


def test_trees_are_gone_with_their_file(ball):
    bpy.ops.bih.build()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert TREES._by_scene == {}


def test_the_table_says_what_the_stats_say(ball):
    bpy.ops.bih.build()
    made = TREES.of(ball).main
    rows, stats = dict(built.table(made)), made.tree.stats
    assert rows["Triangles"] == "1,280"
    assert (rows["Nodes"], rows["Leaves"]) == (f"{stats.nodes:,}", f"{stats.leaves:,}")
    assert rows["Bytes a triangle"] == f"{stats.tree_bytes / 1280:.1f}"
    assert rows["Rays"] == "76,800"
    assert rows["Not yet built"] == "0%"
    assert [name for name, _ in built.left_out(made)] == [name.capitalize() for name in stats.left_out]


def test_large_numbers_are_grouped_as_in_the_table():
    made = SimpleNamespace(tree=SimpleNamespace(stats=SimpleNamespace(left_out={"nodes": "76455 of 812 halvings"})))
    assert built.left_out(made) == [("Nodes", "76,455 of 812 halvings")]


def test_on_demand_only_what_the_camera_sees_is_built(ball):
    add_mesh("Behind the Camera", icosphere(3)).location = (40.0, -50.0, 30.0)
    ball.bih.build, ball.bih.leaf_size = "on_demand", 1
    bpy.ops.bih.build()
    made = TREES.of(ball).main
    assert made.tree.stats.unbuilt > 0
    share = built.unbuilt_share(made)
    assert 0 < share < 1
    made.tree.build_all()
    made.read_nodes()
    assert built.unbuilt_share(made) == 0


def test_no_camera_is_needed(registered):
    """Nor one that can be traced."""
    add_mesh("Ball", icosphere(1))
    for _ in range(2):
        assert bpy.ops.bih.build() == {"FINISHED"}
        assert "Trace time" not in dict(built.table(TREES.of(registered).main))
        add_camera().data.type = "PANO"


def test_errors_are_reported(registered, tmp_path):
    with pytest.raises(RuntimeError, match="no triangles"):
        bpy.ops.bih.build()
    with pytest.raises(RuntimeError, match="no tree is built"):
        bpy.ops.bih.export_tree(filepath=str(tmp_path / "a.bihtree"))
    add_mesh("Ball", icosphere(1))
    bpy.ops.bih.build()
    with pytest.raises(RuntimeError, match="no folder"):
        bpy.ops.bih.export_tree(filepath=str(tmp_path / "none" / "a.bihtree"))
    with pytest.raises(RuntimeError, match=r"ends in \.bihtree"):
        bpy.ops.bih.export_tree(filepath=str(tmp_path / "a.npz"))
    with pytest.raises(RuntimeError, match="no file is named"):
        bpy.ops.bih.export_tree()
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.bih.render_overlay(filepath=str(tmp_path / "a.png"))
    assert not list(tmp_path.iterdir())


def test_an_exported_tree_is_the_tree(ball, tmp_path):
    bpy.ops.bih.build()
    made = TREES.of(ball).main
    assert bpy.ops.bih.export_tree(filepath=str(tmp_path / "ball")) == {"FINISHED"}
    assert {path.name for path in tmp_path.iterdir()} == {"ball.bihtree", "ball.npz"}
    read = bihtree.Tree.load(tmp_path / "ball.bihtree")
    with np.load(tmp_path / "ball.npz", allow_pickle=False) as archive:
        assert archive["nodes"].tobytes() == made.tree.nodes().tobytes()
        np.testing.assert_array_equal(archive["order"], read.order())


def test_the_overlay_is_saved(ball, tmp_path):
    ball.render.resolution_x, ball.render.resolution_y, ball.render.resolution_percentage = 80, 60, 50
    path = tmp_path / "overlay.png"
    assert bpy.ops.bih.render_overlay(filepath=str(path)) == {"FINISHED"}
    assert list(tmp_path.iterdir()) == [path]
    assert tuple(bpy.data.images.load(str(path)).size) == (40, 30)


def test_a_worker_stops_when_it_is_told_to():
    """And says what went wrong, in one line."""
    begun, go_on = threading.Event(), threading.Event()

    def work(told):
        begun.set()
        go_on.wait(10)
        if told("half", 0.5) is False:
            raise bihtree.Cancelled("cancelled")
        return 1

    stopped = Worker("test", work)
    begun.wait(10)
    stopped.cancel()
    go_on.set()
    stopped.wait()
    assert (stopped.is_done, stopped.result, stopped.error, stopped.share) == (True, None, "", 0.5)
    whole = Worker("test", work)
    whole.wait()
    assert whole.result == 1

    def wrong(told):
        raise UserError("what to do")

    failed = Worker("test", wrong)
    failed.wait()
    assert failed.error == "what to do"


def test_a_build_is_cancelled(ball):
    from addon.blender import build

    shown = contents(bpy.context.evaluated_depsgraph_get())
    worker = build.build_worker(shown, None, build.settings_of(ball))
    worker.cancel()
    worker.wait()
    assert worker.error == "" and (worker.result is None or worker.result.tree)


def test_the_tree_of_what_is_deleted_is_not_shown(ball):
    assert bpy.ops.bih.build() == {"FINISHED"}
    trees = TREES.of(ball)
    count = len(trees.sources)
    assert trees.is_there and trees.gone == 0 < count
    for found in [found for found in ball.objects if found.type == "MESH"]:
        bpy.data.objects.remove(found)
    bpy.context.view_layer.update()
    assert not trees.is_there and trees.gone == count
    assert trees.main is not None, "undo brings the objects back"


def test_what_is_gone_is_counted_only_when_objects_come_or_go(ball, monkeypatch):
    from addon.blender.trees import SceneTrees

    second = bpy.data.objects.new("Second", ball.objects[0].data)
    ball.collection.objects.link(second)
    assert bpy.ops.bih.build() == {"FINISHED"}
    counted, real = [], SceneTrees.count_gone
    monkeypatch.setattr(SceneTrees, "count_gone", lambda trees, scene: (counted.append(scene), real(trees, scene)))
    bpy.context.view_layer.update()
    counted.clear()
    second.location.x += 1.0
    second.data.vertices[0].co.x += 0.1
    second.data.update()
    bpy.context.view_layer.update()
    assert not counted
    ball.collection.objects.unlink(second)
    bpy.context.view_layer.update()
    assert counted and TREES.of(ball).gone == 1
    ball.collection.objects.link(second)
    bpy.context.view_layer.update()
    assert TREES.of(ball).gone == 0


def test_undo_brings_a_deleted_object_back_to_its_tree(ball):
    assert bpy.ops.bih.build() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="built")
    for found in [found for found in ball.objects if found.type == "MESH"]:
        bpy.data.objects.remove(found)
    bpy.ops.ed.undo_push(message="deleted")
    bpy.context.view_layer.update()
    assert not TREES.of(bpy.context.scene).is_there
    bpy.ops.ed.undo()
    assert TREES.of(bpy.context.scene).is_there and TREES.of(bpy.context.scene).gone == 0
