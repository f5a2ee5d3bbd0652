"""Objects are left out only where no ray meets them, whatever the camera and the lights."""

from __future__ import annotations

import bihtree
import numpy as np
import pytest

from addon.pipeline.camera import CameraView, perspective_view
from addon.pipeline.mesh import Mesh
from addon.pipeline.reach import share_in_view, unreached
from addon.pipeline.scene import LIGHT_DTYPE, POINT, SUN, SceneData
from tests import meshes

BOX = Mesh("box", *meshes.box())
ORTHOGRAPHIC = np.array([[1.5, 0, 0, 0.5], [0, 1.5, 0, 0.5], [0, 0, -10.0, -6.5], [0, 0, 0, 1.0]])


def boxes(rng: np.random.Generator, view: CameraView, count: int = 40) -> SceneData:
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, :3] = rng.normal(size=(count, 3, 3)) * 0.4
    matrices[:, :3, 3] = rng.normal(size=(count, 3)) * 8
    return SceneData([BOX], np.zeros(count, np.int32), matrices, camera=view)


def views() -> list[CameraView]:
    eye, target, up = np.zeros(3), np.array([1.0, 0.3, -0.2]), np.array([0, 0, 1.0])
    return [
        perspective_view(eye, target, up, 24, 18, field_of_view=1.2, near=0.1, far=50.0),
        perspective_view(eye, target, up, 18, 24, field_of_view=0.2, near=2.0, far=9.0),
        CameraView(ORTHOGRAPHIC, 20, 20, 1.5, perspective=False),
    ]


@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("kind", [None, SUN, POINT])
def test_no_ray_meets_what_is_out_of_reach(number: int, kind: int | None) -> None:
    """Every object alone, against camera rays and rays from all over the frustum to the light."""
    rng = np.random.default_rng(number)
    view = views()[number]
    left_out = 0
    for _ in range(8):
        scene = boxes(rng, view)
        if kind is not None:
            light = np.zeros(1, LIGHT_DTYPE)
            light["kind"], light["position"], light["direction"] = kind, rng.normal(size=3) * 20, rng.normal(size=3)
            scene = SceneData(scene.meshes, scene.instance_mesh, scene.instance_matrix, camera=view, lights=light)
        apart = unreached(scene, shadows=True)
        left_out += int(apart.sum())
        if not apart.any():
            continue
        tree = bihtree.Tree(*scene.only(apart).flatten())
        origins, directions = bihtree.Camera(view.clip_to_world, view.width, view.height).rays()
        clip = np.concatenate([rng.uniform(-1, 1, (4000, 3)), np.ones((4000, 1))], axis=1) @ view.clip_to_world.T
        points = clip[:, :3] / clip[:, 3:]
        # Camera rays end at the far plane, where clip z is 1.
        depth = view.world_to_clip[2] - view.world_to_clip[3]
        length = -(origins @ depth[:3] + depth[3]) / (directions @ depth[:3])
        assert not tree.occluded(origins, directions, t_max=length).any()
        for light in scene.lights:
            if light["kind"] == SUN:
                assert not tree.occluded(points, np.broadcast_to(-light["direction"], points.shape)).any()
            else:
                assert not tree.occluded(points, light["position"] - points, t_max=1.0).any()
    assert left_out > 20


def test_shadows_from_outside_are_kept() -> None:
    """A box behind the camera, between the picture and the sun."""
    view = views()[0]
    matrix = np.eye(4)
    matrix[:3, 3] = -5, 0, 0
    light = np.zeros(1, LIGHT_DTYPE)
    light["kind"], light["direction"] = SUN, (1, 0, 0)
    scene = SceneData([BOX], np.zeros(1, np.int32), matrix[None], camera=view, lights=light)
    assert unreached(scene, shadows=False).tolist() == [True]
    assert unreached(scene, shadows=True).tolist() == [False]


def test_a_camera_that_sees_without_end_reaches_everything() -> None:
    endless = views()[0].clip_to_world.copy()
    endless[3] = 0, 0, -0.5, 0.5
    scene = boxes(np.random.default_rng(0), CameraView(endless, 4, 4, 0.1, perspective=True))
    assert not unreached(scene, shadows=False).any()


def test_the_share_in_view_is_that_of_first_corners() -> None:
    view = views()[0]
    ahead, behind = np.eye(4), np.eye(4)
    ahead[:3, 3], behind[:3, 3] = np.array([1.0, 0.3, -0.2]) * 20, (-20, 0, 0)
    scene = SceneData([BOX], np.zeros(4, np.int32), np.stack([ahead, behind, behind, behind]), camera=view)
    assert share_in_view(scene) == 0.25
