"""Boxes of instances hold them, and the picture of boxes shows each where it is."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.pipeline.camera import CameraView, perspective_view
from addon.pipeline.instance_bounds import EDGE, FILL, GREY, BoundsPicture, InstanceBoxes
from addon.pipeline.mesh import Mesh
from tests.meshes import icosphere

WIDTH, HEIGHT = 40, 30
BALL = Mesh("Ball", *icosphere(2))


def views() -> list[CameraView]:
    eye, target, up = np.array([0, -6.0, 1.0]), np.zeros(3), np.array([0, 0, 1.0])
    orthographic = np.array([[4.0, 0, 0, 0.5], [0, 0, -10.0, -6.5], [0, 3.0, 0, 0.5], [0, 0, 0, 1.0]])
    return [
        perspective_view(eye, target, up, WIDTH, HEIGHT, field_of_view=0.9, near=0.1, far=50.0),
        CameraView(orthographic, WIDTH, HEIGHT, 1.5, perspective=False),
    ]


def random_boxes(count: int) -> NDArray[np.float64]:
    """Some are as large as the picture, some smaller than a pixel, some beside it or behind the camera."""
    rng = np.random.default_rng(7)
    middle = rng.normal(size=(count, 3)) * 5
    half = 10.0 ** rng.uniform(-3, 0.3, (count, 3))
    return np.stack([middle - half, middle + half], axis=1)


def rectangles(boxes: NDArray[np.float64], view: CameraView) -> list[tuple[int, int, int, int]]:
    """left, bottom, right, top in pixels, box by box; none of those that reach behind the camera."""
    found = []
    for lower, upper in boxes:
        ends = [[a, b] for a, b in zip(lower, upper, strict=True)]
        places = view.project(np.stack([grid.ravel() for grid in np.meshgrid(*ends)], axis=1))
        if (places[:, 3] > 0).all():
            left, bottom = np.floor(places[:, :2].min(axis=0) + 1e-9).astype(int)
            right, top = np.ceil(places[:, :2].max(axis=0) - 1e-9).astype(int)
            found.append((left, bottom, max(right, left + 1), max(top, bottom + 1)))
    return found


def slow_picture(boxes: NDArray[np.float64], view: CameraView) -> NDArray[np.float64]:
    """(H, W) how much is hidden, rectangle by rectangle."""
    through = np.ones((view.height, view.width))
    for left, bottom, right, top in rectangles(boxes, view):
        for y in range(max(bottom, 0), min(top, view.height)):
            for x in range(max(left, 0), min(right, view.width)):
                is_edge = x in (left, right - 1) or y in (bottom, top - 1)
                through[y, x] *= (1 - FILL) * (1 - EDGE if is_edge else 1)
    return 1 - through


@pytest.mark.parametrize("number", range(2))
def test_each_box_is_where_it_is_seen(number: int) -> None:
    view, boxes = views()[number], random_boxes(200)
    picture = BoundsPicture(view)
    picture.add(boxes)
    pixels, expected = picture.pixels(), slow_picture(boxes, view)
    assert pixels.shape == (HEIGHT, WIDTH, 4) and pixels.dtype == np.float32
    assert 0 < len(rectangles(boxes, view)) < 200 or number == 1, "some are behind the camera"
    assert (expected == 0).any() and (expected > 0).mean() > 0.2 and len(np.unique(expected)) > 5
    np.testing.assert_allclose(pixels[..., 3], expected, atol=1e-5)
    np.testing.assert_allclose(pixels[..., :3], GREY * pixels[..., 3:].repeat(3, axis=2), atol=1e-6)


def test_boxes_that_come_one_after_another_give_the_same_picture() -> None:
    view, boxes = views()[0], random_boxes(50_000)
    whole, parts = BoundsPicture(view), BoundsPicture(view)
    whole.add(boxes)
    for start, end in ((0, 0), (0, 1), (1, 20_000), (20_000, 50_000)):
        parts.add(boxes[start:end])
    assert parts.pixels().tobytes() == whole.pixels().tobytes()


def test_nothing_is_nothing() -> None:
    picture = BoundsPicture(views()[0])
    picture.add(np.zeros((0, 2, 3)))
    assert not picture.pixels().any()


def test_a_box_holds_its_instance_and_touches_it_where_it_is_not_turned() -> None:
    rng = np.random.default_rng(3)
    moved = Mesh("Moved", BALL.vertices + np.float32(3), BALL.triangles)
    matrices = np.tile(np.eye(4), (40, 1, 1))
    matrices[1:, :3] = rng.normal(size=(39, 3, 4))
    matrices[1, :3, :3] = np.diag([-1.0, 0.0, 2.0])  # mirrored and singular
    rows = np.arange(40, dtype=np.int32) % 2
    made = InstanceBoxes()
    boxes = np.concatenate(
        [made.boxes([BALL], rows[:1], matrices[:1]), made.boxes([BALL, moved], rows[1:], matrices[1:])]
    )
    for (lower, upper), row, matrix in zip(boxes, rows, matrices, strict=True):
        world = [BALL, moved][row].vertices @ matrix[:3, :3].T + matrix[:3, 3]
        slack = 1e-6 * np.abs(world).max()
        assert (lower <= world.min(axis=0) + slack).all() and (upper >= world.max(axis=0) - slack).all()
    np.testing.assert_allclose(boxes[0], [BALL.vertices.min(axis=0), BALL.vertices.max(axis=0)], atol=1e-6)
    np.testing.assert_allclose(boxes[1][:, 1], matrices[1, 1, 3], atol=1e-12)
    assert made.boxes([], np.zeros(0, np.int32), np.zeros((0, 4, 4))).shape == (0, 2, 3)
