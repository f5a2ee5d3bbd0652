"""The geometry of the overlay: nodes() in, projected lines and faces out.

Everything is in picture space: x and y in pixels from the lower left, and the nearness in place of the depth. The
nearness is the reciprocal of the depth for a perspective camera and minus the depth for an orthographic one: it is
larger for what is nearer, and linear in x and y along any line and over any plane.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .camera import CameraView

INNER, LEAF, UNBUILT = 0, 1, 2  # nodes()["kind"]
EDGES = np.array([(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit])
"""The twelve edges of a box; bit i of a corner's number chooses upper[i]."""


class Kind(IntEnum):
    """What a line or a face shows."""

    BOX = 0  # the box of a node that has children
    LEAF_BOX = 1
    RIGHT = 2  # the lower clip plane of the right child
    LEFT = 3  # the upper clip plane of the left child
    OVERLAP = 4  # a side of the slab between the two planes that is in both children
    UNBUILT_BOX = 5  # the box of a node that no ray has come to yet


BOX_KINDS = np.array([Kind.BOX, Kind.LEAF_BOX, Kind.UNBUILT_BOX])
"""By nodes()["kind"]."""


@dataclass(frozen=True)
class Lines:
    """N lines: ends (N, 2, 3) float64 are x, y and nearness; kind (N,) a Kind, depth (N,) that of the node."""

    ends: NDArray[np.float64]
    kind: NDArray[np.uint8]
    depth: NDArray[np.int32]


@dataclass(frozen=True)
class Face:
    """A convex polygon: corners (K, 2) are x and y; the nearness at (x, y) is plane · (x, y, 1)."""

    corners: NDArray[np.float64]
    plane: NDArray[np.float64]
    kind: Kind
    depth: int


def scene_nearness(depth: NDArray[np.floating[Any]], nodes: NDArray[np.void], view: CameraView) -> NDArray[np.float64]:
    """The nearness of a depth pass (H, W), counted from the camera along the viewing axis; always finite.

    A miss (inf) is 0 for a perspective camera, and behind every node for an orthographic one.
    """
    depth = np.asarray(depth, np.float64)
    if view.perspective:
        return 1.0 / depth
    boxes = _to_picture(_to_clip(_box_corners(nodes[:1]), view), view)[..., 2]
    nearest, farthest = boxes.max(initial=0.0), boxes.min(initial=0.0)
    return np.where(np.isinf(depth), farthest - (nearest - farthest), -depth)


def overlay_lines(nodes: NDArray[np.void], view: CameraView) -> Lines:
    """The edges of every node's box and of both clip planes of every inner node, as far as they are in the picture."""
    boxes = _box_corners(nodes)[:, EDGES].reshape(-1, 2, 3)
    kinds = [np.repeat(BOX_KINDS[nodes["kind"]], len(EDGES))]
    depths = [np.repeat(nodes["depth"], len(EDGES))]
    lines = [boxes]
    inner = _inner(nodes)
    for kind in (Kind.LEFT, Kind.RIGHT):
        corners = _rectangles(*_clip_plane(inner, kind), inner["axis"])
        lines.append(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3))
        kinds.append(np.full(4 * len(inner), kind))
        depths.append(np.repeat(inner["depth"], 4))
    return _projected_lines(np.concatenate(lines), np.concatenate(kinds), np.concatenate(depths), view)


def overlay_faces(nodes: NDArray[np.void], view: CameraView) -> Iterator[Face]:
    """Both clip planes of every inner node within its box, and the four sides of the slab between them."""
    inner = _inner(nodes)
    for kind in (Kind.LEFT, Kind.RIGHT):
        yield from _projected_faces(*_clip_plane(inner, kind), inner["axis"], inner["depth"], kind, view)
    both = overlapping(nodes)
    rows, axis = np.arange(len(both)), both["axis"]
    lower, upper = _corners(both)
    upper[rows, axis], lower[rows, axis] = both["clip"].T
    for step in (1, 2):
        across = (axis + step) % 3
        for side in (lower, upper):
            flat_lower, flat_upper = lower.copy(), upper.copy()
            flat_lower[rows, across] = flat_upper[rows, across] = side[rows, across]
            yield from _projected_faces(flat_lower, flat_upper, across, both["depth"], Kind.OVERLAP, view)


def overlapping(nodes: NDArray[np.void]) -> NDArray[np.void]:
    """The inner nodes whose left child ends beyond the start of the right one."""
    inner = _inner(nodes)
    both: NDArray[np.void] = inner[inner["clip"][:, 1] < inner["clip"][:, 0]]
    return both


def _inner(nodes: NDArray[np.void]) -> NDArray[np.void]:
    inner: NDArray[np.void] = nodes[nodes["kind"] == INNER]
    return inner


def _corners(nodes: NDArray[np.void]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return nodes["lower"].astype(np.float64), nodes["upper"].astype(np.float64)


def _box_corners(nodes: NDArray[np.void]) -> NDArray[np.float64]:
    """(N, 8, 3)."""
    lower, upper = _corners(nodes)
    chosen = (np.arange(8)[:, None] >> np.arange(3)) & 1
    return np.where(chosen, upper[:, None], lower[:, None])


def _clip_plane(inner: NDArray[np.void], kind: Kind) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corners (N, 3) of the rectangles that the nodes' boxes cut out of one of their clip planes."""
    lower, upper = _corners(inner)
    rows, axis = np.arange(len(inner)), inner["axis"]
    lower[rows, axis] = upper[rows, axis] = inner["clip"][:, 0 if kind is Kind.LEFT else 1]
    return lower, upper


def _rectangles(
    lower: NDArray[np.float64], upper: NDArray[np.float64], axis: NDArray[np.integer[Any]]
) -> NDArray[np.float64]:
    """Boxes without extent along `axis` (N,) to their corners (N, 4, 3), in turn."""
    rows, u, v = np.arange(len(lower)), (axis + 1) % 3, (axis + 2) % 3
    corners = np.repeat(lower[:, None], 4, axis=1)
    for corner in (1, 2):
        corners[rows, corner, u] = upper[rows, u]
    for corner in (2, 3):
        corners[rows, corner, v] = upper[rows, v]
    return corners


def _to_clip(points: NDArray[np.float64], view: CameraView) -> NDArray[np.float64]:
    matrix = view.world_to_clip
    clip: NDArray[np.float64] = points @ matrix[:, :3].T + matrix[:, 3]
    return clip


def _to_picture(clip: NDArray[np.float64], view: CameraView) -> NDArray[np.float64]:
    """Points (..., 4) of clip space, in front of the camera, to x, y and nearness."""
    ndc = clip[..., :3] / clip[..., 3:]
    x = (ndc[..., 0] + 1.0) * (0.5 * view.width)
    y = (ndc[..., 1] + 1.0) * (0.5 * view.height)
    nearness = 1.0 / clip[..., 3] if view.perspective else -(view.near + (ndc[..., 2] + 1.0) * _half_range(view))
    return np.stack([x, y, nearness], axis=-1)


def _half_range(view: CameraView) -> float:
    """Half the distance from the near to the far plane of an orthographic camera."""
    return float(np.linalg.norm(view.clip_to_world[:3, 2]))


def _projected_lines(
    points: NDArray[np.float64], kind: NDArray[np.integer[Any]], depth: NDArray[np.integer[Any]], view: CameraView
) -> Lines:
    """World-space lines (N, 2, 3), cut off at the near plane and at the picture's edges; those outside are dropped."""
    clip = _to_clip(points, view)
    start, way = clip[:, 0], clip[:, 1] - clip[:, 0]
    enter, leave = np.zeros(len(clip)), np.ones(len(clip))
    for side in _VIEW_SIDES:
        distance, change = start @ side, way @ side
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = -distance / change
        enter = np.where(change > 0.0, np.maximum(enter, crossing), enter)
        leave = np.where(change < 0.0, np.minimum(leave, crossing), leave)
        leave = np.where((change == 0.0) & (distance < 0.0), -1.0, leave)
    seen = enter <= leave
    fractions = np.stack([enter, leave], axis=1)[seen, :, None]
    ends = start[seen, None] + fractions * way[seen, None]
    return Lines(_to_picture(ends, view), kind[seen].astype(np.uint8), depth[seen].astype(np.int32))


_VIEW_SIDES = np.array([[0, 0, 1, 1], [1, 0, 0, 1.1], [-1, 0, 0, 1.1], [0, 1, 0, 1.1], [0, -1, 0, 1.1]], np.float64)
"""Near, left, right, bottom, top: side · clip >= 0 is inside. A tenth more than the picture, for the width of lines."""


def _projected_faces(
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    axis: NDArray[np.integer[Any]],
    depth: NDArray[np.integer[Any]],
    kind: Kind,
    view: CameraView,
) -> Iterator[Face]:
    """World-space rectangles across `axis` as faces; those behind the near plane or seen edge-on are dropped."""
    clip = _to_clip(_rectangles(lower, upper, axis), view)
    rows = np.arange(len(lower))
    world_plane = np.zeros((len(lower), 4))
    world_plane[rows, axis] = 1.0
    world_plane[:, 3] = -lower[rows, axis]
    planes = _nearness_planes(world_plane @ view.clip_to_world, view)
    distance = clip @ _VIEW_SIDES[0]
    for row in np.flatnonzero((distance > 0.0).any(axis=1) & np.isfinite(planes).all(axis=1)):
        corners = clip[row] if (distance[row] >= 0.0).all() else _cut_polygon(clip[row], distance[row])
        yield Face(_to_picture(corners, view)[:, :2], planes[row], kind, int(depth[row]))


def _nearness_planes(clip_planes: NDArray[np.float64], view: CameraView) -> NDArray[np.float64]:
    """Planes (N, 4) of clip space to (N, 3) factors of x, y and 1 of their nearness; not finite where edge-on."""
    with np.errstate(divide="ignore", invalid="ignore"):
        z = -clip_planes[:, [0, 1, 3]] / clip_planes[:, 2:3]
    if view.perspective:  # w = 1 / ((x, y, z, 1) · last row)
        row = view.clip_to_world[3]
        ndc = z * row[2] + row[[0, 1, 3]]
    else:
        ndc = -z * _half_range(view)
        ndc[:, 2] -= view.near + _half_range(view)
    across = ndc[:, :2] * (2.0 / view.width, 2.0 / view.height)
    return np.column_stack([across, ndc[:, 2] - ndc[:, 0] - ndc[:, 1]])


def _cut_polygon(corners: NDArray[np.float64], distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of a convex polygon (K, 4) where the distance (K,) to a plane is not negative."""
    kept = []
    for here, there in zip(range(len(corners)), np.roll(range(len(corners)), -1), strict=True):
        if distance[here] >= 0.0:
            kept.append(corners[here])
        if (distance[here] < 0.0) != (distance[there] < 0.0):
            fraction = distance[here] / (distance[here] - distance[there])
            kept.append(corners[here] + fraction * (corners[there] - corners[here]))
    return np.array(kept)
