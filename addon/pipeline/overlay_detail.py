"""How much of the overlay a view needs: nothing of what is outside, points for what is smaller than a few pixels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .overlay_boxes import CORNERS, Chunk

SMALL = 4.0
"""Pixels: an outline that is nowhere longer is drawn as a point, as one could not see what it is."""

MOST_LINES = 15_000
"""Lines of a redraw where a processor draws: the largest outlines, all others are points. By
processor times that leaves time for ten redraws a second of 100,000 boxes; what was seen is in
docs/decisions/overlay-viewport.md."""

MOST_LINES_OF_A_GPU = 4_000_000

HIDDEN = -1.0


class Extents:
    """Where chunks lie and how large their outlines are, for a look at all of them at once."""

    def __init__(self, chunks: Sequence[Chunk]) -> None:
        bounds = np.array([chunk.bounds for chunk in chunks], np.float64).reshape(-1, 2, 3)
        self.corners: NDArray[np.float64] = np.where(CORNERS, bounds[:, None, 1], bounds[:, None, 0])
        self.sizes: NDArray[np.float64] = np.array([chunk.size for chunk in chunks], np.float64)
        self.counts: NDArray[np.int64] = np.array([len(chunk.corners) for chunk in chunks], np.int64)
        self.has_parts: NDArray[np.bool_] = np.array([chunk.has_parts for chunk in chunks], bool)
        self.lines: NDArray[np.int64] = np.array([chunk.line_count for chunk in chunks], np.int64)

    def pixels(self, world_to_clip: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
        """(C,) how many pixels an outline of each chunk covers at most, in x or in y, where it is seen; HIDDEN where no
        part of the chunk can be seen.

        Of two points that are seen at a distance s of each other, x / w differs by no more than
        s · (|row of x| + |x / w| · |row of w|) / least w, and |x / w| is at most 1 in the picture.
        """
        clip = self.corners @ world_to_clip[:, :3].T + world_to_clip[:, 3]
        w = clip[..., 3]
        beside = [(side * clip[..., axis] > w).all(axis=1) for axis in range(3) for side in (1, -1)]
        nearest = w.min(axis=1)
        rows = np.linalg.norm(world_to_clip[:, :3], axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            seen = np.minimum(np.abs(clip[..., :2]).max(axis=1) / nearest[:, None], 1.0)
            across = (rows[:2] + seen * rows[3]) * (0.5 * width, 0.5 * height)
            pixels = np.where(nearest > 0, self.sizes * across.max(axis=1) / nearest, np.inf)
        found: NDArray[np.float64] = np.where(np.any(beside, axis=0), HIDDEN, pixels)
        return found

    def is_lines(self, pixels: NDArray[np.float64], most: int) -> NDArray[np.bool_]:
        """(C,) which chunks, of so many pixels each, are drawn as lines: the largest outlines, `most` lines in all."""
        order = np.argsort(-pixels, kind="stable")
        drawn = np.where(pixels > SMALL, self.lines, 0)[order]
        within = np.empty(len(order), bool)
        within[order] = np.cumsum(drawn) <= most
        chosen: NDArray[np.bool_] = within & (pixels > SMALL)
        return chosen

    def is_points(self, pixels: NDArray[np.float64], is_lines: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(C,) which chunks are drawn as points: of the others those that are seen, but not where their children's
        points lie within theirs: a box of a few pixels is as well told by them."""
        chosen: NDArray[np.bool_] = (pixels >= 0) & ~is_lines & ~self.has_parts
        return chosen
