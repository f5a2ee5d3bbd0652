"""The geometry of the overlay against points projected one by one."""

from itertools import product

import numpy as np
import pytest

from addon.pipeline.overlay import UNBUILT, Kind, overlapping, overlay_faces, overlay_lines, scene_nearness
from tests.pipeline.naive_bih import INNER, LEAF, naive_nodes
from tests.pipeline.overlay_scene import (
    EYE,
    FORWARD,
    NEAR,
    depth_along_axis,
    one_node,
    orthographic,
    perspective,
    spheres_on_a_floor,
)

CAMERAS = {"perspective": perspective, "orthographic": orthographic}
every_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
NODES = naive_nodes(*spheres_on_a_floor(), max_depth=5)[0]


def nearness(view, points):
    depth = depth_along_axis(np.asarray(points, np.float64))
    return 1 / depth if view.perspective else -depth


def projected(view, points):
    """(N, 3): x, y and nearness, by the camera's own projection and by distances from its eye."""
    points = np.asarray(points, np.float64)
    return np.column_stack([view.project(points)[:, :2], nearness(view, points)])


def edges_of_box(lower, upper):
    """The twelve pairs of corners that differ in one coordinate."""
    corners = [np.array(corner) for corner in product(*zip(lower.tolist(), upper.tolist(), strict=True))]
    numbers = list(product((0, 1), repeat=3))
    pairs = [(a, b) for b in range(8) for a in range(b) if sum(np.not_equal(numbers[a], numbers[b])) == 1]
    return [(corners[a], corners[b]) for a, b in pairs]


def unordered(ends):
    """Lines (N, 2, 3) with their ends, and then themselves, in a fixed order."""
    ends = np.round(ends, 7) + 0.0
    swap = [tuple(a) > tuple(b) for a, b in ends]
    ends[swap] = ends[swap][:, ::-1]
    return ends[np.lexsort(ends.reshape(len(ends), 6).T[::-1])]


@every_camera
def test_the_boxes_are_those_of_all_nodes(camera):
    view = camera(960, 720)
    lines = overlay_lines(NODES, view)
    for node_kind, line_kind in ((INNER, Kind.BOX), (LEAF, Kind.LEAF_BOX)):
        nodes = NODES[NODES["kind"] == node_kind]
        assert len(nodes) > 1
        edges = [edge for node in nodes for edge in edges_of_box(node["lower"], node["upper"])]
        expected = projected(view, np.reshape(edges, (-1, 3))).reshape(-1, 2, 3)
        np.testing.assert_allclose(unordered(lines.ends[lines.kind == line_kind]), unordered(expected), atol=2e-6)
        depths = lines.depth[lines.kind == line_kind]
        np.testing.assert_array_equal(np.bincount(depths), 12 * np.bincount(nodes["depth"]))


@every_camera
@pytest.mark.parametrize(("kind", "which"), [(Kind.LEFT, 0), (Kind.RIGHT, 1)])
def test_each_inner_node_has_both_clip_planes(camera, kind, which):
    view = camera(960, 720)
    inner = NODES[NODES["kind"] == INNER]
    faces = [face for face in overlay_faces(NODES, view) if face.kind is kind]
    assert len(faces) == len(inner)
    lines = overlay_lines(NODES, view)
    assert np.count_nonzero(lines.kind == kind) == 4 * len(inner)
    for node, face in zip(inner, faces, strict=True):
        lower, upper = node["lower"].copy(), node["upper"].copy()
        lower[node["axis"]] = upper[node["axis"]] = node["clip"][which]
        assert face.depth == node["depth"]
        corners = projected(view, sorted(set(product(*zip(lower.tolist(), upper.tolist(), strict=True)))))
        assert len(corners) == 4
        np.testing.assert_allclose(
            sorted(map(tuple, np.round(face.corners, 6))), sorted(map(tuple, np.round(corners[:, :2], 6))), atol=2e-6
        )
        middle = np.array([*corners[:, :2].mean(axis=0), 1.0])
        assert face.corners.shape == (4, 2)
        on_plane = np.column_stack([corners[:, :2], np.ones(4)]) @ face.plane
        np.testing.assert_allclose(on_plane, corners[:, 2], rtol=1e-9)
        assert corners[:, 2].min() <= middle @ face.plane <= corners[:, 2].max()


@every_camera
def test_the_sides_of_an_overlap_span_the_two_planes(camera):
    view = camera(960, 720)
    faces = [face for face in overlay_faces(one_node((0.5, -0.75), axis=0), view) if face.kind is Kind.OVERLAP]
    assert len(faces) == 4
    found = {tuple(corner) for face in faces for corner in np.round(face.corners, 6)}
    corners = list(product((-0.75, 0.5), (-1.0, 1.0), (0.0, 1.5)))
    assert found == {tuple(corner) for corner in np.round(projected(view, corners)[:, :2], 6)}


def test_a_gap_and_planes_that_touch_have_no_sides():
    view = perspective(96, 72)
    for clip in ((-0.75, 0.5), (0.25, 0.25)):
        nodes = one_node(clip)
        assert len(overlapping(nodes)) == 0
        assert [face.kind for face in overlay_faces(nodes, view)] == [Kind.LEFT, Kind.RIGHT]
    assert len(overlapping(one_node((0.5, -0.75)))) == 1


def test_a_leaf_is_a_box_without_planes():
    nodes, view = one_node(None), perspective(96, 72)
    assert list(overlay_faces(nodes, view)) == []
    assert overlay_lines(nodes, view).kind.tolist() == [Kind.LEAF_BOX] * 12


def test_a_node_not_yet_subdivided_is_a_box_of_its_own_kind():
    nodes, view = one_node(None, childless=UNBUILT), perspective(96, 72)
    assert list(overlay_faces(nodes, view)) == []
    assert overlay_lines(nodes, view).kind.tolist() == [Kind.UNBUILT_BOX] * 12


def test_an_empty_table_draws_nothing():
    nodes, view = one_node(None)[:0], orthographic(96, 72)
    assert len(overlay_lines(nodes, view).ends) == 0
    assert list(overlay_faces(nodes, view)) == []
    assert np.isfinite(scene_nearness(np.full((2, 3), np.inf), nodes, view)).all()


def around_the_camera(axis):
    """A node whose box, and whose clip planes across `axis`, reach from before the eye to behind it."""
    lower, upper = np.minimum(EYE, EYE + 4 * FORWARD) - 2.0, np.maximum(EYE, EYE + 4 * FORWARD) + 2.0
    plane = EYE[axis] + FORWARD[axis]
    return one_node((plane, plane), axis, tuple(lower), tuple(upper))


def in_picture(view, points):
    """Which world points a picture can show, and where they are in it."""
    at = projected(view, points)
    before = depth_along_axis(points) > NEAR
    inside = (at[:, 0] > 0) & (at[:, 0] < view.width) & (at[:, 1] > 0) & (at[:, 1] < view.height)
    return at[before & inside]


@every_camera
@pytest.mark.parametrize("axis", range(3))
def test_lines_across_the_near_plane_are_cut_where_they_leave_the_view(camera, axis):
    view = camera(96, 72)
    node = around_the_camera(axis)
    lines = overlay_lines(node, view).ends
    assert np.isfinite(lines).all()
    assert len(lines) < 20
    nearest = 1 / NEAR if view.perspective else -NEAR
    assert (lines[..., 2] <= nearest * (1 + 1e-9) if view.perspective else lines[..., 2] <= nearest + 1e-9).all()
    steps = np.linspace(0.0, 1.0, 2001)[:, None]
    edges = edges_of_box(node["lower"][0].astype(np.float64), node["upper"][0].astype(np.float64))
    shown = in_picture(view, np.concatenate([a + steps * (b - a) for a, b in edges]))
    assert len(shown) > 100
    start, way = lines[:, 0], lines[:, 1] - lines[:, 0]
    for point in shown:
        t = np.clip(((point - start)[:, :2] * way[:, :2]).sum(axis=1) / (way[:, :2] ** 2).sum(axis=1), 0, 1)
        assert np.abs(start + t[:, None] * way - point).max(axis=1).min() < 1e-5


def inside_convex(corners, points):
    way = np.roll(corners, -1, axis=0) - corners
    sides = way[:, 0] * (points[:, None, 1] - corners[:, 1]) - way[:, 1] * (points[:, None, 0] - corners[:, 0])
    return (sides >= -1e-6).all(axis=1) | (sides <= 1e-6).all(axis=1)


@every_camera
@pytest.mark.parametrize("axis", range(3))
def test_a_plane_across_the_near_plane_is_cut_there(camera, axis):
    view = camera(96, 72)
    node = around_the_camera(axis)
    face = next(iter(overlay_faces(node, view)))
    lower, upper = (node[field][0].astype(np.float64) for field in ("lower", "upper"))
    points = np.random.default_rng(3).uniform(lower, upper, (20_000, 3))
    points[:, axis] = node["clip"][0, 0]
    assert (depth_along_axis(points) < NEAR).any()
    shown = in_picture(view, points)
    assert len(shown) > 100
    assert inside_convex(face.corners, shown[:, :2]).all()
    plane = np.column_stack([shown[:, :2], np.ones(len(shown))]) @ face.plane
    np.testing.assert_allclose(plane, shown[:, 2], rtol=1e-7)
    at_corners = np.column_stack([face.corners, np.ones(len(face.corners))]) @ face.plane
    np.testing.assert_array_less(1 / at_corners if view.perspective else -at_corners, 100.0)
    assert (1 / at_corners if view.perspective else -at_corners).min() == pytest.approx(NEAR, rel=1e-6)


@every_camera
def test_a_plane_behind_the_camera_is_not_drawn(camera):
    view = camera(96, 72)
    behind = EYE - 3 * FORWARD
    node = one_node((behind[0], behind[0]), 0, tuple(behind - 0.5), tuple(behind + 0.5))
    assert list(overlay_faces(node, view)) == []
    assert len(overlay_lines(node, view).ends) == 0


@every_camera
def test_the_picture_and_the_lines_measure_nearness_alike(camera):
    view = camera(96, 72)
    points = np.array([[0.3, 0.2, 0.1], [-1.5, 0.9, 1.2]])
    depth = depth_along_axis(points)
    np.testing.assert_allclose(scene_nearness(depth[None], NODES, view)[0], nearness(view, points), rtol=1e-12)
    miss = scene_nearness(np.array([[np.inf]]), NODES, view)[0, 0]
    assert miss < overlay_lines(NODES, view).ends[..., 2].min()
