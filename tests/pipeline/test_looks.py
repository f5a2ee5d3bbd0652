"""What bihtree.render is given of a scene's looks, and that the picture shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.pipeline import looks, preview
from addon.pipeline.camera import framing_view
from addon.pipeline.errors import UserError
from addon.pipeline.mesh import Mesh
from addon.pipeline.scene import HIDDEN, LIGHT_DTYPE, OBJECT_DTYPE, POINT, SUN, SURFACE_DTYPE, SceneData
from addon.pipeline.settings import PASSES, Settings
from benchmarks.needs import differing
from benchmarks.needs_scenes import Case
from tests import meshes

BALL = meshes.icosphere(2)
SMOOTH = Mesh("Smooth", *BALL, corner_normals=BALL.vertices[BALL.triangles])
PAINTED = Mesh("Painted", *BALL, materials=(np.arange(len(BALL.triangles)) % 2).astype(np.int32))


def scene(**changed: object) -> SceneData:
    """A smooth ball, a painted one beside it and a smooth mirrored one, a lamp with a size, and a world."""
    matrices = np.stack([np.eye(4)] * 3)
    matrices[1, 0, 3], matrices[2, 0, 3] = 2.5, -2.5
    matrices[2, :3, :3] = [[-1, 0.5, 0], [0, 0.5, 0], [0, 0, 2]]
    objects = np.zeros(3, OBJECT_DTYPE)
    objects["first_surface"], objects["index"] = (0, 1, 0), (5, 6, 7)
    surfaces = np.zeros(3, SURFACE_DTYPE)
    surfaces["base"], surfaces["index"] = [(0.5, 0.5, 0.5), (1, 0, 0), (0, 1, 0)], (1, 2, 3)
    lamp = np.zeros(1, LIGHT_DTYPE)
    lamp["kind"], lamp["position"], lamp["size"], lamp["colour"] = POINT, (0, -6, 6), (1, 0), 900
    view = framing_view(np.array([[-3.5, -1, -2], [3.5, 1, 2.0]]), 48, 32)
    rows = np.array([0, 1, 0], np.int32)
    made = SceneData([SMOOTH, PAINTED], rows, matrices, "balls", view, lamp, (), surfaces, objects, (0.1, 0.2, 0.3))
    return replace(made, **changed)  # type: ignore[arg-type]


def combined(of: SceneData, settings: Settings | None = None) -> np.ndarray:
    return preview.trace(of, settings or Settings(), outputs=preview.Outputs()).passes["combined"]


def test_each_part_kept_or_left_out_gives_the_same_bits() -> None:
    settings = Settings(passes=PASSES, samples=2, soft_shadows=True, ambient_occlusion=True)
    for chosen in (settings, replace(settings, smooth=False, ambient_occlusion=False, passes=("depth", "instance"))):
        assert list(differing(Case(scene(), chosen))) == []


def test_normals_are_turned_as_surfaces_are() -> None:
    """By the inverse transpose, up to their length and, where the matrix mirrors, their sign."""
    matrix = np.eye(4)
    matrix[:3, :3] = [[-1, 0.5, 0], [0.25, 2, 0], [0, 0.125, 3]]
    turned = looks.turned(SMOOTH, matrix).astype(np.float64)
    expected = SMOOTH.corner_normals @ np.linalg.inv(matrix[:3, :3])
    turned /= np.linalg.norm(turned, axis=2, keepdims=True)
    expected = -expected / np.linalg.norm(expected, axis=2, keepdims=True)
    np.testing.assert_allclose(turned, expected, atol=1e-6)
    flat = np.diag([1.0, 1, 0, 1])
    assert np.isfinite(looks.turned(SMOOTH, flat)).all()
    assert np.isfinite(looks.turned(SMOOTH, np.diag([1e30, 1e30, 1e30, 1]))).all()


def test_rows_for_a_flattened_scene() -> None:
    of = scene()
    count = len(BALL.triangles)
    rows = looks.objects(of, ("combined",), has_surfaces=True)
    assert rows is not None
    assert rows["first_triangle"].tolist() == [0, count, 2 * count]
    assert rows["first_surface"].tolist() == [0, 1, 0]
    slots = looks.materials(of)
    assert slots is not None
    assert slots.tolist() == [0] * count + PAINTED.materials.tolist() + [0] * count  # type: ignore[union-attr]
    normals = looks.corner_normals(of)
    assert normals is not None
    assert not normals[count : 2 * count].any()
    assert normals[:count].tobytes() == SMOOTH.corner_normals.tobytes()  # type: ignore[union-attr]
    assert looks.objects(of, ("depth",), has_surfaces=False) is None
    assert looks.materials(of.only(np.array([True, False, False]))) is None


def test_every_ball_has_its_colour_its_index_and_its_row() -> None:
    passes = preview.trace(scene(), Settings(passes=PASSES, shading="headlight"), outputs=preview.Outputs()).passes
    for instance, materials in ((0, {1}), (1, {2, 3}), (2, {1})):
        hit = passes["instance"][..., 0] == instance
        assert hit.sum() > 30
        assert set(passes["object_index"][hit].ravel().tolist()) == {5 + instance}
        assert set(passes["material_index"][hit].ravel().tolist()) == materials
    red = passes["material_index"][..., 0] == 2
    assert (passes["combined"][red][:, 0] > 0).all()
    assert (passes["combined"][red][:, 1:3] == 0).all()


def test_the_world_is_behind_all_and_lights_what_lamps_do_not_reach() -> None:
    shown = combined(scene())
    assert shown[0, 0].tolist() == [np.float32(x) for x in (0.1, 0.2, 0.3, 1.0)]
    assert (combined(scene(film_transparent=True))[0, 0] == 0).all()
    assert (combined(scene(world=None))[0, 0] == 0).all()
    dark = np.zeros(3, SURFACE_DTYPE)
    dark["base"] = 0.5
    black, lit = (combined(scene(world=world, surfaces=dark)) for world in ((0, 0, 0), (0.1, 0.2, 0.3)))
    hit = black[..., :3].any(axis=2)
    np.testing.assert_allclose((lit - black)[hit][:, :3], np.tile([0.05, 0.1, 0.15], (hit.sum(), 1)), atol=1e-6)


def test_a_headlight_leaves_out_lights_and_world() -> None:
    chosen = combined(scene(), Settings(shading="headlight"))
    without = combined(scene(lights=np.zeros(0, LIGHT_DTYPE)))
    assert chosen.tobytes() == without.tobytes()
    assert chosen.tobytes() != combined(scene()).tobytes()


def test_hard_shadows_need_no_more_than_one_sample() -> None:
    of = scene()
    hard = looks.lights(of, Settings())
    assert not hard["size"].any()
    assert of.lights["size"].any()
    assert looks.lights(of, Settings(soft_shadows=True)) is of.lights
    soft = combined(of, Settings(soft_shadows=True, samples=16))
    assert soft.tobytes() != combined(of, Settings(samples=16)).tobytes()


def test_flat_faces_are_those_of_the_triangles() -> None:
    flat, smooth = (combined(scene(), Settings(smooth=smooth)) for smooth in (False, True))
    plain = replace(SMOOTH, corner_normals=None)
    assert flat.tobytes() == combined(scene(meshes=[plain, PAINTED])).tobytes()
    assert flat.tobytes() != smooth.tobytes()


def test_what_is_hidden_from_the_camera_is_not_seen() -> None:
    of = scene()
    assert of.objects is not None
    of.objects["flags"][1] = HIDDEN
    assert set(np.unique(preview.trace(of, Settings(passes=("instance",))).passes["instance"])) == {-1, 0, 2}


def test_objects_that_occlusion_may_reach_stay() -> None:
    """Two balls outside the picture, beside it: by no light they are seen, by their shade the nearer one is."""
    matrices = np.stack([np.eye(4)] * 3)
    matrices[1, 0, 3], matrices[2, 0, 3] = 8, 80
    view = framing_view(np.array([[-1.0] * 3, [1.0] * 3]), 32, 32)
    of = SceneData([Mesh("Ball", *BALL)], np.zeros(3, np.int32), matrices, camera=view)
    for settings, left_out in (
        (Settings(), 2),
        (Settings(ambient_occlusion=True), 0),
        (Settings(ambient_occlusion=True, ambient_occlusion_distance=20.0), 1),
    ):
        chosen = replace(settings, passes=("combined",))
        report = preview.trace(of, chosen, outputs=preview.Outputs()).report
        assert report["triangles"] == (3 - left_out) * len(BALL.triangles)
        assert list(differing(Case(of, chosen))) == []


def test_a_wide_sun_reaches_further_than_a_narrow_one() -> None:
    matrices = np.stack([np.eye(4)] * 2)
    matrices[1, :3, 3] = 30, 0, 30
    sun = np.zeros(1, LIGHT_DTYPE)
    sun["kind"], sun["direction"], sun["colour"] = SUN, (0, 0, -1), 3
    view = framing_view(np.array([[-1.0] * 3, [1.0] * 3]), 16, 16)
    of = SceneData([Mesh("Ball", *BALL)], np.zeros(2, np.int32), matrices, camera=view, lights=sun)
    settings = Settings(passes=("combined",), soft_shadows=True)
    for angle, balls in ((0.0, 1), (2.0, 2)):
        sun["size"] = angle, 0
        report = preview.trace(of, settings, outputs=preview.Outputs()).report
        assert report["triangles"] == balls * len(BALL.triangles)


def test_a_distance_that_is_none_is_refused() -> None:
    for distance in (0.0, -1.0, float("nan")):
        with pytest.raises(UserError, match="ambient occlusion distance"):
            Settings(ambient_occlusion_distance=distance)
