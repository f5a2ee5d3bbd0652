"""The command as a person runs it: what it writes, and what it says when it cannot."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO
import pytest

from addon.blender import command_line, job
from addon.pipeline.settings import PARTS, PASSES
from tests.blender.commands import pixels, run
from tests.blender.scenes import add, add_camera, add_light, add_mesh
from tests.meshes import icosphere


def save(path: Path) -> Path:
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 64, 48
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def blend(scene: bpy.types.Scene, tmp_path: Path) -> Path:
    """A ball that is at the origin in frame 1 and out of sight in frame 11."""
    ball = add_mesh("Ball", icosphere(3))
    ball.keyframe_insert("location", frame=1)
    ball.location = (100, 0, 0)
    ball.keyframe_insert("location", frame=11)
    add_camera()
    add_light("SUN")
    scene.frame_set(1)
    (tmp_path / "in").mkdir()
    return save(tmp_path / "in" / "ball.blend")


def test_all_outputs_at_once(blend, out):
    done = run(
        "render", "--scene", blend, "--output", out / "a.png", "--output", out / "a.exr",
        "--overlay", out / "overlay.png", "--stats", out / "a.json",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(path.name for path in out.iterdir()) == ["a.exr", "a.json", "a.png", "overlay.png"]
    summary, table = (part.splitlines() for part in done.stdout.split("\n\n"))
    for word in ("export", "build", "trace", "bytes a triangle", "a second"):
        assert len([line for line in summary if word in line]) == 1
    for part in PARTS:
        assert len([line for line in table if line.startswith(f"{part}  ")]) == 1
    picture = pixels(out / "a.png")
    assert picture.shape == (48, 64, 4)
    covered = picture[..., 3] > 0
    # the ball, in front of the camera's middle, is a disc of tangent rays: sin of its half angle is radius / distance
    distance = np.sqrt(4**2 + 5**2 + 3**2)
    across = 64 / 36 * 50 * np.tan(np.arcsin(1 / distance))
    assert covered.sum() == pytest.approx(np.pi * across**2, rel=0.03)
    assert pixels(out / "overlay.png").shape[:2] == (48, 64)
    report = json.loads((out / "a.json").read_text())
    assert (report["triangles"], report["width"], report["height"]) == (20 * 4**3, 64, 48)


def test_frame_and_size(blend, out):
    for frame, shown in ((1, True), (11, False), (-40, True)):
        picture = out / f"{frame}.png"
        done = run("render", "--scene", blend, "--output", picture, "--frame", frame, "--size", 32, 20)
        assert (done.returncode, done.stderr) == (0, "")
        assert pixels(picture).shape == (20, 32, 4)
        assert (pixels(picture)[..., 3] > 0).any() == shown


def test_one_pixel(blend, out):
    assert run("render", "--scene", blend, "--output", out / "a.png", "--size", 1, 1).returncode == 0
    assert pixels(out / "a.png").shape == (1, 1, 4)


def test_the_scenes_own_choice_and_the_commands(registered, out, tmp_path):
    add_mesh("Ball", icosphere(1))
    add_camera()
    registered.bih.passes, registered.bih.samples = {"combined", "normal"}, 3
    blend = save(tmp_path / "chosen.blend")
    stats = out / "a.json"
    run("render", "--scene", blend, "--output", out / "a.exr", "--stats", stats)
    assert json.loads(stats.read_text())["samples"] == 3
    assert layers(out / "a.exr") == {"combined", "normal"}
    run("render", "--scene", blend, "--output", out / "a.exr", "--stats", stats, "--passes", "depth,cost",
        "--samples", 2, "--threads", 1)  # fmt: skip
    assert (json.loads(stats.read_text())["samples"], json.loads(stats.read_text())["threads"]) == (2, 1)
    assert layers(out / "a.exr") == {"depth", "cost"}


def layers(path: Path) -> set[str]:
    """The passes of PASSES that an EXR holds."""
    file = OpenImageIO.ImageInput.open(str(path))
    names, part = [], 0
    while file.seek_subimage(part, 0):
        names += [name.lower() for name in file.spec().channelnames]
        part += 1
    file.close()
    return {name for name in PASSES if any(name in channel for channel in names)}


def test_a_picture_in_place_of_an_old_one(blend, out):
    (out / "a.png").write_text("old")
    assert run("render", "--scene", blend, "--output", out / "a.png").returncode == 0
    assert pixels(out / "a.png").shape == (48, 64, 4)


def test_scripts_of_a_file_do_not_run(scene, out, tmp_path):
    add_mesh("Ball")
    add_camera()
    text = bpy.data.texts.new("autorun.py")
    text.from_string(f"open({str(out / 'ran')!r}, 'w')")
    text.use_module = True
    blend = save(tmp_path / "script.blend")
    assert run("render", "--scene", blend, "--output", out / "a.png").returncode == 0
    assert [path.name for path in out.iterdir()] == ["a.png"]


@pytest.mark.parametrize("suffix", [".npz", ".obj"])
def test_a_mesh_in_place_of_a_scene(scene, out, tmp_path, suffix):
    mesh = icosphere(2)
    path = tmp_path / f"ball{suffix}"
    if suffix == ".npz":
        np.savez(path, vertices=mesh.vertices, triangles=mesh.triangles)
    else:
        add_mesh("Ball", mesh)
        bpy.ops.wm.obj_export(filepath=str(path))
    done = run("render", "--mesh", path, "--output", out / "a.png", "--stats", out / "a.json")
    assert (done.returncode, done.stderr) == (0, "")
    picture = pixels(out / "a.png")
    assert picture.shape == (720, 1280, 4)
    covered = picture[..., 3] > 0
    assert covered[360, 640] and not covered[[0, -1]].any() and not covered[:, [0, -1]].any()
    assert json.loads((out / "a.json").read_text())["triangles"] == len(mesh.triangles)


def test_an_npz_needs_no_blender(out, tmp_path):
    path = tmp_path / "ball.npz"
    np.savez(path, vertices=icosphere(1).vertices, triangles=icosphere(1).triangles)
    done = run("render", "--mesh", path, "--output", out / "a.png", "--size", 8, 6, command=without("bpy"))
    assert (done.returncode, done.stderr) == (0, "")


def without(module: str) -> list[str]:
    """The command on a machine where `module` is not installed."""
    start = "import sys; sys.modules[sys.argv.pop(1)] = None; from addon.blender.command_line import execute; "
    return [sys.executable, "-c", start + "sys.exit(execute(sys.argv[1:]))", module]


@pytest.mark.parametrize("module", ["numpy", "bihtree", "bpy", "OpenImageIO"])
def test_what_is_missing_is_named(blend, out, module):
    done = run("render", "--scene", blend, "--output", out / "a.png", command=without(module))
    is_one_line(done, 1, module, "install" if module != "bihtree" else "Install")
    assert not list(out.iterdir())


def is_one_line(done: subprocess.CompletedProcess[str], status: int, *words: str) -> None:
    assert done.returncode == status, done.stderr
    assert len(done.stderr.splitlines()) == 1 and done.stderr.startswith("bih: "), done.stderr
    for word in words:
        assert word in done.stderr
    assert done.stdout == ""


WRONG_USAGE = {
    "nothing": ([], "required"),
    "no such command": (["paint"], "paint"),
    "no source": (["render", "--output", "a.png"], "--scene"),
    "two sources": (["render", "--scene", "a.blend", "--mesh", "b.npz", "--output", "a.png"], "--mesh"),
    "no output": (["render", "--scene", "a.blend"], "--output"),
    "no such option": (["render", "--scene", "a.blend", "--output", "a.png", "--fast"], "--fast"),
    "size 0": (["render", "--scene", "a.blend", "--output", "a.png", "--size", "0", "10"], "--size"),
    "size negative": (["render", "--scene", "a.blend", "--output", "a.png", "--size", "10", "-5"], "--size"),
    "size in words": (["render", "--scene", "a.blend", "--output", "a.png", "--size", "ten", "10"], "'ten'"),
    "one size": (["render", "--scene", "a.blend", "--output", "a.png", "--size", "10"], "--size"),
    "unknown pass": (["render", "--scene", "a.blend", "--output", "a.png", "--passes", "depth,mist"], "'mist'"),
    "no pass": (["render", "--scene", "a.blend", "--output", "a.png", "--passes", ","], "pass"),
    "samples 0": (["render", "--scene", "a.blend", "--output", "a.png", "--samples", "0"], "samples is 0"),
    "threads": (["render", "--scene", "a.blend", "--output", "a.png", "--threads", "-1"], "threads is -1"),
    "overlay depth": (["render", "--scene", "a.blend", "--output", "a.png", "--overlay-depth", "-1"], "overlay depth"),
    "frame": (["render", "--scene", "a.blend", "--output", "a.png", "--frame", "1e3"], "'1e3'"),
    "frame of no calendar": (["render", "--scene", "a.blend", "--output", "a.png", "--frame", "9999999999"], "--frame"),
}


@pytest.mark.parametrize(("arguments", "words"), WRONG_USAGE.values(), ids=WRONG_USAGE)
def test_wrong_usage(arguments, words):
    is_one_line(run(*arguments), 2, words)


def test_help_is_no_error():
    done = run("render", "--help")
    assert (done.returncode, done.stderr) == (0, "")
    assert "--overlay-depth" in done.stdout


@pytest.mark.parametrize(
    ("name", "status"),
    [("none/a.png", 1), ("", 1), ("a.xyzzy", 2), ("a", 2)],
    ids=["no folder", "a folder", "unknown ending", "no ending"],
)
@pytest.mark.parametrize("option", ["--output", "--overlay"])
def test_outputs_are_checked_before_the_scene(out, option, name, status):
    """The scene is not there either: that would be the next thing to say."""
    arguments = ["--output", out / "good.png"] if option == "--overlay" else []
    done = run("render", "--scene", out / "none.blend", *arguments, option, out / name)
    is_one_line(done, status, str(out / name))
    assert not list(out.iterdir())


def test_stats_in_a_folder_that_is_not_there(blend, out):
    done = run("render", "--scene", blend, "--output", out / "a.png", "--stats", out / "none" / "a.json")
    is_one_line(done, 1, str(out / "none"))
    assert not list(out.iterdir())


BROKEN_FILES = {
    "text": b"this is no scene",
    "empty": b"",
    "picture": b"\x89PNG\r\n\x1a\n" + bytes(100),
    "header only": b"BLENDER-v402",
    "cut short": b"BLENDER-v402REND" + bytes(50),
    "compressed nonsense": b"\x28\xb5\x2f\xfd" + bytes(range(90)),
    "gzip nonsense": b"\x1f\x8b" + bytes(range(90)),
}


@pytest.mark.parametrize("content", BROKEN_FILES.values(), ids=BROKEN_FILES)
def test_a_file_that_is_no_scene(out, tmp_path, content):
    path = tmp_path / "broken.blend"
    path.write_bytes(content)
    is_one_line(run("render", "--scene", path, "--output", out / "a.png"), 1, str(path))
    assert not list(out.iterdir())


def test_a_scene_cut_in_half(blend, out, tmp_path):
    path = tmp_path / "half.blend"
    path.write_bytes(blend.read_bytes()[: blend.stat().st_size // 2])
    is_one_line(run("render", "--scene", path, "--output", out / "a.png"), 1, str(path))
    assert not list(out.iterdir())


def test_a_scene_that_is_not_there(out, tmp_path):
    is_one_line(run("render", "--scene", tmp_path / "no.blend", "--output", out / "a.png"), 1, "no.blend")
    is_one_line(run("render", "--scene", tmp_path, "--output", out / "a.png"), 1, str(tmp_path))


def no_camera() -> None:
    add_mesh("Ball")


def no_mesh() -> None:
    add_camera()
    add("Empty", None)


def empty() -> None:
    pass


def hidden() -> None:
    add_camera()
    add_mesh("Ball").hide_render = True


def not_finite() -> None:
    add_camera()
    add_mesh("Broken").data.vertices[2].co.z = float("nan")


def panoramic() -> None:
    add_camera().data.type = "PANO"
    add_mesh("Ball")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (no_camera, "no camera"),
        (no_mesh, "no mesh"),
        (empty, "no camera"),
        (hidden, "no mesh"),
        (not_finite, "'Broken': vertex 2"),
        (panoramic, "panoramic"),
    ],
)
def test_a_scene_that_cannot_be_traced(scene, out, tmp_path, make, words):
    make()
    path = save(tmp_path / "scene.blend")
    done = run(
        "render", "--scene", path, "--output", out / "a.png", "--overlay", out / "o.png", "--stats", out / "a.json"
    )
    is_one_line(done, 1, words)
    assert not list(out.iterdir())


def test_meshes_that_cannot_be_traced(out, tmp_path):
    corner = np.eye(3, dtype=np.float32)
    face = np.array([[0, 1, 2]], np.int32)
    nan = corner.copy()
    nan[1, 1] = np.nan
    for vertices, triangles, words in (
        (nan, face, "vertex 1"),
        (corner, face + 1, "triangle 0"),
        (corner, face[:0], "no tri"),
    ):
        path = tmp_path / "mesh.npz"
        np.savez(path, vertices=vertices, triangles=triangles)
        is_one_line(run("render", "--mesh", path, "--output", out / "a.png"), 1, words)
    (tmp_path / "bad.obj").write_text("nonsense")
    is_one_line(run("render", "--mesh", tmp_path / "bad.obj", "--output", out / "a.png"), 1, "bad.obj")
    is_one_line(run("render", "--mesh", tmp_path / "no.ply", "--output", out / "a.png"), 1, "no.ply")
    is_one_line(run("render", "--mesh", tmp_path / "bad.xyzzy", "--output", out / "a.png"), 1, "bad.xyzzy")
    assert not list(out.iterdir())


@pytest.mark.parametrize("at", ["build", "trace", "overlay", "write"])
def test_an_interrupt_leaves_nothing(blend, out, monkeypatch, capsys, at):
    def interrupt(stage: str, fraction: float) -> None:
        if stage == at:
            raise KeyboardInterrupt

    monkeypatch.setattr(job, "_go_on", interrupt)
    arguments = ["render", "--scene", blend, "--output", out / "a.png", "--overlay", out / "o.png"]
    assert command_line.execute([str(argument) for argument in arguments]) == 130
    assert capsys.readouterr().err == "bih: interrupted\n"
    assert not list(out.iterdir())


def test_hair_and_the_like_are_named(scene, out, tmp_path):
    add_camera()
    add_mesh("Ball")
    add("Smoke", bpy.data.volumes.new("Smoke"))
    done = run(
        "render", "--scene", save(tmp_path / "smoke.blend"), "--output", out / "a.png", "--stats", out / "a.json"
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(r"'Smoke' is a volume", done.stdout)
    assert "'Smoke'" in json.loads((out / "a.json").read_text())["skipped"][0]


def test_a_missing_linked_file_is_named(scene, out, tmp_path):
    add_mesh("Linked", icosphere(0))
    library = save(tmp_path / "library.blend")
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    add_camera()
    add_mesh("Ball")
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.objects = ["Linked"]
    bpy.context.scene.collection.objects.link(wanted.objects[0])
    path = save(tmp_path / "scene.blend")
    library.unlink()
    done = run("render", "--scene", path, "--output", out / "a.png")
    assert (done.returncode, done.stderr) == (0, "")
    assert "library.blend is missing" in done.stdout
