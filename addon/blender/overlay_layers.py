"""What the overlay draws of a scene, made again only when what it is made of changes; no gpu here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import bpy
import numpy as np
from numpy.typing import NDArray

from ..pipeline import overlay_boxes, overlay_style, shaded_mesh
from ..pipeline.built import BuiltTree
from ..pipeline.overlay_detail import Extents
from .trees import SceneTrees

Made = TypeVar("Made")

BESIDE = 1.15
"""How far, in widths of the scene, the second structure stands beside the first."""


@dataclass(frozen=True)
class Outlines:
    """The chunks of one tree, the last drawn on top."""

    chunks: list[overlay_boxes.Chunk]
    extents: Extents


@dataclass(frozen=True)
class ColouredMesh:
    """Corners (3 T, 3) and their colours (3 T, 4)."""

    positions: NDArray[np.float32]
    colours: NDArray[np.float32]


class Layers:
    """What was made last, by name, and what it was made of."""

    def __init__(self) -> None:
        self._made: dict[str, tuple[tuple[Any, ...], Any]] = {}

    def layer(self, name: str, made_of: tuple[Any, ...], make: Callable[[], Made]) -> Made:
        kept = self._made.get(name)
        if kept is None or not _are_same(kept[0], made_of):
            kept = (made_of, make())
            self._made[name] = kept
        made: Made = kept[1]
        return made

    def drop(self, name: str) -> None:
        self._made.pop(name, None)


def outlines(built: BuiltTree, chosen: bpy.types.PropertyGroup, move: NDArray[Any] | None) -> Outlines:
    """Those of the chosen depths."""
    first, last = chosen.first_depth, chosen.last_depth
    return sorted_outlines(overlay_boxes.chunks(built.nodes, chosen.shown, first, last, move=move))


def path_outlines(trees: SceneTrees) -> Outlines:
    """The boxes of the nodes that the picked ray visits, and the planes of the inner ones."""
    assert trees.main is not None
    assert trees.path is not None
    return sorted_outlines(overlay_boxes.whole_boxes(trees.main.nodes[trees.path.visited]))


def selected_outlines(trees: SceneTrees) -> Outlines:
    assert trees.main is not None
    return sorted_outlines(overlay_boxes.whole_boxes(trees.main.nodes[[trees.selected]]))


def bounds_outlines(boxes: NDArray[np.float64]) -> Outlines:
    """Those of boxes (N, 2, 3) of what is read and built."""
    corners = np.where(overlay_boxes.CORNERS, boxes[:, None, 1], boxes[:, None, 0]).astype(np.float32)
    return sorted_outlines(overlay_boxes.chunks_of(overlay_style.Kind.BOX, 0, corners))


def selected_box(trees: SceneTrees) -> NDArray[np.float32]:
    """(8, 3)."""
    assert trees.main is not None
    corners: NDArray[np.float32] = overlay_boxes.boxes_of(trees.main.nodes[[trees.selected]])[0]
    return corners


def faces(built: BuiltTree, chosen: bpy.types.PropertyGroup, move: NDArray[Any] | None) -> list[overlay_boxes.Faces]:
    """Filled planes of the upper of the chosen depths."""
    last = min(chosen.last_depth, overlay_style.FACE_LEVELS - 1)
    return overlay_boxes.faces(overlay_boxes.in_range(built.nodes, chosen.first_depth, last), move=move)


def cost_mesh(trees: SceneTrees) -> ColouredMesh:
    assert trees.main is not None
    assert trees.cost is not None
    rows = trees.main.triangles.ravel()
    positions = shaded_mesh.corner_positions(trees.main.vertices, trees.main.triangles)
    return ColouredMesh(positions, np.ascontiguousarray(trees.cost.colours()[rows]))


def other_mesh(trees: SceneTrees) -> ColouredMesh:
    """The mesh once more, beside itself."""
    assert trees.other is not None
    positions = shaded_mesh.corner_positions(trees.other.vertices, trees.other.triangles)
    colours = shaded_mesh.grey_corners(trees.other.vertices, trees.other.triangles)
    return ColouredMesh(positions + beside(trees).astype(np.float32), colours)


def beside(trees: SceneTrees) -> NDArray[np.float64]:
    """(3,) from the first structure to the second: along x."""
    assert trees.main is not None
    lower, upper = trees.main.tree.bounds.astype(np.float64)
    return np.array([BESIDE * (upper[0] - lower[0]), 0.0, 0.0])


def sorted_outlines(chunks: list[overlay_boxes.Chunk]) -> Outlines:
    chunks.sort(key=lambda chunk: -overlay_style.line_rank(chunk.kind, chunk.depth))
    return Outlines(chunks, Extents(chunks))


def _are_same(some: tuple[Any, ...], others: tuple[Any, ...]) -> bool:
    """The same objects, or equal numbers and words: arrays are not compared."""
    plain = (bool, int, float, str, tuple)
    return len(some) == len(others) and all(
        a is b or (isinstance(a, plain) and type(a) is type(b) and a == b) for a, b in zip(some, others, strict=True)
    )
