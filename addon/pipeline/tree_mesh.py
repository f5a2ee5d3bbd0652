"""The tree as meshes: vertices and faces of the boxes or clip planes of some depths, one mesh a look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .errors import UserError
from .overlay import Kind
from .overlay_boxes import in_range, whole_boxes

BOX_FACES = np.array([(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
"""Corners of the six sides of a box, seen from outside in turn."""

MOST_OUTLINES = 50_000
"""More boxes and planes than Blender's own editing copes with."""

NAMES = {
    Kind.BOX: "Box",
    Kind.LEAF_BOX: "Leaf",
    Kind.RIGHT: "Right Plane",
    Kind.LEFT: "Left Plane",
    Kind.OVERLAP: "Overlap",
    Kind.UNBUILT_BOX: "Unbuilt",
}
KINDS = {
    "planes": (Kind.LEFT, Kind.RIGHT, Kind.LEAF_BOX, Kind.UNBUILT_BOX),
    "boxes": (Kind.BOX, Kind.LEAF_BOX, Kind.UNBUILT_BOX),
    "leaves": (Kind.LEAF_BOX, Kind.UNBUILT_BOX),
}


@dataclass(frozen=True)
class TreeMesh:
    """Vertices (V, 3) float32 and faces (F, 4) int32 of all outlines of one look."""

    name: str
    kind: Kind
    depth: int
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]


def tree_meshes(nodes: NDArray[np.void], shown: str, first: int, last: int) -> list[TreeMesh]:
    """Those of the nodes from depth `first` to `last`; `shown` is a name of KINDS. Raises UserError for none,
    and for more than MOST_OUTLINES."""
    found = [chunk for chunk in whole_boxes(in_range(nodes, first, last)) if chunk.kind in KINDS[shown]]
    count = sum(len(chunk.corners) for chunk in found)
    if not count:
        raise UserError(f"the tree has nothing to show from depth {first} to {last}; choose another range")
    if count > MOST_OUTLINES:
        raise UserError(f"{count:,} boxes and planes from depth {first} to {last}, more than {MOST_OUTLINES:,}")
    made = []
    for kind, depth in sorted({(chunk.kind, chunk.depth) for chunk in found}):
        parts = [chunk.corners for chunk in found if (chunk.kind, chunk.depth) == (kind, depth)]
        corners = np.concatenate(parts)
        one = BOX_FACES if corners.shape[1] == 8 else np.arange(4)[None]
        rows = one + corners.shape[1] * np.arange(len(corners))[:, None, None]
        name = f"{NAMES[kind]} {depth}"
        made.append(TreeMesh(name, kind, depth, corners.reshape(-1, 3), rows.reshape(-1, 4).astype(np.int32)))
    return made
