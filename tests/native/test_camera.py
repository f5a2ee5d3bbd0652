"""Camera.rays: pixels of a picture as rays, by an unprojection of its own."""

import bihtree
import numpy as np
import pytest

from tests.native.views import clip_to_world, look_at, orthographic, perspective

VIEW = look_at((3, -4, 2), (0.5, 0, 0.25))
WIDTH, HEIGHT = 7, 5


def camera_space_points(half_width, half_height, distance):
    """(HEIGHT · WIDTH, 3) pixel centres on the plane z = -distance of the camera, row 0 at the bottom."""
    x = (2 * np.arange(WIDTH) + 1) / WIDTH - 1
    y = (2 * np.arange(HEIGHT) + 1) / HEIGHT - 1
    points = np.empty((HEIGHT, WIDTH, 3))
    points[..., 0], points[..., 1], points[..., 2] = x * half_width, y[:, None] * half_height, -distance
    return points.reshape(-1, 3)


def test_perspective():
    matrix = clip_to_world(VIEW, perspective(0.07, 0.05, 0.1, 100))
    origins, directions = bihtree.Camera(matrix, WIDTH, HEIGHT).rays()
    points = camera_space_points(0.07, 0.05, 0.1)
    assert origins.dtype == directions.dtype == np.float64
    assert np.allclose(origins, points @ VIEW[:3, :3].T + VIEW[:3, 3], rtol=0, atol=1e-12)
    expected = points / np.linalg.norm(points, axis=1, keepdims=True) @ VIEW[:3, :3].T
    assert np.allclose(directions, expected, rtol=0, atol=1e-9)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, rtol=0, atol=1e-15)


def test_orthographic():
    matrix = clip_to_world(VIEW, orthographic(1.4, 1.0, 0.5, 20))
    origins, directions = bihtree.Camera(matrix, WIDTH, HEIGHT).rays()
    points = camera_space_points(1.4, 1.0, 0.5)
    assert np.allclose(origins, points @ VIEW[:3, :3].T + VIEW[:3, 3], rtol=0, atol=1e-12)
    assert np.allclose(directions, -VIEW[:3, 2], rtol=0, atol=1e-12)


def test_a_shifted_lens():
    """A shear of clip space moves the picture, not the eye."""
    shift = np.eye(4)
    shift[0, 3] = 0.5
    projection = shift @ perspective(0.07, 0.05, 0.1, 100)
    origins, directions = bihtree.Camera(clip_to_world(VIEW, projection), WIDTH, HEIGHT).rays()
    clip = np.hstack([origins, np.ones((len(origins), 1))]) @ (projection @ np.linalg.inv(VIEW)).T
    x, y = np.meshgrid((2 * np.arange(WIDTH) + 1) / WIDTH - 1, (2 * np.arange(HEIGHT) + 1) / HEIGHT - 1)
    assert np.allclose(clip[:, :3] / clip[:, 3:], np.stack([x.ravel(), y.ravel(), -np.ones(x.size)], axis=1), atol=1e-9)
    towards_eye = (VIEW[:3, 3] - origins) / np.linalg.norm(VIEW[:3, 3] - origins, axis=1, keepdims=True)
    assert np.allclose(directions, -towards_eye, rtol=0, atol=1e-9)


def test_samples_lie_within_the_pixel_and_differ():
    matrix = clip_to_world(np.eye(4), orthographic(WIDTH / 2, HEIGHT / 2, 0, 1))
    camera = bihtree.Camera(matrix, WIDTH, HEIGHT)
    lower = np.stack(np.meshgrid(np.arange(WIDTH) - WIDTH / 2, np.arange(HEIGHT) - HEIGHT / 2), axis=2).reshape(-1, 2)
    places = np.array([camera.rays(sample=sample)[0][:, :2] - lower for sample in range(64)])
    assert (places > -1e-12).all() and (places < 1 + 1e-12).all()
    assert len(np.unique(places[:, 0].round(9), axis=0)) == 64
    # 64 points that fill the square evenly: each quarter has about its share.
    quarters = (places[:, 0] > 0.5) @ [1, 2]
    assert (np.bincount(quarters, minlength=4) >= 10).all()


def test_size():
    camera = bihtree.Camera(np.eye(4), WIDTH, HEIGHT)
    assert (camera.width, camera.height) == (WIDTH, HEIGHT)
    assert [part.shape for part in camera.rays()] == [(WIDTH * HEIGHT, 3)] * 2


@pytest.mark.parametrize(
    "matrix",
    [
        np.eye(3),
        np.zeros((4, 4)),
        np.full((4, 4), np.nan),
        np.diag([1, 1, 0, 1.0]),
        np.eye(4) * 1j,
        "matrix",
        np.eye(4)[None],
    ],
)
def test_a_matrix_that_is_none(matrix):
    with pytest.raises(bihtree.GeometryError, match="clip_to_world"):
        bihtree.Camera(matrix, 4, 4)


@pytest.mark.parametrize(("width", "height"), [(0, 4), (4, 0), (-1, 4), (4, -(2**40)), (2**20, 1)])
def test_a_size_that_is_none(width, height):
    name = "width" if width != 4 else "height"
    with pytest.raises((ValueError, OverflowError), match=name):
        bihtree.Camera(np.eye(4), width, height)
