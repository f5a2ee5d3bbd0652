"""The colours of a lit scene beside those of Cycles, in linear light and through Blender's view transform."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.blender import command_line
from addon.blender.display import Display
from addon.pipeline.image import read_image
from tests.blender.lit_scene import add_lit_scene

WIDTH, HEIGHT = 64, 48


@pytest.fixture
def lit(registered: bpy.types.Scene) -> bpy.types.Scene:
    add_lit_scene(registered)
    registered.render.resolution_x, registered.render.resolution_y = WIDTH, HEIGHT
    registered.render.dither_intensity = 0.0
    chosen = registered.bih
    chosen.samples, chosen.soft_shadows, chosen.ambient_occlusion, chosen.passes = 64, True, True, {"combined"}
    return registered


def saved(scene: bpy.types.Scene, engine: str, file: Path) -> NDArray[np.generic]:
    """What Blender saves of a render; EXR as float32, PNG as uint8."""
    output = scene.render.image_settings
    output.file_format, output.color_depth = ("OPEN_EXR", "32") if file.suffix == ".exr" else ("PNG", "8")
    output.color_mode = "RGBA"
    scene.render.engine, scene.render.filepath = engine, str(file)
    bpy.ops.render.render(write_still=True)
    return read_image(file)


def by_cycles(scene: bpy.types.Scene) -> None:
    """Light that has met one surface, as much of it as there is; no filter wider than a pixel."""
    cycles = scene.cycles
    cycles.samples, cycles.max_bounces, cycles.use_denoising, cycles.use_adaptive_sampling = 64, 0, False, False
    cycles.pixel_filter_type = "BOX"


def test_the_picture_is_that_of_cycles_with_one_bounce(lit, tmp_path):
    by_cycles(lit)
    ours, theirs = (saved(lit, engine, tmp_path / f"{engine}.exr") for engine in ("BIH_PREVIEW", "CYCLES"))
    difference = np.abs(ours - theirs)[..., :3]
    assert difference.mean() < 0.02 * theirs[..., :3].mean()
    # Each colour on its own: no light has another unit, no material another reflectance.
    means = ours.mean(axis=(0, 1)) / theirs.mean(axis=(0, 1))
    np.testing.assert_allclose(means, 1.0, rtol=0.01)
    assert np.quantile(difference, 0.95) < 0.05
    seen = [saved(lit, engine, tmp_path / f"{engine}.png") for engine in ("BIH_PREVIEW", "CYCLES")]
    levels = np.abs(seen[0].astype(int) - seen[1].astype(int))
    assert levels[..., :3].mean() < 2.0


@pytest.mark.parametrize("kind", ["AREA", "SUN", "POINT", "SPOT"])
def test_each_light_is_that_of_cycles(lit, tmp_path, kind):
    by_cycles(lit)
    background = next(node for node in lit.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 0.0
    for owner in [owner for owner in lit.objects if owner.type == "LIGHT" and owner.data.type != kind]:
        bpy.data.objects.remove(owner)
    ours, theirs = (saved(lit, engine, tmp_path / f"{engine}.exr") for engine in ("BIH_PREVIEW", "CYCLES"))
    assert theirs[..., :3].mean() > 0.005
    np.testing.assert_allclose(ours[..., :3].mean(), theirs[..., :3].mean(), rtol=0.02)
    assert np.abs(ours - theirs)[..., :3].mean() < 0.06 * theirs[..., :3].mean()


@pytest.mark.parametrize("transparent", [False, True])
def test_a_display_makes_what_blender_saves(lit, tmp_path, transparent):
    lit.bih.samples, lit.render.film_transparent = 4, transparent
    lit.view_settings.exposure = 0.5
    linear = saved(lit, "BIH_PREVIEW", tmp_path / "a.exr").astype(np.float32)
    expected = saved(lit, "BIH_PREVIEW", tmp_path / "a.png")
    before = lit.render.image_settings.file_format, lit.render.dither_intensity
    np.testing.assert_array_equal(Display(lit)(linear), expected)
    assert before == (lit.render.image_settings.file_format, lit.render.dither_intensity)
    assert (expected[..., 3].min() == 255) is not transparent


def test_the_command_line_writes_what_blender_saves(lit, tmp_path):
    lit.bih.samples = 4
    lit.view_settings.exposure = -0.5
    expected = saved(lit, "BIH_PREVIEW", tmp_path / "a.png")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    arguments = ["render", "--scene", str(tmp_path / "a.blend"), "--output", str(tmp_path / "b.png")]
    assert command_line.execute([*arguments, "--output", str(tmp_path / "b.jpg")]) == 0
    np.testing.assert_array_equal(read_image(tmp_path / "b.png"), expected)
    assert read_image(tmp_path / "b.jpg").shape == (HEIGHT, WIDTH, 3)


def test_the_command_line_has_the_choices_of_the_panel(lit, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    arguments = ["render", "--scene", str(tmp_path / "a.blend"), "--samples", "1", "--passes", "combined"]
    kept = {}
    for name, options in {
        "as saved": [],
        "headlight": ["--shading", "headlight", "--no-smooth"],
        "hard": ["--no-ambient-occlusion", "--no-soft-shadows", "--no-shadows"],
        "distance": ["--no-ambient-occlusion", "--ambient-occlusion-distance", "2"],
    }.items():
        files = ["--output", str(tmp_path / f"{name}.exr"), "--stats", str(tmp_path / "a.json")]
        assert command_line.execute([*arguments, *options, *files]) == 0
        parts = json.loads((tmp_path / "a.json").read_text())["needs"]
        kept[name] = {part["part"] for part in parts if part["kept"]}
    shading = {"shadow rays", "ambient occlusion", "smooth normals"}
    assert {name: parts & shading for name, parts in kept.items()} == {
        "as saved": shading,
        "headlight": {"ambient occlusion"},
        "hard": {"smooth normals"},
        "distance": {"shadow rays", "smooth normals"},
    }
    pictures = {name: read_image(tmp_path / f"{name}.exr").tobytes() for name in kept}
    assert len(set(pictures.values())) == len(pictures)
