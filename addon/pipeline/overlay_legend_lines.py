"""What the legend over a viewport says: a kind, whose colour stands before it, and a line each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .overlay import INNER, LEAF, UNBUILT, Kind, overlapping
from .overlay_boxes import SHOWN, in_range
from .ray_path import RayPath

Entry = tuple[Kind | None, str]


def entries(nodes: NDArray[np.void], shown: str, first: int, last: int, *, path: RayPath | None = None) -> list[Entry]:
    """Of what is shown, with its number; nothing where nothing is."""
    if shown == "ray":
        if path is None:
            return [(None, "Pick a ray to see the nodes that it visits")]
        what = f"triangle {path.triangle:,}" if path.is_hit else "nothing"
        titles = [f"The ray hits {what}, after {len(path.visited):,} nodes of two children"]
        titles.append(f"As it is stored: {path.nodes:,} records or nodes visited, {path.tests:,} triangles tested")
        return [*((None, title) for title in titles), *_counted(nodes[path.visited], "planes", is_path=True)]
    if shown not in SHOWN:
        return []
    end = min(last, int(nodes["depth"].max(initial=0)))
    title = f"Depth {first} to {end}" if end > first else f"Depth {first}"
    return [(None, title), *_counted(in_range(nodes, first, last), shown, is_path=False)]


def apart(places: Sequence[tuple[float, float, float]], height: float) -> list[float]:
    """Where the lower edges of labels of one `height` go, so that none covers another: those that would, given by the
    middle, the lower edge and the width, are raised, from the lowest up."""
    found = [lower for _, lower, _ in places]
    put: list[tuple[float, float, float]] = []
    for row in sorted(range(len(places)), key=lambda row: places[row][1]):
        middle, lower, width = places[row]
        for other, below, across in sorted(put, key=lambda label: label[1]):
            if 2 * abs(middle - other) < width + across and below - height < lower < below + height:
                lower = below + height
        found[row] = lower
        put.append((middle, lower, width))
    return found


def _counted(nodes: NDArray[np.void], shown: str, *, is_path: bool) -> list[Entry]:
    inner, leaves, unbuilt = (int(np.count_nonzero(nodes["kind"] == kind)) for kind in (INNER, LEAF, UNBUILT))
    split = int(np.count_nonzero((nodes["kind"] == INNER) & (nodes["axis"] >= 0)))
    lines: list[Entry] = []
    if shown == "planes" and split:
        lines += [
            (Kind.LEFT, f"Left child ends: {split:,}"),
            (Kind.RIGHT, f"Right child starts: {split:,}"),
            (Kind.OVERLAP, f"Overlap, in both: {len(overlapping(nodes)):,}"),
        ]
    if inner and (shown == "boxes" or is_path or inner > split):
        lines.append((Kind.BOX, f"Box of a node: {inner:,}"))
    if leaves:
        lines.append((Kind.LEAF_BOX, f"Leaf: {leaves:,}"))
    if unbuilt:
        lines.append((Kind.UNBUILT_BOX, f"Not yet subdivided: {unbuilt:,}"))
    return lines
