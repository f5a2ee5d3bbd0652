"""Where the instances of a scene are before any of them is traced: their boxes, and a picture of these."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from .camera import CameraView
from .mesh import Mesh, bounds_of

FILL, EDGE = 0.15, 0.4
"""How much of what lies behind a box its face hides, and its outline, of one pixel."""

GREY = 0.5
"""Scene-linear radiance of boxes."""

AT_ONCE = 16_384
"""Boxes that are projected together: what is computed of them stays in the cache."""


class InstanceBoxes:
    """Boxes of instances in the world, made as the instances come: each mesh is looked at once."""

    def __init__(self) -> None:
        self._middles: list[NDArray[np.float64]] = []
        self._halves: list[NDArray[np.float64]] = []

    def boxes(
        self, meshes: Sequence[Mesh], instance_mesh: NDArray[np.int32], instance_matrix: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(N, 2, 3) lower and upper corners of N instances; `meshes` are those of the last call, and more. The matrices
        (N, 4, 4) are finite. Each mesh's own box, moved: what holds it may be a little larger than what it holds."""
        for mesh in meshes[len(self._middles) :]:
            lower, upper = bounds_of(mesh.vertices).astype(np.float64)
            self._middles.append(0.5 * (lower + upper))
            self._halves.append(0.5 * (upper - lower))
        if not len(instance_mesh):
            return np.zeros((0, 2, 3))
        turn = instance_matrix[:, :3, :3]
        middle = np.einsum("nij,nj->ni", turn, np.array(self._middles)[instance_mesh]) + instance_matrix[:, :3, 3]
        half = np.einsum("nij,nj->ni", np.abs(turn), np.array(self._halves)[instance_mesh])
        return np.stack([middle - half, middle + half], axis=1)


class BoundsPicture:
    """A picture of boxes, in which more may be drawn: of each the rectangle that it covers, with an outline, and what
    lies behind shines through. A box that reaches behind the camera is not drawn: its rectangle has no end."""

    def __init__(self, view: CameraView) -> None:
        self.view = view
        # One step at each corner of a rectangle: the sums along both sides say how many lie over a pixel.
        self._faces = np.zeros((view.height + 1, view.width + 1), np.int32)
        self._outlines = self._faces.copy()

    def add(self, boxes: NDArray[np.float64]) -> None:
        """Draw boxes (N, 2, 3)."""
        if not len(boxes):
            return
        parts = [self._rectangles(boxes[start : start + AT_ONCE]) for start in range(0, len(boxes), AT_ONCE)]
        first, last = (np.concatenate(side, axis=1) for side in zip(*parts, strict=True))
        _step(self._faces, first, last, 1)
        _step(self._outlines, first, last, 1)
        _step(self._outlines, first + 1, np.maximum(last - 1, first + 1), -1)

    def pixels(self) -> NDArray[np.float32]:
        """(H, W, 4) premultiplied, scene-linear, first row at the bottom."""
        faces, outlines = (
            steps.cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32)[:-1, :-1]
            for steps in (self._faces, self._outlines)
        )
        alpha = 1.0 - _shining_through(FILL, faces) * _shining_through(EDGE, outlines)
        return alpha[..., None] * np.array([GREY, GREY, GREY, 1.0], np.float32)

    def _rectangles(self, boxes: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(2, K) first pixel, and the one after the last, in x and y, of those of the boxes that are seen."""
        to_clip = self.view.world_to_clip[[0, 1, 3]]
        lower, size = boxes[:, 0].T, (boxes[:, 1] - boxes[:, 0]).T
        corner = to_clip[:, :3] @ lower + to_clip[:, 3:]
        edges = to_clip.T[:3, :, None] * size[:, None]
        least, most = np.full((2, len(boxes)), np.inf), np.full((2, len(boxes)), -np.inf)
        is_before = np.ones(len(boxes), bool)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            for x, y, z in product((0, 1), repeat=3):
                place = corner + x * edges[0] + y * edges[1] + z * edges[2]
                is_before &= place[2] > 0
                place = place[:2] / place[2]
                np.minimum(least, place, out=least)
                np.maximum(most, place, out=most)
        sides = np.array([[self.view.width], [self.view.height]])
        is_seen = is_before & (least < 1).all(axis=0) & (most > -1).all(axis=0)
        first, last = ((np.clip(end[:, is_seen], -1.1, 1.1) + 1) * (0.5 * sides) for end in (least, most))
        first, last = np.floor(first).astype(np.int32), np.ceil(last).astype(np.int32)
        return first, np.maximum(last, first + 1)


def _step(steps: NDArray[np.int32], first: NDArray[np.int32], last: NDArray[np.int32], by: int) -> None:
    """Count what lies in the rectangles `by` times more."""
    height, width = steps.shape
    most = np.array([[width - 1], [height - 1]])
    left, bottom = np.clip(first, 0, most)
    right, top = np.clip(last, 0, most)
    for x, y, sign in ((left, bottom, by), (right, top, by), (right, bottom, -by), (left, top, -by)):
        steps += sign * np.bincount(y * width + x, minlength=height * width).reshape(height, width).astype(np.int32)


def _shining_through(opacity: float, layers: NDArray[np.int32]) -> NDArray[np.float32]:
    """What so many layers of this opacity let through."""
    shares: NDArray[np.float32] = ((1.0 - opacity) ** np.arange(layers.max() + 1)).astype(np.float32)
    return shares[layers]
