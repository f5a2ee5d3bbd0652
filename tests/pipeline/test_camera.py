"""The camera's projection against trigonometry, and framing against the picture's edges."""

import numpy as np
import pytest

from addon.pipeline.camera import CameraView, distance_to_see, framing_view, perspective_view
from addon.pipeline.errors import UserError

SIZES = [(640, 480), (480, 640), (300, 300), (1920, 17), (1, 1)]


def pixel(point, eye, forward, right, up, field_of_view, width, height):
    """Where a point is in the picture, and how deep, from its offsets along the camera's own axes."""
    offset = [p - e for p, e in zip(point, eye, strict=True)]
    along, sideways, upward = (sum(a * b for a, b in zip(offset, axis, strict=True)) for axis in (forward, right, up))
    pixels_a_unit = 0.5 * max(width, height) / np.tan(0.5 * field_of_view)
    return 0.5 * width + pixels_a_unit * sideways / along, 0.5 * height + pixels_a_unit * upward / along, along


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_projection_is_that_of_a_pinhole(width: int, height: int) -> None:
    rng = np.random.default_rng(width)
    eye, fov, near, far = np.array([3.0, -4.0, 2.0]), 0.9, 0.5, 80.0
    view = perspective_view(
        eye, eye + [0.6, 0.8, 0.0], np.array([0.0, 0.0, 1.0]), width, height, field_of_view=fov, near=near, far=far
    )
    points = eye + rng.uniform(-5, 5, (200, 3)) + [9.0, 12.0, 0.0]
    for point, got in zip(points, view.project(points), strict=True):
        x, y, depth = pixel(point, eye, (0.6, 0.8, 0.0), (0.8, -0.6, 0.0), (0.0, 0.0, 1.0), fov, width, height)
        assert got[:2] == pytest.approx((x, y), abs=1e-9 * max(width, height))
        assert got[3] == pytest.approx(depth, rel=1e-12)
        # -1 at the near plane, 1 at the far one, and linear in 1 / depth.
        assert got[2] == pytest.approx(1 - 2 * (1 / depth - 1 / far) / (1 / near - 1 / far), abs=1e-9)


def test_a_point_behind_the_camera_has_negative_w() -> None:
    view = perspective_view(
        np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), 8, 6, field_of_view=1.0, near=0.1, far=10.0
    )
    assert view.project(np.array([[-1.0, 0, 0], [1.0, 0, 0]]))[:, 3].tolist() == pytest.approx([-1, 1])


def test_an_orthographic_matrix_projects_without_shrinking_what_is_far() -> None:
    # 4 x 3 units wide, looking along -z from z = 0, near 1 and far 11.
    clip_to_world = np.array([[2.0, 0, 0, 0], [0, 1.5, 0, 0], [0, 0, -5.0, -6.0], [0, 0, 0, 1.0]])
    view = CameraView(clip_to_world, 400, 300, 1.0, perspective=False)
    got = view.project(np.array([[0.5, 0.25, -1.0], [0.5, 0.25, -11.0], [-2.0, -1.5, -6.0]]))
    assert got == pytest.approx(np.array([[250, 175, -1, 1], [250, 175, 1, 1], [0, 0, 0, 1]]), abs=1e-9)


@pytest.mark.parametrize("perspective", [True, False])
def test_a_part_of_a_view_has_its_pixels(perspective: bool) -> None:
    whole = framing_view(np.array([[-1.0] * 3, [2.0] * 3]), 320, 200)
    if not perspective:
        clip_to_world = np.array([[2.0, 0, 0, 0], [0, 1.5, 0, 0], [0, 0, -5.0, -6.0], [0, 0, 0, 1.0]])
        whole = CameraView(clip_to_world, 320, 200, 1.0, perspective=False)
    part = whole.part((40, 70, 101, 33))
    assert (part.width, part.height) == (101, 33)
    points = np.random.default_rng(3).uniform(-1, 1, (50, 3))
    expected = whole.project(points) - [40, 70, 0, 0]
    np.testing.assert_allclose(part.project(points), expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(whole.part((0, 0, 320, 200)).clip_to_world, whole.clip_to_world)


BOUNDS = {
    "cube": ([-1, -1, -1], [1, 1, 1]),
    "flat in x": ([0, -1, -1], [0, 1, 1]),
    "flat in y": ([-1, 2, -1], [1, 2, 1]),
    "flat in z": ([-1, -1, 5], [1, 1, 5]),
    "line": ([-3, 1, 1], [4, 1, 1]),
    "line along the view": ([-0.55, 1.0, -0.45], [0.55, -1.0, 0.45]),
    "point at the origin": ([0, 0, 0], [0, 0, 0]),
    "point far away": ([1e6, -2e6, 3e6], [1e6, -2e6, 3e6]),
    "point at the end of float32": ([3e38, 3e38, 3e38], [3e38, 3e38, 3e38]),
    "tiny": ([-1e-38, 0, 0], [1e-38, 2e-38, 1e-38]),
    "tiny and far": ([1000, 1000, 1000], [1000.0001, 1000.0001, 1000.0001]),
    "huge": ([-3e38, -3e38, -3e38], [3e38, 3e38, 3e38]),
    "skyscraper": ([0, 0, 0], [1, 1, 1e6]),
}
RANDOM = np.random.default_rng(7)
BOUNDS |= {
    f"random {number}": np.sort(RANDOM.normal(0, 10.0 ** RANDOM.integers(-30, 30), (2, 3)), axis=0)
    for number in range(20)
}


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize("name", BOUNDS)
def test_framing_has_every_corner_between_the_planes_and_in_the_picture(name: str, width: int, height: int) -> None:
    lower, upper = np.array(BOUNDS[name], np.float64)
    corners = np.array([np.where([i, j, k], upper, lower) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    x, y, z, w = framing_view(np.array([lower, upper]), width, height).project(corners).T
    assert ((x > 0) & (x < width) & (y > 0) & (y < height)).all()
    assert ((z > -1) & (z < 1) & (w > 0)).all()


@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
def test_framing_fills_the_picture_and_keeps_it_upright(scale: float) -> None:
    view = framing_view(np.array([[-scale] * 3, [scale] * 3]), 300, 200)
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * scale
    x, y = view.project(corners)[:, :2].T
    assert np.ptp(y) > 100
    assert (y[1::2] > y[::2]).all()  # the upper corners of the box
    assert x[4] > x[0]  # and its right ones, seen from the front


@pytest.mark.parametrize("size", [(0, 10), (10, 0), (-3, 5), (65537, 1), (1, 65537)])
def test_a_picture_of_no_pixels_or_too_many_is_wrong_usage(size: tuple[int, int]) -> None:
    for make in (
        lambda: CameraView(np.eye(4), *size, 0.1, perspective=True),
        lambda: framing_view(np.array([[0.0] * 3, [1.0] * 3]), *size),
    ):
        with pytest.raises(UserError, match=f"{size[0]} x {size[1]}") as caught:
            make()
        assert caught.value.exit_status == 2


@pytest.mark.parametrize("perspective", [True, False])
def test_from_the_distance_to_see_corners_touch_the_edge(perspective: bool) -> None:
    corners = np.array([[x, y, z] for x in (-3.0, 3.0) for y in (-1.0, 1.0) for z in (-2.0, 2.0)])
    slopes = (0.75, 0.5)
    distance = distance_to_see(corners, slopes, perspective=perspective)
    away = (distance - corners[:, 2:]) if perspective else distance
    places = np.abs(corners[:, :2]) / (away * np.array(slopes))
    assert places.max() == pytest.approx(1.0) and (places <= 1.0 + 1e-12).all()
    assert distance == pytest.approx(6.0 if perspective else 4.0)
