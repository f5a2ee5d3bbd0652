"""The nodes() table of a bounding interval hierarchy, written down from its definition in NumPy."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

NODE_DTYPE = np.dtype(
    [
        ("parent", "i4"),
        ("depth", "i4"),
        ("kind", "u1"),
        ("axis", "i1"),
        ("clip", "f4", 2),
        ("lower", "f4", 3),
        ("upper", "f4", 3),
        ("first", "i8"),
        ("count", "i8"),
    ]
)
INNER, LEAF = 0, 1


def naive_nodes(
    vertices: NDArray[np.float32], triangles: NDArray[np.int32], *, leaf_size: int = 4, max_depth: int | None = None
) -> tuple[NDArray[np.void], NDArray[np.int64]]:
    """The rows of nodes(max_depth) and order() of the tree by the global heuristic, breadth first.

    The cell starts as the bounds of all triangles. Its longest side (the lowest axis of equals) is halved; a triangle
    whose bounds have their centre below that plane goes left, any other right. A half without triangles is dropped
    and the cell shrinks to the other half. The left child's upper clip plane is the largest coordinate of its
    triangles, the right child's lower one the smallest. order() is complete only without max_depth, and triangles of
    zero area or with coinciding centres are beyond it.
    """
    corners = vertices[triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    centre = (low.astype(np.float64) + high) / 2
    root_low, root_high = low.min(axis=0), high.max(axis=0)
    order = np.arange(len(triangles))
    rows: list[tuple[object, ...]] = []
    waiting = deque([(-1, 0, 0, len(order), root_low, root_high, np.array([root_low, root_high], np.float64))])
    while waiting:
        parent, depth, first, end, box_low, box_high, cell = waiting.popleft()
        mine = order[first:end]
        if len(mine) <= leaf_size:
            mine.sort()
            rows.append((parent, depth, LEAF, -1, (np.nan, np.nan), box_low, box_high, first, end - first))
            continue
        while True:
            axis = int(np.argmax(cell[1] - cell[0]))
            plane = cell[:, axis].mean()
            assert cell[0, axis] < plane < cell[1, axis], "the centres coincide"
            left = centre[mine, axis] < plane
            lower_half, upper_half = cell.copy(), cell.copy()
            lower_half[1, axis] = upper_half[0, axis] = plane
            if left.any() and not left.all():
                break
            cell = lower_half if left.all() else upper_half
        order[first:end] = np.concatenate([mine[left], mine[~left]])
        middle = first + int(left.sum())
        clip = high[order[first:middle], axis].max(), low[order[middle:end], axis].min()
        row = len(rows)
        rows.append((parent, depth, INNER, axis, clip, box_low, box_high, first, end - first))
        if depth == max_depth:
            continue
        left_high, right_low = box_high.copy(), box_low.copy()
        left_high[axis], right_low[axis] = clip
        waiting.append((row, depth + 1, first, middle, box_low, left_high, lower_half))
        waiting.append((row, depth + 1, middle, end, right_low, box_high, upper_half))
    return np.array(rows, NODE_DTYPE), order
