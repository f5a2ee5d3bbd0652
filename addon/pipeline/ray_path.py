"""Which nodes one ray visits, and in which order: the walk of the paper, near child first, over rows of nodes()."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bihtree
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .overlay import INNER, LEAF


@dataclass(frozen=True)
class RayPath:
    """`visited` are rows of nodes() in the order of the walk, `ends` (2, 3) the ray as far as it goes; `triangle` is
    the row that is hit, -1 for none; `nodes` and `tests` are what the tree itself counts."""

    visited: NDArray[np.int32]
    ends: NDArray[np.float64]
    triangle: int
    nodes: int
    tests: int

    @property
    def is_hit(self) -> bool:
        return self.triangle >= 0


def ray_path(tree: bihtree.Tree, origin: ArrayLike, direction: ArrayLike, *, limit: int | None = None) -> RayPath:
    """The walk of one ray; it builds what it comes to of a tree on demand. `limit`: only the first so many nodes are
    looked at."""
    start = np.asarray(origin, np.float64).reshape(3)
    way = np.asarray(direction, np.float64).reshape(3)
    hit = tree.intersect(start[None], way[None])
    cost_nodes, cost_tests = tree.traversal_cost(start[None], way[None])
    hits = tree.intersect_all(start[None], way[None])
    nodes = tree.nodes(limit=limit)  # when all these rays have built what they come to
    visited = walk(nodes, start, way, _leaf_hits(nodes, tree.order(), hits.triangle, hits.t))
    is_hit = bool(hit.hit[0])
    length = float(hit.t[0]) if is_hit else _leaving(nodes, start, way)
    ends = np.stack([start, start + length * way])
    return RayPath(visited, ends, int(hit.triangle[0]), int(cost_nodes[0]), int(cost_tests[0]))


def walk(
    nodes: NDArray[np.void], start: NDArray[np.float64], way: NDArray[np.float64], leaf_hits: dict[int, float]
) -> NDArray[np.int32]:
    """Rows in the order in which they are visited; `leaf_hits` is the nearest hit in each leaf that has one."""
    if not len(nodes):
        return np.zeros(0, np.int32)
    enter, leave = _intervals(nodes, start, way)
    children = _children(nodes)
    visited, closest = [], np.inf
    stack = [0] if enter[0] <= leave[0] else []
    while stack:
        row = stack.pop()
        if enter[row] > closest:
            continue
        visited.append(row)
        if nodes["kind"][row] == LEAF:
            closest = min(closest, leaf_hits.get(row, np.inf))
            continue
        met = [child for child in children[row] if child >= 0 and enter[child] <= leave[child]]
        near_first = sorted(met, key=lambda child: float(enter[child]))
        stack += near_first[::-1]
    return np.array(visited, np.int32)


def _children(nodes: NDArray[np.void]) -> NDArray[np.int32]:
    """(N, 2) rows of the children; -1 where there is none, or it was not read."""
    children = np.full((len(nodes), 2), -1, np.int32)
    rows = np.arange(1, len(nodes))
    parents = nodes["parent"][1:]
    # breadth first, the left child before the right one, side by side
    is_second = np.zeros(len(rows), bool)
    is_second[1:] = parents[1:] == parents[:-1]
    children[parents[~is_second], 0] = rows[~is_second]
    children[parents[is_second], 1] = rows[is_second]
    return children


def _intervals(
    nodes: NDArray[np.void], start: NDArray[np.float64], way: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(N,) where the ray enters and leaves each box, from 0 on; it enters after it leaves where it misses."""
    enter, leave = np.zeros(len(nodes)), np.full(len(nodes), np.inf)
    for axis in range(3):
        lower, upper = (nodes[end][:, axis].astype(np.float64) for end in ("lower", "upper"))
        if way[axis] == 0.0:
            leave[(start[axis] < lower) | (start[axis] > upper)] = -1.0
            continue
        first, second = (lower - start[axis]) / way[axis], (upper - start[axis]) / way[axis]
        enter = np.maximum(enter, np.minimum(first, second))
        leave = np.minimum(leave, np.maximum(first, second))
    return enter, leave


def _leaf_hits(
    nodes: NDArray[np.void], order: NDArray[np.int32], triangles: NDArray[np.int32], t: NDArray[np.floating[Any]]
) -> dict[int, float]:
    """The nearest of the hits in each leaf."""
    found: dict[int, float] = {}
    leaves = np.flatnonzero(nodes["kind"] == LEAF)
    first, count = nodes["first"][leaves], nodes["count"][leaves]
    for row, distance in zip(triangles, t, strict=True):
        for place in np.flatnonzero(order == row):  # a kd-tree has some more than once
            for leaf in leaves[(first <= place) & (place < first + count)]:
                found[int(leaf)] = min(found.get(int(leaf), np.inf), float(distance))
    return found


def _leaving(nodes: NDArray[np.void], start: NDArray[np.float64], way: NDArray[np.float64]) -> float:
    """Where a ray that hits nothing is drawn to: a little behind the tree."""
    enter, leave = _intervals(nodes[:1], start, way)
    if len(enter) and enter[0] <= leave[0]:
        return 1.1 * float(leave[0])
    size = float(np.linalg.norm(nodes["upper"][0] - nodes["lower"][0])) if len(nodes) else 1.0
    return 2.0 * size / (float(np.linalg.norm(way)) or 1.0)


def numbers(nodes: NDArray[np.void], row: int) -> list[tuple[str, str]]:
    """What a node stores, a label and a value each."""
    node = nodes[row]
    kind = ("Inner node", "Leaf", "Not yet subdivided")[node["kind"]]
    rows = [("Node", f"{row:,}, depth {node['depth']}"), ("Kind", kind)]
    if node["kind"] == INNER and node["axis"] >= 0:
        left, right = (float(plane) for plane in node["clip"])
        between = "overlap" if right < left else "gap"
        rows += [
            ("Axis", "xyz"[node["axis"]]),
            ("Left ends", f"{left:.6g}"),
            ("Right starts", f"{right:.6g}"),
            (between.capitalize(), f"{abs(left - right):.6g}"),
        ]
    ends = zip("XYZ", node["lower"].tolist(), node["upper"].tolist(), strict=True)
    rows += [(f"Box, {axis}", f"{lower:.4g} to {upper:.4g}") for axis, lower, upper in ends]
    rows.append(("Triangles", f"{node['count']:,}, from {node['first']:,} on"))
    return rows


def parent_of(nodes: NDArray[np.void], row: int) -> int:
    """Its row; that of the root is its own."""
    return max(0, int(nodes["parent"][row]))


def child_of(nodes: NDArray[np.void], row: int, side: int) -> int:
    """The row of the left (0) or right (1) child; `row` where it has none."""
    found = np.flatnonzero(nodes["parent"] == row)
    return int(found[side]) if side < len(found) else row
