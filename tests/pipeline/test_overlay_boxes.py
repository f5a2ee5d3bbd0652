"""The tree in the world: every box and plane is drawn where it is, nothing twice, and little where little is seen."""

from __future__ import annotations

from collections import Counter

import bihtree
import numpy as np
import pytest

from addon.pipeline import overlay_boxes, overlay_legend_lines, tree_mesh
from addon.pipeline.camera import perspective_view
from addon.pipeline.errors import UserError
from addon.pipeline.overlay import EDGES, Kind, overlapping
from addon.pipeline.overlay_boxes import RECTANGLE, chunks, faces, in_range, whole_boxes
from addon.pipeline.overlay_detail import HIDDEN, SMALL, Extents
from tests.meshes import icosphere

BALL = icosphere(3)


def nodes_of(**options: object) -> np.ndarray:
    return bihtree.Tree(*BALL, **options).nodes()


def segments(found: list[overlay_boxes.Chunk]) -> Counter:
    """How often each line is drawn, whichever way round."""
    lines = [chunk.corners.reshape(-1, 3)[chunk.edges] for chunk in found]
    return Counter(tuple(sorted(map(tuple, line))) for line in np.concatenate(lines).tolist())


def is_on(line: tuple, others: np.ndarray) -> bool:
    """Whether an axis-parallel line lies within one of others (N, 2, 3)."""
    low, high = np.minimum(*line), np.maximum(*line)
    return bool(((others.min(axis=1) <= low) & (high <= others.max(axis=1))).all(axis=1).any())


@pytest.mark.parametrize("options", [{}, {"layout": "classic"}, {"structure": "kd_tree"}, {"structure": "bvh"}])
def test_the_lines_of_all_boxes_are_those_that_are_drawn(options):
    """Boxes are not drawn whole, but what is drawn covers every edge of every box, and each of it is one."""
    nodes = nodes_of(**options)
    nodes = nodes[nodes["depth"] <= 6]
    found = segments(chunks(nodes, "boxes", 0, 6))
    every = overlay_boxes.boxes_of(nodes)[:, EDGES].reshape(-1, 2, 3)
    edges = {tuple(sorted(map(tuple, line))) for line in every.tolist()}
    assert set(found) <= edges
    drawn = np.array(list(found))
    assert all(is_on(line, drawn) for line in edges)
    if options.get("structure") != "bvh":
        assert sum(found.values()) < 0.75 * len(every)


def test_planes_lie_where_the_tree_says():
    nodes = nodes_of()
    inner = nodes[nodes["kind"] == 0]
    for kind, side in ((Kind.LEFT, 0), (Kind.RIGHT, 1)):
        corners = np.concatenate([chunk.corners for chunk in chunks(nodes, "planes", 0, 99) if chunk.kind is kind])
        assert corners.shape == (len(inner), 4, 3)
        found = {
            (int(np.argmin(np.ptp(one, axis=0))), *one.min(axis=0).tolist(), *one.max(axis=0).tolist())
            for one in corners
        }
        expected = set()
        for node in inner:
            low, high = node["lower"].copy(), node["upper"].copy()
            low[node["axis"]] = high[node["axis"]] = node["clip"][side]
            expected.add((int(node["axis"]), *low.tolist(), *high.tolist()))
        assert found == expected


def test_a_range_of_depths_is_that_range():
    nodes = nodes_of()
    for first, last in ((0, 0), (3, 5), (4, 99), (50, 60)):
        found = chunks(nodes, "boxes", first, last)
        assert {chunk.depth for chunk in found} == set(in_range(nodes, first, last)["depth"].tolist())
        assert sum(len(chunk.corners) for chunk in found) == len(in_range(nodes, first, last))
    leaves = chunks(nodes, "leaves", 0, 99)
    assert {chunk.kind for chunk in leaves} == {Kind.LEAF_BOX}
    assert sum(len(chunk.corners) for chunk in leaves) == np.count_nonzero(nodes["kind"] == 1)
    tops = [chunk for chunk in chunks(nodes, "planes", 2, 4) if chunk.kind is Kind.BOX]
    assert {chunk.depth for chunk in tops} == {2} and all(chunk.corners.shape[1] == 8 for chunk in tops)


def test_what_is_not_built_is_of_its_own_kind():
    tree = bihtree.Tree(*icosphere(5), build="on_demand", leaf_size=1)
    nodes = tree.nodes()
    found = chunks(nodes, "leaves", 0, 99)
    unbuilt = np.count_nonzero(nodes["kind"] == 2)
    assert unbuilt > 0
    assert sum(len(chunk.corners) for chunk in found if chunk.kind is Kind.UNBUILT_BOX) == unbuilt
    assert (Kind.UNBUILT_BOX, f"Not yet subdivided: {unbuilt:,}") in overlay_legend_lines.entries(
        nodes, "leaves", 0, 99
    )
    tree.build_all()
    assert all(chunk.kind is not Kind.UNBUILT_BOX for chunk in chunks(tree.nodes(), "leaves", 0, 99))


def test_both_planes_of_a_kd_tree_are_one():
    kinds = {chunk.kind for chunk in chunks(nodes_of(structure="kd_tree"), "planes", 0, 9)}
    assert Kind.LEFT in kinds and Kind.RIGHT not in kinds


def test_overlaps_are_filled_with_slabs():
    nodes = nodes_of()
    of_kind = {kind: [part for part in faces(nodes) if part.kind is kind] for kind in (Kind.LEFT, Kind.OVERLAP)}
    assert sum(len(part.corners) for part in of_kind[Kind.OVERLAP]) == 8 * len(overlapping(nodes))
    assert sum(len(part.corners) for part in of_kind[Kind.LEFT]) == 2 * np.count_nonzero(nodes["kind"] == 0)
    root = nodes[0]
    slab = next(part for part in of_kind[Kind.OVERLAP] if part.depth == 0).corners[..., root["axis"]]
    assert (slab.min(), slab.max()) == (root["clip"][1], root["clip"][0])


def test_moved_is_the_same_elsewhere():
    nodes = nodes_of()
    for here, there in zip(chunks(nodes, "planes", 0, 3), chunks(nodes, "planes", 0, 3, move=[8, 0, 0]), strict=True):
        np.testing.assert_array_equal(here.corners + np.float32([8, 0, 0]), there.corners)
        np.testing.assert_array_equal(here.bounds + np.float32([8, 0, 0]), there.bounds)


def test_no_chunk_holds_outlines_of_other_sizes_or_outside_its_bounds():
    for chunk in [*chunks(nodes_of(leaf_size=1), "boxes", 0, 99), *whole_boxes(nodes_of())]:
        sizes = np.linalg.norm(np.ptp(chunk.corners, axis=1).astype(float), axis=1)
        assert np.isclose(sizes.max(), chunk.size) and sizes.min() >= chunk.size / 2.01
        assert (chunk.corners >= chunk.bounds[0]).all() and (chunk.corners <= chunk.bounds[1]).all()
        assert chunk.line_count == len(chunk.edges)
        assert len(RECTANGLE) * 2 < len(EDGES)


@pytest.mark.parametrize("distance", [1.5, 4.0, 40.0])
def test_pixels_are_never_more_than_the_bound(distance):
    """Every outline in the picture is projected, and what is said to be hidden is not in the picture."""
    found = chunks(nodes_of(leaf_size=1), "boxes", 0, 99)
    extents = Extents(found)
    eye, target, up = (np.array(point, float) for point in ((0.3, -1, 0.2), (0.2, 0, 0), (0, 0, 1)))
    view = perspective_view(distance * eye, target, up, 320, 200, field_of_view=0.7, near=0.1, far=100.0)
    world_to_clip = np.linalg.inv(view.clip_to_world)
    pixels = extents.pixels(world_to_clip, 320, 200)
    tight = 0
    for chunk, most in zip(found, pixels, strict=True):
        clip = chunk.corners.astype(float) @ world_to_clip[:, :3].T + world_to_clip[:, 3]
        inside = (np.abs(clip[..., :3]) <= clip[..., 3:]).all(axis=-1)
        if most == HIDDEN:
            assert not inside.any()
            continue
        whole = inside.all(axis=1)
        seen = clip[whole][..., :2] / clip[whole][..., 3:] * (160, 100)
        size = np.ptp(seen, axis=1).max() if whole.any() else 0.0
        assert size <= most * (1 + 1e-9)
        tight += size > most / 8
    assert tight


def test_lines_go_to_the_largest():
    found = chunks(nodes_of(leaf_size=1), "boxes", 0, 99)
    extents = Extents(found)
    pixels = np.array([chunk.size * 100 for chunk in found])
    assert extents.is_lines(pixels, 10**9).sum() == np.count_nonzero(pixels > SMALL)
    for most in (0, 500, 5000):
        is_lines = extents.is_lines(pixels, most)
        assert extents.lines[is_lines].sum() <= most
        if is_lines.any() and not is_lines.all():
            left = pixels[~is_lines & (pixels > SMALL)]
            assert pixels[is_lines].min() >= left.max()


@pytest.mark.parametrize("shown", ["boxes", "planes", "leaves"])
def test_points_are_of_nodes_whose_children_are_not_drawn(shown):
    """Every node of the range is still there: as lines, as a point, or by the points of what it is made of."""
    nodes = nodes_of(leaf_size=1)[:700]
    assert nodes["kind"][-1] == 0, "read in part: a level ends in the middle"
    for last in (5, 99):
        found = chunks(nodes, shown, 0, last)
        extents = Extents(found)
        parents = set(nodes["parent"][nodes["depth"] <= last].tolist())
        whole = np.flatnonzero((nodes["kind"] != 0) | ~np.isin(np.arange(len(nodes)), list(parents)))
        expected = sum(nodes["depth"][whole] <= last) if shown == "boxes" else None
        pixels, none = np.ones(len(found)), np.zeros(len(found), bool)
        is_points = extents.is_points(pixels, none)
        points = sum(len(found[number].corners) for number in np.flatnonzero(is_points))
        if shown == "boxes":
            assert points == expected < sum(len(chunk.corners) for chunk in found)
        assert all(found[number].kind not in (Kind.LEAF_BOX, Kind.UNBUILT_BOX) for number in np.flatnonzero(~is_points))
        assert (
            not extents.is_points(pixels, ~none).any()
            and not extents.is_points(np.full(len(found), HIDDEN), none).any()
        )


def test_a_mesh_of_the_tree_has_its_boxes():
    nodes = nodes_of()
    made = tree_mesh.tree_meshes(nodes, "boxes", 1, 3)
    assert sum(len(part.vertices) for part in made) == 8 * len(in_range(nodes, 1, 3))
    assert sum(len(part.faces) for part in made) == 6 * len(in_range(nodes, 1, 3))
    for part in made:
        box = part.vertices[part.faces[:6]].astype(float)
        normals = np.cross(box[:, 1] - box[:, 0], box[:, 2] - box[:, 0])
        outward = box.mean(axis=1) - box.mean(axis=(0, 1))
        assert ((normals * outward).sum(axis=1) > 0).all(), "faces look outward"
    assert {part.kind for part in tree_mesh.tree_meshes(nodes, "planes", 0, 2)} == {Kind.LEFT, Kind.RIGHT}
    with pytest.raises(UserError, match="nothing to show"):
        tree_mesh.tree_meshes(nodes, "leaves", 0, 0)
    with pytest.raises(UserError, match="more than 50,000"):
        tree_mesh.tree_meshes(np.repeat(nodes, 200), "boxes", 0, 99)


def test_labels_that_would_cover_each_other_are_raised() -> None:
    beside, above = (300.0, 100.0, 150.0), (120.0, 130.0, 150.0)
    assert overlay_legend_lines.apart([(100.0, 100.0, 150.0), beside], 30.0) == [100.0, 100.0]
    assert overlay_legend_lines.apart([(100.0, 100.0, 150.0), above], 30.0) == [100.0, 130.0]
    assert overlay_legend_lines.apart([(100.0, 110.0, 150.0), (120.0, 100.0, 150.0)], 30.0) == [130.0, 100.0]
    three = overlay_legend_lines.apart([(0.0, 0.0, 10.0), (5.0, 5.0, 10.0), (9.0, 29.0, 10.0)], 30.0)
    assert three == [0.0, 30.0, 60.0]
