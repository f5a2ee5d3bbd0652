"""The report from the command line and from the panel's button, under the bpy wheel."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.blender import bvh_tree, command_line
from addon.blender.background import report_worker
from addon.pipeline.camera import framing_view
from addon.pipeline.mesh import Mesh, bounds_of
from addon.pipeline.scene import SceneData
from addon.pipeline.settings import Settings
from addon.report.error.options import Options
from addon.report.error.rays import Rays
from addon.report.error.subject import Subject
from addon.report.error.truth import Truth
from tests.blender.commands import COMMAND, ROOT, environment, run
from tests.blender.scenes import add_camera, add_mesh
from tests.meshes import icosphere
from tests.rays import around

HITS = ("--only", "hits", "--rays", 100, "--rounds", 1)


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    path = tmp_path / "ball.npz"
    ball = icosphere(2)
    np.savez(path, vertices=ball.vertices, triangles=ball.triangles)
    return path


def test_a_scene_a_mesh_and_a_built_in_one(scene, tmp_path, mesh):
    add_mesh("Ball", icosphere(2))
    add_camera()
    blend = tmp_path / "ball.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    sources = (("--scene", blend), ("--mesh", mesh), ("--built-in", "soup", "--triangles", 300, "--offset", 1e6))
    for number, source in enumerate(sources):
        done = run("report", *source, *HITS, "--output", tmp_path / str(number), "--max-wrong", 0, "--max-leaks", 0)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / str(number) / "index.html").exists()
        assert "BIH watertight" in done.stdout and " % " in done.stderr
        read = json.loads((tmp_path / str(number) / "results.json").read_text())
        rows = {row["name"]: row for row in read["hits"]["rows"]}
        assert rows["Blender's BVHTree"]["rays"] == rows["BIH watertight"]["rays"] > 90
        assert read["vertex_precision"] == ("float64" if number == 2 else "float32")


def test_errors_are_one_line(scene, tmp_path, mesh):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "empty.blend"))
    add_camera()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "camera.blend"))
    for status, words in (
        (1, ("--scene", tmp_path / "empty.blend", "--output", tmp_path / "a")),
        (1, ("--scene", tmp_path / "camera.blend", "--output", tmp_path / "a")),
        (1, ("--mesh", mesh, "--output", "/proc/self/fd")),
        (1, ("--mesh", tmp_path / "none.npz", "--output", tmp_path / "a")),
        (2, ("--mesh", mesh, "--output", tmp_path / "a", "--rays", 3)),
        (2, ("--built-in", "roof", "--output", tmp_path / "a")),
        (2, ("--output", tmp_path / "a")),
    ):
        done = run("report", *words)
        assert (done.returncode, len(done.stderr.splitlines())) == (status, 1), done.stderr
        assert done.stderr.startswith("bih: ") and not done.stdout
    assert not (tmp_path / "a").exists()


def test_ctrl_c_keeps_what_is_measured(tmp_path, mesh):
    command = [*COMMAND, "report", "--mesh", mesh, "--rays", 400, "--rounds", 500, "--output", tmp_path / "out"]
    process = subprocess.Popen(
        [*map(str, command)], cwd=ROOT, env=environment(), stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    for line in process.stderr:
        if "round 2" in line:
            break
    os.kill(process.pid, signal.SIGINT)
    _, rest = process.communicate(timeout=120)
    assert process.returncode == 130, rest
    assert "interrupted; " in rest.splitlines()[-1]
    assert "Incomplete: interrupted" in (tmp_path / "out" / "index.html").read_text()
    assert json.loads((tmp_path / "out" / "results.json").read_text())["hits"]["rows"][1]["rays"]


def test_a_bar_that_is_missed_is_exit_status_3(mesh, tmp_path, monkeypatch, capsys):
    from addon.report.error import report

    monkeypatch.setattr(report, "missed_bar", lambda results, options: "BIH watertight: 2 leaks of 9 rays")
    words = ["report", "--mesh", str(mesh), *map(str, HITS), "--output", str(tmp_path / "out")]
    assert command_line.execute(words) == 3
    assert capsys.readouterr().err.splitlines()[-1] == "bih: BIH watertight: 2 leaks of 9 rays"


def test_blenders_tree_is_asked_as_it_should_be():
    ball = icosphere(3)
    rays = around(ball, 200, np.random.default_rng(1))
    truth = Truth(*ball).nearest(*rays)
    found = bvh_tree.BlenderTree().build(Mesh("ball", *ball)).trace(Rays(*rays))
    assert (found.triangle == truth.triangle).mean() > 0.97
    same = (found.triangle == truth.triangle) & truth.hit
    assert np.allclose(found.t[same], truth.t[same], rtol=1e-5)


def test_the_button_writes_a_page(registered, tmp_path):
    with pytest.raises(RuntimeError, match="no triangles"):
        bpy.ops.bih.report(only="left-out", folder=str(tmp_path))
    add_mesh("Ball", icosphere(2))
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.bih.report(only="left-out", folder=str(tmp_path))
    add_camera()
    assert bpy.ops.bih.report(only="left-out", folder=str(tmp_path)) == {"FINISHED"}
    assert "What was left out" in (tmp_path / "index.html").read_text()


def test_in_the_background_it_can_be_cancelled(tmp_path):
    ball = icosphere(2)
    scene = SceneData.of_mesh(Mesh("ball", *ball), framing_view(bounds_of(ball.vertices), 40, 30))
    going = report_worker(Subject(scene, Settings(), "ball"), Options(rays=100, rounds=500), tmp_path)
    going.cancel()
    going.wait()
    assert going.is_done and not going.error
    assert "Incomplete: cancelled" in going.result.read_text()
    failed = report_worker(Subject(scene, Settings(), "ball"), Options(), Path("/proc/self/fd"))
    failed.wait()
    assert "cannot write into" in failed.error and failed.result is None
