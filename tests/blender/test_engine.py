"""F12 in the wheel: what Blender saves of the Render Result is what the pipeline traced."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import bihtree
import bpy
import numpy as np
import OpenImageIO
import pytest
from bpy_extras.object_utils import world_to_camera_view
from numpy.typing import NDArray

from addon.blender import final_render
from addon.blender.engine import BihPreviewEngine
from addon.blender.final_render import Progress, bands
from addon.blender.panel_parts import draw_needs
from addon.blender.passes import blender_passes, wanted_passes
from addon.blender.scene_file import rendered_scene
from addon.pipeline import preview
from addon.pipeline.image import MISS_DEPTH
from addon.pipeline.settings import DEFAULT_PASSES, PARTS, Settings
from tests.blender.scenes import add, add_camera, add_light, add_mesh
from tests.meshes import icosphere

WIDTH, HEIGHT = 40, 30


@pytest.fixture
def ball(registered: bpy.types.Scene) -> bpy.types.Scene:
    """A ball to the upper left of the picture's middle, and two lights."""
    owner = add_mesh("Ball", icosphere(3))
    camera = add_camera((0.0, -6.0, 0.0))
    owner.location = (-0.8, 0.0, 0.6)
    add_light("SUN").rotation_euler = (0.4, 0.3, 0.0)
    add_light("POINT", (3.0, -4.0, 2.0), 200.0)
    registered.render.engine = "BIH_PREVIEW"
    registered.render.resolution_x, registered.render.resolution_y = WIDTH, HEIGHT
    assert registered.camera == camera
    return registered


def render(scene: bpy.types.Scene, folder: Path) -> dict[str, NDArray[np.float32]]:
    """Render Result by pass: (H, W, C) float32, the first row at the bottom."""
    output = scene.render.image_settings
    if hasattr(output, "media_type"):
        output.media_type = "MULTI_LAYER_IMAGE"
    output.file_format, output.color_depth = "OPEN_EXR_MULTILAYER", "32"
    scene.render.filepath = str(folder / "render.exr")
    assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
    return read(folder / "render.exr")


def read(path: Path) -> dict[str, NDArray[np.float32]]:
    passes: dict[str, dict[str, NDArray[np.float32]]] = {}
    file = OpenImageIO.ImageInput.open(str(path))
    part = 0
    while file.seek_subimage(part, 0):
        pixels = file.read_image(OpenImageIO.FLOAT).reshape(file.spec().height, file.spec().width, -1)[::-1]
        for index, channel in enumerate(file.spec().channelnames):
            name, _, letter = channel.rpartition(".")
            passes.setdefault(name, {})[letter] = pixels[..., index]
        part += 1
    file.close()
    return {
        name: np.stack([channels[letter] for letter in sorted(channels, key="RGBAXYZ".index)], axis=2)
        for name, channels in passes.items()
    }


def traced(scene: bpy.types.Scene, settings: Settings | None = None) -> dict[str, NDArray[np.generic]]:
    data, _ = rendered_scene(scene, WIDTH, HEIGHT)
    scene.render.engine = "BIH_PREVIEW"
    return preview.trace(data, settings or Settings()).passes


def joined(passes: dict[str, NDArray[np.float32]], name: str, layer: str = "ViewLayer") -> NDArray[np.float32]:
    return np.concatenate([passes[f"{layer}.{label}"] for label, _ in blender_passes(name)], axis=2)


def test_every_pass_is_what_the_pipeline_traced(ball, tmp_path):
    shown = render(ball, tmp_path)
    expected = traced(ball)
    assert np.isinf(expected["depth"]).any() and np.isfinite(expected["depth"]).any()
    for name in DEFAULT_PASSES:
        wanted = expected[name].astype(np.float32)
        if name == "depth":
            wanted[np.isinf(wanted)] = MISS_DEPTH
        np.testing.assert_array_equal(joined(shown, name), wanted, err_msg=name)


def test_the_picture_is_the_right_way_up(ball, tmp_path):
    """The pixel in which Blender sees the ball's nearest point holds it, its depth and its normal."""
    shown = render(ball, tmp_path)
    camera, centre = ball.camera, bpy.data.objects["Ball"].location
    towards = (camera.location - centre).normalized()
    seen = world_to_camera_view(ball, camera, centre + towards)
    column, row = int(seen.x * WIDTH), int(seen.y * HEIGHT)
    assert column < WIDTH / 2 < WIDTH - column and row > HEIGHT / 2
    pixel = {name: joined(shown, name)[row, column] for name in DEFAULT_PASSES}
    np.testing.assert_allclose(pixel["position"], centre + towards, atol=0.2)
    np.testing.assert_allclose(pixel["depth"], 6.0 + pixel["position"][1], atol=1e-4)
    assert pixel["normal"] @ np.array(towards) > 0.97
    assert 0 <= pixel["triangle"] < 20 * 4**3
    assert pixel["combined"][3] == 1 and (pixel["combined"][:3] > 0).all()
    assert joined(shown, "triangle")[0, -1] == -1 and (joined(shown, "combined")[0, -1] == 0).all()


def test_only_the_chosen_passes(ball, tmp_path):
    ball.bih.passes = {"normal"}
    assert set(render(ball, tmp_path)) == {"ViewLayer.Combined", "ViewLayer.Normal"}


def test_passes_that_the_view_layer_asks_for(ball, tmp_path):
    ball.bih.passes = {"combined"}
    layer = ball.view_layers[0]
    assert wanted_passes(layer, ball.bih.passes) == ("combined",)
    layer.use_pass_z = layer.use_pass_position = True
    shown = render(ball, tmp_path)
    assert set(shown) == {"ViewLayer.Combined", "ViewLayer.Depth", "ViewLayer.Position"}
    expected = traced(ball)
    hit = np.isfinite(expected["depth"])
    np.testing.assert_array_equal(joined(shown, "depth")[hit], expected["depth"][hit])


def test_samples_and_shadows_reach_the_trace(ball, tmp_path):
    ball.bih.samples, ball.bih.shadows = 4, False
    shown = joined(render(ball, tmp_path), "combined")
    expected = traced(ball, Settings(samples=4, shadows=False))["combined"]
    np.testing.assert_array_equal(shown, expected)
    assert (expected != traced(ball)["combined"]).any()


@pytest.mark.parametrize("crop", [False, True])
@pytest.mark.parametrize("border", [(0.25, 0.75, 0.4, 0.9), (0.31, 0.62, 0.07, 0.77)])
def test_a_border_shows_its_part_of_the_picture(ball, tmp_path, border, crop):
    expected = traced(ball)["combined"]
    shape = ball.render
    shape.use_border, shape.use_crop_to_border = True, crop
    shape.border_min_x, shape.border_max_x, shape.border_min_y, shape.border_max_y = border
    shown = joined(render(ball, tmp_path), "combined")
    left, right = (int(side * WIDTH + 1e-4) for side in border[:2])
    bottom, top = (int(side * HEIGHT + 1e-4) for side in border[2:])
    inside = expected[bottom:top, left:right]
    assert inside.any()
    if crop:
        np.testing.assert_array_equal(shown, inside)
    else:
        whole = np.zeros_like(expected)
        whole[bottom:top, left:right] = inside
        np.testing.assert_array_equal(shown, whole)


def test_each_view_layer_has_its_own_picture(ball, tmp_path):
    other = ball.view_layers.new("Without the ball")
    collection = bpy.data.collections.new("Box")
    ball.collection.children.link(collection)
    bpy.data.objects["Ball"].users_collection[0].objects.unlink(bpy.data.objects["Ball"])
    collection.objects.link(bpy.data.objects["Ball"])
    add_mesh("Cube")
    other.layer_collection.children["Box"].exclude = True
    shown = render(ball, tmp_path)
    both, alone = (joined(shown, "triangle", layer.name) for layer in ball.view_layers)
    assert both.max() >= 12 > alone.max() >= 0


def test_the_summary_is_kept_for_the_panel(ball, tmp_path):
    render(ball, tmp_path)
    assert len(BihPreviewEngine.last_summary) >= 5
    assert any("1,280 triangles" in line for line in BihPreviewEngine.last_summary)
    assert {part["part"] for part in BihPreviewEngine.last_needs} >= set(PARTS)


class Layout:
    """What a panel's layout is asked to show."""

    def __init__(self) -> None:
        self.shown: list[tuple[str, str]] = []

    def label(self, text: str, icon: str = "NONE") -> None:
        self.shown.append((text, icon))

    def box(self) -> Layout:
        return self

    def column(self, align: bool) -> Layout:
        return self


def test_the_panel_shows_what_the_scene_needed():
    wide = SimpleNamespace(
        region=SimpleNamespace(width=10_000), preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    )
    layout = Layout()
    draw_needs(layout, [], wide)
    assert layout.shown == []
    part = {"part": "shadow rays", "kept": False, "why": "no light", "saves": "9 rays"}
    draw_needs(layout, [part, {"part": "tree", "kept": True, "why": "9 triangles", "saves": ""}], wide)
    assert layout.shown[1:] == [
        ("Shadow rays", "CHECKBOX_DEHLT"),
        ("no light; saves 9 rays", "BLANK1"),
        ("Tree", "CHECKBOX_HLT"),
        ("9 triangles", "BLANK1"),
    ]


def fails_with(words: str) -> None:
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.render.render()
    assert words in str(caught.value) and len(str(caught.value).strip().splitlines()) == 1


def test_errors_are_reported(ball):
    ball.render.use_multiview = True
    fails_with("stereoscopic")
    ball.render.use_multiview = False
    ball.camera.data.type = "PANO"
    fails_with("panoramic")
    ball.camera.data.type = "PERSP"
    bpy.data.objects["Ball"].data.vertices[3].co.x = float("nan")
    fails_with("'Ball': vertex 3")
    bpy.data.objects.remove(bpy.data.objects["Ball"])
    add("Empty", None)
    fails_with("no mesh")
    add_mesh("Cube")
    assert bpy.ops.render.render() == {"FINISHED"}


def test_a_bug_is_reported_too(ball, monkeypatch):
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(final_render.prepared, "prepare", broken)
    fails_with("ZeroDivisionError: a bug")


def test_progress_and_cancel(ball, monkeypatch):
    seen: list[tuple[str, float]] = []

    def stop(_: object, stage: str, fraction: float) -> bool:
        seen.append((stage, fraction))
        return stage != "trace"

    def shown(*_: object) -> None:
        raise AssertionError("a cancelled render shows nothing")

    monkeypatch.setattr(Progress, "__call__", stop)
    monkeypatch.setattr(final_render, "_show", shown)
    assert bpy.ops.render.render() == {"FINISHED"}
    assert {stage for stage, _ in seen} == {"export", "build", "trace"}
    assert all(0 <= fraction <= 1 for _, fraction in seen)


def test_progress_is_shown_and_escape_stops():
    class Blender:
        """Blender's side of an engine: its own functions cannot be replaced in one."""

        escape = False

        def update_stats(self, *texts: str) -> None:
            self.texts = texts

        def update_progress(self, fraction: float) -> None:
            self.fraction = fraction

        def test_break(self) -> bool:
            return self.escape

    blender = Blender()
    progress = Progress(blender)
    assert progress("trace", 0.0) is True
    assert blender.texts == ("BIH Preview", "Trace 0%")
    assert progress.part(0.5, 0.25)(1.0) is True
    assert blender.texts[1].startswith("Trace 75% | Time left 00:0") and blender.fraction == 0.75
    blender.escape = True
    assert progress("trace", 0.5) is False


@pytest.mark.parametrize("area", [(0, 0, 5, 1), (3, 7, 11, 31), (0, 0, 2, 32), (4, 1, 9, 1000)])
def test_bands_are_all_of_the_area_once(area):
    parts = list(bands(area))
    rows = [y for (_, y, _, height), _, _ in parts for y in range(y - area[1], y - area[1] + height)]
    assert rows == list(range(area[3])) and len(parts) <= 32
    assert {(x, width) for (x, _, width, _), _, _ in parts} == {(area[0], area[2])}
    assert [done for _, done, _ in parts] == pytest.approx(np.cumsum([0, *(share for *_, share in parts)])[:-1])


def test_many_instances_have_few_bands():
    area = (0, 0, 64, 100)
    for instances, expected in ((0, 25), (1, 25), (1_000_000, 4), (3 * final_render.MOST_LOOKS, 1)):
        found = list(bands(area, instances))
        assert len(found) == expected
        assert sum(tile[3] for tile, _, _ in found) == 100


def test_only_the_border_is_traced(ball, monkeypatch):
    traced_tiles: list[tuple[int, ...]] = []
    real = bihtree.render

    def noted(*arguments: object, **options: object) -> dict[str, NDArray[np.generic]]:
        traced_tiles.append(options["tile"])
        return real(*arguments, **options)

    monkeypatch.setattr(bihtree, "render", noted)
    shape = ball.render
    shape.use_border = True
    shape.border_min_x, shape.border_max_x, shape.border_min_y, shape.border_max_y = 0.25, 0.75, 0.4, 0.9
    assert bpy.ops.render.render() == {"FINISHED"}
    assert sum(width * height for _, _, width, height in traced_tiles) == 20 * 15


def test_the_resolution_scale_is_that_of_the_picture(ball, tmp_path):
    ball.render.resolution_percentage = 50
    small = joined(render(ball, tmp_path), "triangle")
    assert small.shape[:2] == (HEIGHT // 2, WIDTH // 2) and small.max() > 0


class Frames:
    """How many trees each frame of an animation builds, counted after it."""

    def __init__(self) -> None:
        self.built: list[int] = []

    def __call__(self, *_: object) -> None:
        self.built.append(sum(kept.trees.built for kept in BihPreviewEngine.kept.values()))


def animation(scene: bpy.types.Scene, folder: Path) -> list[int]:
    """Trees built after each of four frames."""
    frames = Frames()
    scene.frame_start, scene.frame_end = 1, 4
    scene.render.filepath = str(folder / "frame")
    scene.render.image_settings.file_format = "PNG"
    bpy.app.handlers.render_post.append(frames)
    try:
        assert bpy.ops.render.render(animation=True) == {"FINISHED"}
    finally:
        bpy.app.handlers.render_post.remove(frames)
    assert BihPreviewEngine.kept == {}, "nothing is kept after the last frame"
    return frames.built


@pytest.mark.parametrize("persistent", [False, True])
def test_a_frame_builds_only_what_has_changed(ball, tmp_path, persistent):
    """The camera and a box move in each frame; the ball's mesh changes once, before the third one."""
    ball.render.use_persistent_data = persistent
    box = add_mesh("Box")
    for frame in (1, 4):
        box.location = (0.1 * frame, 2.0, 0.2 * frame)
        box.keyframe_insert("location", frame=frame)
        ball.camera.location.x = 0.1 * frame
        ball.camera.keyframe_insert("location", frame=frame)
    key = bpy.data.objects["Ball"].shape_key_add(name="Basis") and bpy.data.objects["Ball"].shape_key_add(name="Up")
    for point in key.data:
        point.co.z *= 1.5
    for frame, value in ((2, 0.0), (3, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=frame)
    assert animation(ball, tmp_path) == [2, 2, 3, 3]
    pictures = [(tmp_path / f"frame{number:04}.png").read_bytes() for number in range(1, 5)]
    assert len(set(pictures)) == 4
