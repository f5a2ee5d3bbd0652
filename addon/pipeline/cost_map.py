"""How much work the tree has with each point of a mesh: a colour for every vertex, and the scale beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bihtree
import numpy as np
from numpy.typing import ArrayLike, NDArray

RAMP = np.array(
    [(0.27, 0.00, 0.33), (0.23, 0.32, 0.55), (0.13, 0.57, 0.55), (0.37, 0.79, 0.38), (0.99, 0.91, 0.14)], np.float64
)
"""sRGB from little to much: five stops of viridis (CC0), whose lightness grows evenly, also for colour-blind eyes."""

MOST = 0.99
"""The share of the vertices or pixels that the scale covers; the few above have the last colour."""


@dataclass(frozen=True)
class CostMap:
    """`cost` (V,) nodes visited and triangles tested by a ray to each vertex; the scale goes from `least` to `most`."""

    cost: NDArray[np.int32]
    least: int
    most: int

    def colours(self) -> NDArray[np.float32]:
        """(V, 4) sRGB and an alpha of 1."""
        span = max(1, self.most - self.least)
        share = np.clip((self.cost - self.least) / span, 0.0, 1.0)
        return np.column_stack([ramp(share), np.ones(len(share))]).astype(np.float32)


def cost_map(
    tree: bihtree.Tree, vertices: NDArray[np.floating[Any]], eye: ArrayLike, along: ArrayLike | None = None
) -> CostMap:
    """A ray to each of vertices (V, 3): from the point `eye`, or, with `along` (3,), in that direction from as far away
    as `eye` is. A vertex that is hidden shows the ray that ends before it."""
    points = np.asarray(vertices, np.float64)
    start = np.asarray(eye, np.float64).reshape(3)
    if along is None:
        origins, directions = np.broadcast_to(start, points.shape), points - start
    else:
        way = np.asarray(along, np.float64).reshape(3)
        way = way / np.linalg.norm(way)
        depth = (points - start) @ way
        origins, directions = points - depth[:, None] * way, np.broadcast_to(way, points.shape)
    nodes, tests = tree.traversal_cost(np.ascontiguousarray(origins), np.ascontiguousarray(directions))
    cost = nodes + tests
    seen = cost[cost > 0]
    if not len(seen):
        return CostMap(cost, 0, 1)
    return CostMap(cost, int(seen.min()), int(np.quantile(seen, MOST)))


def ramp(share: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """(…, 3) the colours of shares from 0 to 1."""
    stops = np.linspace(0.0, 1.0, len(RAMP))
    return np.stack([np.interp(share, stops, channel) for channel in RAMP.T], axis=-1)
