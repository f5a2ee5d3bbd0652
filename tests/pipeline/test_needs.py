"""What was left out is true of the scene, and the savings are its own numbers."""

import numpy as np
import pytest

from addon.pipeline.camera import framing_view
from addon.pipeline.mesh import Mesh
from addon.pipeline.needs import left_out
from addon.pipeline.scene import LIGHT_DTYPE, SceneData
from addon.pipeline.settings import PASSES, Settings

MESH = Mesh("one", np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
MOVED = np.eye(4)
MOVED[0, 3] = 1.0


def scene(*matrices: np.ndarray, lights: int = 0) -> SceneData:
    view = framing_view(np.array([[0.0] * 3, [1.0] * 3]), 30, 20)
    count = len(matrices)
    return SceneData(
        [MESH], np.zeros(count, np.int32), np.array(matrices), camera=view, lights=np.zeros(lights, LIGHT_DTYPE)
    )


def test_nothing_is_left_out_of_a_scene_that_needs_it_all() -> None:
    assert left_out(scene(MOVED, MOVED, lights=2), Settings(), PASSES) == {}


@pytest.mark.parametrize(
    ("name", "channels"),
    [("combined", 4), ("depth", 1), ("normal", 3), ("position", 3), ("triangle", 1), ("cost", 2)],
)
def test_a_pass_not_traced_saves_four_bytes_a_channel_and_pixel(name: str, channels: int) -> None:
    traced = [other for other in PASSES if other != name]
    reasons = left_out(scene(MOVED, MOVED, lights=1), Settings(), traced)
    assert list(reasons) == [f"{name} pass"]
    assert f"{30 * 20 * channels * 4:,} bytes" in reasons[f"{name} pass"]


def test_shadow_rays_are_saved_by_no_light_and_by_shadows_off() -> None:
    headlight = left_out(scene(MOVED, MOVED), Settings(samples=4), PASSES)
    assert "no light" in headlight["shadow rays"]
    assert "up to 2,400 rays" in headlight["shadow rays"]
    off = left_out(scene(MOVED, MOVED, lights=3), Settings(samples=4, shadows=False), PASSES)
    assert "shadows are off" in off["shadow rays"]
    assert "up to 7,200 rays" in off["shadow rays"]


def test_vertices_that_are_not_moved_are_not_transformed() -> None:
    assert list(left_out(scene(np.eye(4), MOVED, lights=1), Settings(), PASSES)) == []
    two = left_out(scene(np.eye(4), np.eye(4), lights=1), Settings(), PASSES)
    assert "6 vertices not transformed" in two["world transform"]
    assert "copied" not in two["world transform"]
    one = left_out(scene(np.eye(4), lights=1), Settings(), PASSES)
    assert "3 vertices not transformed and not copied" in one["world transform"]


@pytest.mark.parametrize("matrix", [np.eye(4), MOVED])
def test_one_mesh_needs_no_tree_over_trees(matrix: np.ndarray) -> None:
    assert "instance tree" in left_out(scene(matrix), Settings(), PASSES)
    assert "instance tree" not in left_out(scene(matrix, matrix), Settings(), PASSES)
