"""The overlay picture against rays of its own: what is tinted, hidden and changed, pixel by pixel."""

from itertools import pairwise, product

import bihtree
import numpy as np
import pytest

from addon.pipeline import overlay_style as style
from addon.pipeline.overlay import UNBUILT, Kind
from addon.pipeline.overlay_legend import legend, legend_texts
from addon.pipeline.overlay_picture import draw_overlay, tree_over_picture
from tests.pipeline.naive_bih import INNER, LEAF, naive_nodes
from tests.pipeline.overlay_scene import (
    crossing,
    depth_along_axis,
    grown,
    one_node,
    orthographic,
    perspective,
    spheres_on_a_floor,
    through_box,
)

WIDTH, HEIGHT = 240, 180
CAMERAS = {"perspective": perspective, "orthographic": orthographic}
every_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
MESH = spheres_on_a_floor()
NODES = naive_nodes(*MESH, max_depth=5)[0]


def traced(view):
    """Picture and depth of the spheres on the floor."""
    camera = bihtree.Camera(view.clip_to_world, view.width, view.height)
    passes = bihtree.render(bihtree.Tree(*MESH), camera, passes=("combined", "depth"))
    depth = passes["depth"] if view.perspective else passes["depth"] + np.float32(view.near)
    return passes["combined"], depth


def nothing(view):
    """Picture and depth of an empty scene."""
    shape = (view.height, view.width)
    return np.zeros((*shape, 4), np.float32), np.full((*shape, 1), np.inf, np.float32)


def bare(view, picture, depth):
    """The picture as it is without any node."""
    return tree_over_picture(picture, depth, NODES[:0], view, 0)


def over_nothing(view, nodes, max_depth=0):
    return tree_over_picture(*nothing(view), nodes, view, max_depth)


PAPER = over_nothing(perspective(1, 1), NODES[:0])[0, 0]


def line_colour(kind, depth, behind):
    """A pixel that a line covers whole."""
    opacity = style.line_opacity(kind, depth)
    return opacity * np.array(style.COLOURS[kind]) + (1 - opacity) * behind


def nearby(image, point):
    """The nine pixels (9, 3) around a place."""
    column, row = (int(x) for x in np.floor(point))
    return image[row - 1 : row + 2, column - 1 : column + 2].reshape(9, 3)


def closest(image, point, colour):
    return np.abs(nearby(image, point) - colour).max(axis=1).min()


# What is drawn


@every_camera
def test_the_boxes_drawn_are_the_nodes_down_to_the_depth(camera):
    view = camera(960, 720)
    images = [over_nothing(view, NODES, depth) for depth in range(3)]
    for depth, image in enumerate(images):
        np.testing.assert_array_equal(image, over_nothing(view, NODES[NODES["depth"] <= depth], depth))
        for node in NODES[NODES["depth"] <= depth]:
            corners = product(*zip(node["lower"].tolist(), node["upper"].tolist(), strict=True))
            for x, y in view.project(np.array(list(corners)))[:, :2]:
                if 1 < x < view.width - 1 and 1 < y < view.height - 1:
                    assert np.abs(nearby(image, (x, y)) - PAPER).max() > 0.05
    # A node's box adds lines where the picture without it had none.
    for shallow, deep in pairwise(images):
        assert (shallow != deep).any(axis=2).sum() > 500


BOXES = [
    (Kind.BOX, one_node((-0.5, 0.5))),
    (Kind.LEAF_BOX, one_node(None)),
    (Kind.UNBUILT_BOX, one_node(None, childless=UNBUILT)),
]


@every_camera
@pytest.mark.parametrize(("kind", "nodes"), BOXES)
def test_projected_corners_of_a_box_carry_its_colour(camera, kind, nodes):
    view = camera(960, 720)
    image = over_nothing(view, nodes)
    for corner in view.project(np.array(list(product((-2.0, 2.0), (-1.0, 1.0), (0.0, 1.5)))))[:, :2]:
        assert closest(image, corner, line_colour(kind, 0, PAPER)) < 0.02


@every_camera
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("kind", "which"), [(Kind.LEFT, 0), (Kind.RIGHT, 1)])
def test_projected_corners_of_a_clip_plane_carry_its_colour(camera, axis, kind, which):
    view = camera(960, 720)
    nodes = one_node((0.4, 1.0), axis)
    lower, upper = nodes["lower"][0].copy(), nodes["upper"][0].copy()
    lower[axis] = upper[axis] = nodes["clip"][0, which]
    image = over_nothing(view, nodes)
    for corner in view.project(np.array(list(product(*zip(lower, upper, strict=True)))))[:, :2]:
        # Behind the line is paper or another plane's tint: a twentieth of either shows.
        assert closest(image, corner, line_colour(kind, 0, PAPER)) < 0.03


def tinted(kinds):
    """What is left of what is behind faces of the root, and the tint over it."""
    left = np.prod([1 - style.FACE_OPACITY[kind][0] for kind in kinds])
    return left, np.mean([style.COLOURS[kind] for kind in kinds], axis=0)


@every_camera
def test_the_planes_are_of_two_colours_and_their_overlap_is_seen(camera):
    view = camera(WIDTH, HEIGHT)
    nodes = one_node((-0.5, 0.5), axis=1)
    image = over_nothing(view, nodes)
    masks = {}
    for kind, y in ((Kind.LEFT, -0.5), (Kind.RIGHT, 0.5)):
        masks[kind], _ = crossing(view, np.array([-2.0, y, 0.0]), np.array([2.0, y, 1.5]), 1)
    left, right = masks[Kind.LEFT], masks[Kind.RIGHT]
    lines = grown(edges_of(view, nodes), 2)
    for mask, kinds in (
        (left & ~right, [Kind.LEFT]),
        (right & ~left, [Kind.RIGHT]),
        (left & right, [Kind.LEFT, Kind.RIGHT]),
    ):
        pixels = image[mask & ~lines]
        assert len(pixels) > 50
        rest, tint = tinted(kinds)
        assert np.abs(pixels - (rest * PAPER + (1 - rest) * tint)).max() < 1e-5
    assert (image[~(left | right | lines)] == PAPER).all()


def edges_of(view, nodes):
    """The pixels that hold a point of an edge of the boxes or of the clip planes."""
    mask = np.zeros((view.height, view.width), bool)
    steps = np.linspace(0.0, 1.0, 4000)[:, None]
    boxes = [(node["lower"].astype(np.float64), node["upper"].astype(np.float64)) for node in nodes]
    for node in nodes[nodes["kind"] == INNER]:
        for plane in node["clip"]:
            lower, upper = node["lower"].astype(np.float64), node["upper"].astype(np.float64)
            lower[node["axis"]] = upper[node["axis"]] = plane
            boxes.append((lower, upper))
    for lower, upper in boxes:
        for corner, axis in product(product((0, 1), repeat=3), range(3)):
            start = np.where(corner, upper, lower)
            end = start.copy()
            end[axis] = upper[axis]
            x, y = view.project(start + steps * (end - start))[:, :2].T
            inside = (x >= 0) & (x < view.width) & (y >= 0) & (y < view.height)
            mask[y[inside].astype(int), x[inside].astype(int)] = True
    return mask


@every_camera
def test_only_an_overlap_is_hatched(camera):
    view = camera(WIDTH, HEIGHT)
    overlap, gap = (over_nothing(view, one_node(clip)) for clip in ((0.75, -0.75), (-0.75, 0.75)))
    # On the front side of the box, between the two planes.
    side, _ = crossing(view, np.array([-0.75, -1.0, 0.0]), np.array([0.75, -1.0, 1.5]), 1)
    planes = np.zeros_like(side)
    for x in (-0.75, 0.75):
        planes |= crossing(view, np.array([x, -1.0, 0.0]), np.array([x, 1.0, 1.5]), 0)[0]
    between = side & ~planes & ~grown(edges_of(view, one_node((-0.75, 0.75))), 2)
    assert between.sum() > 100
    assert (gap[between] == PAPER).all()
    striped = np.abs(overlap[between] - PAPER).max(axis=1)
    assert (striped < 1e-6).any()
    assert striped.max() > 0.2
    share = style.HATCH_WIDTH / style.HATCH_PERIOD
    assert 0.5 * share < (striped > 0.1).mean() < 1.0


# What nearer geometry hides


@every_camera
@pytest.mark.parametrize(("axis", "clip"), [(0, (-1.0, 1.5)), (1, (-0.2, 0.6)), (2, (0.5, 0.9))])
def test_a_plane_is_hidden_by_nearer_geometry_and_by_nothing_else(camera, axis, clip):
    """Planes through the spheres: rays of the test's own through each pixel, against the traced depth."""
    view = camera(WIDTH, HEIGHT)
    picture, depth = traced(view)
    node = one_node(clip, axis, (-2.25, -1.5, -0.1), (2.25, 1.5, 1.7))
    image = tree_over_picture(picture, depth, node, view, 0)
    changed = (image != bare(view, picture, depth)).any(axis=2)
    lower, upper = node["lower"][0].copy(), node["upper"][0].copy()
    footprint, seen = np.zeros((2, *changed.shape), bool)
    for plane in clip:
        lower[axis] = upper[axis] = plane
        inside, plane_depth = crossing(view, lower, upper, axis)
        footprint |= inside
        seen |= plane_depth < depth[..., 0]
    # A line shows everywhere, and at the rim of what hides a pixel is partly covered.
    certain = ~grown(edges_of(view, node), 2) & ~border(seen)
    for part in (seen, footprint & ~seen, ~footprint):
        assert (part & certain).sum() > 200
    np.testing.assert_array_equal(changed[certain], seen[certain])


def border(mask):
    """Pixels within two of the mask's border."""
    return grown(mask, 2) & grown(~mask, 2)


@every_camera
def test_a_line_behind_the_surface_is_faint(camera):
    view = camera(960, 720)
    nodes = one_node(None)
    corner = np.array([[-2.0, -1.0, 1.5]])
    x, y = view.project(corner)[0, :2]
    picture, depth = nothing(view)
    found = []
    for at in depth_along_axis(corner)[0] * np.array([1.1, 0.9]):
        depth[:] = at
        image = tree_over_picture(picture, depth, nodes, view, 0)
        found.append(np.abs(nearby(image, (x, y)) - PAPER).max())
    seen, hidden = found
    assert hidden == pytest.approx(style.HIDDEN * seen, rel=1e-3)
    assert seen > 0.5


@every_camera
def test_a_plane_in_the_surface_does_not_flicker(camera):
    """The clip plane on a wall that lies exactly in it is seen everywhere, not here and there."""
    view = camera(WIDTH, HEIGHT)
    nodes = one_node((0.25, 0.25))
    inside, plane_depth = crossing(view, np.array([0.25, -1.0, 0.0]), np.array([0.25, 1.0, 1.5]), 0)
    picture, _ = nothing(view)
    depth = plane_depth.astype(np.float32)[..., None]
    image = tree_over_picture(picture, depth, nodes, view, 0)
    rest, tint = tinted([Kind.LEFT, Kind.RIGHT])
    pixels = image[inside & ~grown(edges_of(view, nodes), 2)]
    assert len(pixels) > 200
    assert np.abs(pixels - (rest * PAPER + (1 - rest) * tint)).max() < 1e-5


# What one plane changes


@every_camera
@pytest.mark.parametrize(
    ("row", "which", "shift"), [(0, 0, 0.02), (0, 1, -0.3), (1, 0, 0.5), (2, 1, 0.15), (5, 0, -0.2), (9, 1, 0.05)]
)
def test_shifting_one_clip_plane_changes_its_pixels_and_no_others(camera, row, which, shift):
    view = camera(WIDTH, HEIGHT)
    picture, depth = traced(view)
    shifted = NODES.copy()
    assert NODES["kind"][row] == INNER
    shifted["clip"][row, which] += np.float32(shift)
    before, after = (tree_over_picture(picture, depth, nodes, view, 4) for nodes in (NODES, shifted))
    changed = (before != after).any(axis=2)
    node, axis = NODES[row], int(NODES["axis"][row])
    lower, upper = node["lower"].astype(float), node["upper"].astype(float)
    lower[axis], upper[axis] = sorted([NODES["clip"][row, which], shifted["clip"][row, which]])
    # Its pixels are those of the space it was moved through, and the width of its edges around them.
    swept = through_box(view, lower, upper)
    assert changed.any()
    assert not (changed & ~grown(swept, 2)).any()
    # And all of them: where only the old place or only the new one is seen.
    seen = []
    for nodes in (NODES, shifted):
        lower[axis] = upper[axis] = nodes["clip"][row, which]
        seen.append(crossing(view, lower, upper, axis)[1] < depth[..., 0])
    one = (seen[0] != seen[1]) & ~border(seen[0]) & ~border(seen[1])
    # A line of a node above lies over everything; a pixel that one covers whole does not change.
    above = NODES[NODES["depth"] <= node["depth"]]
    certain = one & ~grown(edges_of(view, above), 2)
    assert changed[certain].all()
    assert certain.any() or abs(shift) < 0.1


def test_the_order_of_the_nodes_makes_no_difference():
    view = perspective(WIDTH, HEIGHT)
    picture, depth = traced(view)
    images = [tree_over_picture(picture, depth, nodes, view, 5) for nodes in (NODES, NODES[::-1])]
    # But for the rounding of sums.
    np.testing.assert_allclose(*images, atol=1e-5)


# The whole picture


def test_the_picture_is_an_8_bit_one_with_a_legend_on_the_free_corner():
    view = perspective(320, 240)
    picture, depth = nothing(view)
    depth[120:], depth[:, 160:] = 5.0, 5.0
    image = draw_overlay(picture, depth, NODES, view, 3, caption={"scene": "spheres"})
    assert (image.shape, image.dtype) == ((240, 320, 3), np.uint8)
    plain = np.clip(tree_over_picture(picture, depth, NODES, view, 3), 0, 1) * 255 + 0.5
    rows, columns = np.nonzero((image != plain.astype(np.uint8)).any(axis=2))
    # Its first row is the lowest: the free corner is the lower left one.
    assert rows.max() < 0.65 * 240
    assert columns.max() < 0.45 * 320
    panel = legend(NODES[NODES["depth"] <= 3], 3, {"scene": "spheres"}, 320, 240)
    assert panel.shape[0] * panel.shape[1] > 0.05 * 320 * 240
    bottom, left = rows.min(), columns.min()
    part = image[bottom : bottom + panel.shape[0], left : left + panel.shape[1]]
    np.testing.assert_allclose(part, np.clip(panel[::-1], 0, 1) * 255, atol=0.51)


def test_the_legend_counts_what_is_drawn():
    drawn = NODES[NODES["depth"] <= 5]
    inner, leaves = (int((drawn["kind"] == kind).sum()) for kind in (INNER, LEAF))
    overlaps = int((drawn["clip"][:, 1] < drawn["clip"][:, 0]).sum())
    text = "\n".join(legend_texts(drawn, 5, {"tree": "bih, classic", "leaf size": "4"}))
    assert "depth 5" in text
    assert f"{len(drawn)} nodes: {inner} inner, {leaves} leaves" in text
    assert f"{overlaps} with an overlap; {len(MESH.triangles)} triangles" in text
    assert "tree: bih, classic\nleaf size: 4" in text
    one = "\n".join(legend_texts(one_node(None), 0, {}))
    assert "1 node: 0 inner, 1 leaf\n" in one


def test_the_legend_shows_every_colour():
    unbuilt = NODES.copy()
    unbuilt["kind"][-3:] = UNBUILT
    assert "not yet subdivided: 3" in legend_texts(unbuilt, 5, {})
    assert not any("subdivided" in text for text in legend_texts(NODES, 5, {}))
    panel = legend(unbuilt, 5, {}, 2000, 1500)
    for kind, colour in style.COLOURS.items():
        assert (np.abs(panel - np.float32(colour)).max(axis=2) < 0.02).sum() > 100, kind


@pytest.mark.parametrize("size", [(1, 1), (2, 50), (7, 3), (64, 48)])
def test_small_pictures_have_one_too(size):
    view = perspective(*size)
    image = draw_overlay(*nothing(view), NODES, view, 5, caption={"scene": "a long caption " * 4})
    assert image.shape == (size[1], size[0], 3)


def test_deeper_than_the_styles_and_deeper_than_the_tree():
    deep = np.concatenate([one_node((0.5, -0.5))] * 40)
    deep["depth"] = np.arange(40)
    view = perspective(96, 72)
    shown = [over_nothing(view, deep, depth) for depth in (38, 39, 1000)]
    assert np.isfinite(shown[0]).all()
    np.testing.assert_array_equal(shown[1], shown[2])
