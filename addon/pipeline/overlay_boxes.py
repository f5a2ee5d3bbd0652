"""The tree in the world, for a viewport: nodes() in, outlines and faces out, as they are drawn.

Outlines lie in chunks of one look (what they show, how deep), neighbours together, so that a viewport can leave out
what it does not see, and draw points for outlines of a few pixels (addon/pipeline/overlay_detail.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .overlay import BOX_KINDS, EDGES, INNER, LEAF, UNBUILT, Kind, overlapping

CHUNK = 2048
"""Outlines of a chunk: few enough to leave out what is not seen, and enough for few calls to the GPU."""

SHOWN = ("planes", "boxes", "leaves")
"""Clip planes, and boxes where there are none; the box of every node; those of leaves alone."""

CORNERS = (np.arange(8)[:, None] >> np.arange(3)) & 1
RECTANGLE = np.array([(0, 1), (1, 2), (2, 3), (3, 0)])


@dataclass(frozen=True)
class Chunk:
    """Outlines of one look: corners (N, 8, 3) of boxes or (N, 4, 3) of planes, float32; all lie in `bounds` (2, 3), and
    none is longer than `size`. `has_parts`: of each node the children are drawn, too."""

    kind: Kind
    depth: int
    corners: NDArray[np.float32]
    bounds: NDArray[np.float32]
    size: float
    has_parts: bool = False

    @property
    def line_count(self) -> int:
        count, corners = self.corners.shape[:2]
        return count * (len(EDGES) if corners == 8 else len(RECTANGLE))

    @property
    def edges(self) -> NDArray[np.int32]:
        """(E, 2) rows of the corners, in one list, of all lines."""
        count, corners = self.corners.shape[:2]
        one = EDGES if corners == 8 else RECTANGLE
        rows: NDArray[np.int32] = (one + corners * np.arange(count)[:, None, None]).reshape(-1, 2).astype(np.int32)
        return rows

    @property
    def centres(self) -> NDArray[np.float32]:
        """(N, 3) a point for each outline."""
        middle: NDArray[np.float32] = self.corners.mean(axis=1, dtype=np.float32)
        return middle


@dataclass(frozen=True)
class Faces:
    """Triangles (T, 3, 3) float32 of one look."""

    kind: Kind
    depth: int
    corners: NDArray[np.float32]


def in_range(nodes: NDArray[np.void], first: int, last: int) -> NDArray[np.void]:
    """The nodes from depth `first` to depth `last`."""
    chosen: NDArray[np.void] = nodes[(nodes["depth"] >= first) & (nodes["depth"] <= last)]
    return chosen


def chunks(
    nodes: NDArray[np.void], shown: str, first: int, last: int, *, move: NDArray[Any] | None = None
) -> list[Chunk]:
    """What is drawn of `nodes`, all that were read, from depth `first` to `last`: `shown` is one of SHOWN. Moved by
    `move` (3,).

    No line is drawn twice in one colour: of a box below another one only the face at the parent's clip plane, whose
    edges are the only ones that do not lie on the parent's. Leaves, and all boxes of a bvh, are whole.
    """
    found: list[Chunk] = []
    step = np.zeros(3, np.float32) if move is None else np.asarray(move, np.float32)
    is_parent = np.zeros(len(nodes), bool)
    is_parent[nodes["parent"][nodes["parent"] >= 0]] = True
    for depth in range(first, min(last, int(nodes["depth"].max(initial=-1))) + 1):
        is_here = nodes["depth"] == depth
        for has_parts in (False, True):
            level = nodes[is_here & ((is_parent & (depth < last)) == has_parts)]
            for kind, corners in _outlines(nodes, level, shown, is_top=depth == first):
                found += chunks_of(kind, depth, corners + step, has_parts=has_parts)
    return found


def whole_boxes(nodes: NDArray[np.void]) -> list[Chunk]:
    """All edges of each box, and both clip planes of those that have some."""
    found: list[Chunk] = []
    for depth in np.unique(nodes["depth"]).tolist():
        level = nodes[nodes["depth"] == depth]
        for kind in (Kind.LEFT, Kind.RIGHT):
            found += chunks_of(kind, depth, _planes(_with_planes(level), kind))
        for number, box in enumerate(BOX_KINDS):
            found += chunks_of(Kind(box), depth, boxes_of(level[level["kind"] == number]))
    return found


def chunks_of(kind: Kind, depth: int, corners: NDArray[np.float32], *, has_parts: bool = False) -> list[Chunk]:
    """Outlines of one look in chunks whose sizes differ by a factor of two at most, in their order."""
    if not len(corners):
        return []
    sides = (corners.max(axis=1) - corners.min(axis=1)).astype(np.float64)
    sizes = np.linalg.norm(sides, axis=1)
    with np.errstate(divide="ignore"):
        octaves = np.ceil(np.log2(sizes))
    found = []
    for octave in np.unique(octaves):
        of_one_size = np.flatnonzero(octaves == octave)
        for start in range(0, len(of_one_size), CHUNK):
            rows = of_one_size[start : start + CHUNK]
            part = np.ascontiguousarray(corners[rows], np.float32)
            flat = part.reshape(-1, 3)
            bounds = np.stack([flat.min(axis=0), flat.max(axis=0)])
            found.append(Chunk(kind, depth, part, bounds, float(sizes[rows].max()), has_parts))
    return found


def faces(nodes: NDArray[np.void], *, move: NDArray[Any] | None = None) -> list[Faces]:
    """Both clip planes of every inner node and the sides of the slab where they overlap, as triangles."""
    found: list[Faces] = []
    step = np.zeros(3, np.float32) if move is None else np.asarray(move, np.float32)
    for depth in np.unique(nodes["depth"]):
        level = _with_planes(nodes[nodes["depth"] == depth])
        for kind in (Kind.LEFT, Kind.RIGHT):
            corners = _planes(level, kind)
            if len(corners):
                found.append(Faces(kind, int(depth), _triangles(corners) + step))
        both = overlapping(level)
        if len(both):
            found.append(Faces(Kind.OVERLAP, int(depth), _triangles(_slab_sides(both)) + step))
    return found


def boxes_of(nodes: NDArray[np.void]) -> NDArray[np.float32]:
    """(N, 8, 3) corners; bit i of a corner's number chooses upper[i]."""
    corners: NDArray[np.float32] = np.where(CORNERS, nodes["upper"][:, None], nodes["lower"][:, None])
    return corners


def _outlines(
    nodes: NDArray[np.void], level: NDArray[np.void], shown: str, *, is_top: bool
) -> Iterator[tuple[Kind, NDArray[np.float32]]]:
    inner = level[level["kind"] == INNER]
    if shown == "planes":
        split = _with_planes(inner)
        yield Kind.LEFT, _planes(split, Kind.LEFT)
        # one plane, not two, where both are the same: in a kd-tree
        apart = split[split["clip"][:, 0] != split["clip"][:, 1]]
        yield Kind.RIGHT, _planes(apart, Kind.RIGHT)
    if shown != "leaves":
        axes = nodes["axis"][np.maximum(inner["parent"], 0)]
        is_whole = (axes < 0) | (inner["parent"] < 0) | is_top
        yield Kind.BOX, boxes_of(inner[is_whole])
        if shown == "boxes":
            yield Kind.BOX, _faces_at_plane(nodes, inner[~is_whole])
    for kind in (LEAF, UNBUILT):
        yield Kind(BOX_KINDS[kind]), boxes_of(level[level["kind"] == kind])


def _faces_at_plane(nodes: NDArray[np.void], children: NDArray[np.void]) -> NDArray[np.float32]:
    """(N, 4, 3) the face of each box that lies in its parent's clip plane: its upper one of a left child, which the
    parent's box continues behind, its lower one of a right child."""
    parents, faces_of = nodes[children["parent"]], children.copy()
    rows, axis = np.arange(len(children)), parents["axis"]
    is_left = children["upper"][rows, axis] != parents["upper"][rows, axis]
    faces_of["axis"] = axis
    at = np.where(is_left, children["upper"][rows, axis], children["lower"][rows, axis])
    faces_of["clip"] = at[:, None]
    return _planes(faces_of, Kind.LEFT)


def _with_planes(nodes: NDArray[np.void]) -> NDArray[np.void]:
    """Inner nodes but those of a bvh."""
    split: NDArray[np.void] = nodes[(nodes["kind"] == INNER) & (nodes["axis"] >= 0)]
    return split


def _planes(split: NDArray[np.void], kind: Kind) -> NDArray[np.float32]:
    """(N, 4, 3) the rectangles that the boxes cut out of a clip plane, their corners in turn."""
    corners = np.repeat(split["lower"][:, None], 4, axis=1)
    rows, axis = np.arange(len(split)), split["axis"]
    u, v = (axis + 1) % 3, (axis + 2) % 3
    for corner in range(4):
        corners[rows, corner, axis] = split["clip"][:, 0 if kind is Kind.LEFT else 1]
    for corner, along in ((1, u), (2, u), (2, v), (3, v)):
        corners[rows, corner, along] = split["upper"][rows, along]
    return corners


def _slab_sides(both: NDArray[np.void]) -> NDArray[np.float32]:
    """(4 N, 4, 3) the sides of the slab between the right child's lower plane and the left child's upper one."""
    slab = both.copy()
    rows, axis = np.arange(len(both)), both["axis"]
    slab["lower"][rows, axis], slab["upper"][rows, axis] = both["clip"][:, 1], both["clip"][:, 0]
    sides = []
    for step in (1, 2):
        across = slab.copy()
        across["axis"] = (axis + step) % 3
        for end in ("lower", "upper"):
            across["clip"][:, 0] = slab[end][rows, across["axis"]]
            sides.append(_planes(across, Kind.LEFT))
    return np.concatenate(sides)


def _triangles(rectangles: NDArray[np.float32]) -> NDArray[np.float32]:
    """(N, 4, 3) to (2 N, 3, 3)."""
    return rectangles[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
