"""Lines and faces to pixels: drawn at a multiple of the picture's size against its depth, then reduced.

OpenImageIO's lines are one pixel wide and have no depth, and it fills no polygons, so the drawing is done here. What
is drawn at a pixel depends only on the lines and faces that cover it, in no order. `scene` (H, W) float32 is always
`pushed_away`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .overlay import Face, Kind

MULTIPLE = 3
"""Drawn at this multiple of the picture's width and height: 10 steps from bare to covered."""

BAND = 64
"""Rows of the picture whose faces are drawn at once."""

FRAGMENTS = 1 << 18
"""Parts of lines, one sub-pixel each, that are drawn at once."""

ROUNDING = 2.0**-20
"""Relative difference of two nearnesses that counts as none: depth pass, interpolation and the nearness of a face are
each rounded to float32 (2^-24) a few times, and a clip plane often touches the surface exactly."""


@dataclass(frozen=True)
class Look:
    """How lines are drawn: width in pixels, and straight RGBA where seen and where hidden."""

    width: float
    seen: tuple[float, float, float, float]
    hidden: tuple[float, float, float, float]


def pushed_away(nearness: NDArray[np.float64]) -> NDArray[np.float32]:
    """The scene's nearness, a little farther than rounding errors could make it."""
    return (nearness - ROUNDING * np.abs(nearness)).astype(np.float32)


def face_thickness(
    faces: Sequence[Face],
    opacity: dict[Kind, NDArray[np.float64]],
    scene: NDArray[np.float32],
    hatch: tuple[float, float],
) -> dict[Kind, NDArray[np.float32]]:
    """Optical thickness (H, W) of the faces of each kind in front of the scene: exp(-thickness) of what is behind
    them is left.

    opacity[kind][depth] is that of one face. Sides of an overlap are hatched: hatch is the stripes' period and width
    in pixels.
    """
    height, width = scene.shape
    thickness = {kind: np.zeros((height, width), np.float32) for kind in opacity}
    share = np.arange(MULTIPLE**2 + 1) / MULTIPLE**2
    tables = {kind: -np.log1p(-opacities[:, None] * share).astype(np.float32) for kind, opacities in opacity.items()}
    low = np.array([np.floor(face.corners.min(axis=0)) for face in faces]).reshape(-1, 2)
    high = np.array([np.ceil(face.corners.max(axis=0)) for face in faces]).reshape(-1, 2)
    period, stripe = (max(1, round(size * MULTIPLE)) for size in hatch)
    for bottom in range(0, height, BAND):
        top = min(bottom + BAND, height)
        band = _interpolated(scene, bottom, top)
        rows, columns = np.arange(bottom * MULTIPLE, top * MULTIPLE), np.arange(width * MULTIPLE)
        stripes = (rows[:, None] + columns) % period < stripe
        first = np.maximum(low, (0, bottom)).astype(np.intp)
        last = np.minimum(high, (width, top)).astype(np.intp)
        for row in np.flatnonzero((first < last).all(axis=1)):
            face = faces[row]
            window = slice(first[row, 1], last[row, 1]), slice(first[row, 0], last[row, 0])
            # Seen almost edge-on, a plane's nearness may leave the range of float32, on no more than a sub-pixel.
            with np.errstate(over="ignore", invalid="ignore"):
                seen = _seen(face, window, band, bottom)
            if face.kind is Kind.OVERLAP:
                seen &= stripes[_finer(window[0], bottom), _finer(window[1])]
            thickness[face.kind][window] += tables[face.kind][face.depth][_reduced(seen)]
    return thickness


def _interpolated(scene: NDArray[np.float32], bottom: int, top: int) -> NDArray[np.float32]:
    """Rows bottom to top of the scene at the multiple of its size, bilinear between the middles of pixels."""
    return _between(_between(scene, bottom, top, 0), 0, scene.shape[1], 1)


def _between(values: NDArray[np.float32], start: int, end: int, axis: int) -> NDArray[np.float32]:
    last = values.shape[axis] - 1
    places = np.clip((np.arange(start * MULTIPLE, end * MULTIPLE) + 0.5) / MULTIPLE - 0.5, 0, last)
    below = np.floor(places).astype(np.intp)
    share = (places - below).astype(np.float32)
    low, high = values.take(below, axis), values.take(np.minimum(below + 1, last), axis)
    return low + (share[:, None] if axis == 0 else share) * (high - low)


def _finer(pixels: slice, start: int = 0) -> slice:
    return slice((pixels.start - start) * MULTIPLE, (pixels.stop - start) * MULTIPLE)


def _seen(face: Face, window: tuple[slice, slice], band: NDArray[np.float32], bottom: int) -> NDArray[np.bool_]:
    """Which sub-pixels of the window the face covers in front of the scene, by their middles."""
    y, x = ((np.arange(part.start * MULTIPLE, part.stop * MULTIPLE) + 0.5) / MULTIPLE for part in window)
    across, up, constant = face.plane
    # The larger terms are added in double precision; float32 halves the time of the rest.
    nearness = (up * y + constant).astype(np.float32)[:, None] + (across * x).astype(np.float32)
    seen: NDArray[np.bool_] = nearness >= band[_finer(window[0], bottom), _finer(window[1])]
    first, last = _spans(face.corners, y)
    columns = x.astype(np.float32)
    seen &= columns >= first.astype(np.float32)[:, None]
    seen &= columns < last.astype(np.float32)[:, None]
    return seen


def _spans(corners: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where a convex polygon begins and ends along the rows at y; (inf, -inf) where it is not."""
    start, end = corners, np.roll(corners, -1, axis=0)
    crossed = (start[:, 1] <= y[:, None]) != (end[:, 1] <= y[:, None])
    rise = np.where(start[:, 1] == end[:, 1], 1.0, end[:, 1] - start[:, 1])
    x = start[:, 0] + (y[:, None] - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
    return np.where(crossed, x, np.inf).min(axis=1), np.where(crossed, x, -np.inf).max(axis=1)


def _reduced(seen: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """How many sub-pixels of each pixel are set."""
    rows = seen.view(np.uint8).reshape(-1, MULTIPLE, seen.shape[1]).sum(axis=1, dtype=np.uint8)
    counts: NDArray[np.uint8] = rows[:, ::MULTIPLE].copy()
    for column in range(1, MULTIPLE):
        counts += rows[:, column::MULTIPLE]
    return counts


def line_layer(
    looks: Sequence[Look], lines: Iterable[tuple[int, NDArray[np.float64]]], scene: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Premultiplied RGBA (H, W, 4) of lines.

    `lines` are pairs of a row of `looks` and ends (N, 2, 3): x, y and nearness. The first of at most 127 looks lies
    on top, hidden parts below all seen ones. A part is hidden where it is farther than the scene at its pixel and at
    the eight around it: lines lie in surfaces so often that less would make them flicker.
    """
    height, width = scene.shape
    farthest = _farthest_around(scene).ravel()
    painted = np.zeros(height * width * MULTIPLE**2, np.uint8)
    for row, ends in lines:
        hidden, seen = np.uint8(len(looks) - row), np.uint8(2 * len(looks) - row)
        for place, nearness in _fragments(ends, looks[row].width, width, height):
            pixel = place // (width * MULTIPLE**2) * width + place % (width * MULTIPLE) // MULTIPLE
            is_seen = nearness >= farthest[pixel]
            for number, here in ((hidden, place[~is_seen]), (seen, place[is_seen])):
                painted[here] = np.maximum(painted[here], number)
    colours = np.zeros((2 * len(looks) + 1, 4), np.float32)
    for row, look in enumerate(looks):
        colours[len(looks) - row] = _premultiplied(look.hidden)
        colours[2 * len(looks) - row] = _premultiplied(look.seen)
    cells = painted.reshape(height, MULTIPLE, width, MULTIPLE)
    drawn = cells.any(axis=(1, 3))
    layer = np.zeros((height, width, 4), np.float32)
    layer[drawn] = colours[cells.transpose(0, 2, 1, 3)[drawn]].mean(axis=(1, 2))
    return layer


def _premultiplied(colour: tuple[float, float, float, float]) -> NDArray[np.float32]:
    return np.array([*(channel * colour[3] for channel in colour[:3]), colour[3]], np.float32)


def _farthest_around(scene: NDArray[np.float32]) -> NDArray[np.float32]:
    padded = np.pad(scene, 1, mode="edge")
    rows = np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:])
    return np.minimum(np.minimum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])


def _fragments(
    ends: NDArray[np.float64], line_width: float, width: int, height: int
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """The sub-pixels of lines, some more than once, and their nearness.

    A line has one step a sub-pixel along its longer side, and in each as many sub-pixels across as give its width.
    """
    start = ends[:, 0] * (MULTIPLE, MULTIPLE, 1.0)
    way = ends[:, 1] * (MULTIPLE, MULTIPLE, 1.0) - start
    steep = np.abs(way[:, 1]) > np.abs(way[:, 0])
    longer = np.abs(way[:, :2]).max(axis=1, initial=0.0)
    steps = np.maximum(np.ceil(longer), 1.0)
    slant = np.divide(np.linalg.norm(way[:, :2], axis=1), longer, out=np.ones_like(longer), where=longer > 0.0)
    across = np.maximum(np.rint(line_width * MULTIPLE * slant), 1.0).astype(np.int64)
    count = steps.astype(np.int64) * across
    for first, last in _runs(count):
        line = np.repeat(np.arange(first, last), count[first:last])
        ends_at = np.cumsum(count[first:last])
        index = np.arange(len(line)) - np.repeat(ends_at - count[first:last], count[first:last])
        t = (index // across[line] + 0.5) / steps[line]
        aside = index % across[line] - 0.5 * (across[line] - 1)
        x = np.floor(start[line, 0] + t * way[line, 0] + np.where(steep[line], aside, 0.0)).astype(np.int64)
        y = np.floor(start[line, 1] + t * way[line, 1] + np.where(steep[line], 0.0, aside)).astype(np.int64)
        inside = (x >= 0) & (x < width * MULTIPLE) & (y >= 0) & (y < height * MULTIPLE)
        nearness = (start[line, 2] + t * way[line, 2]).astype(np.float32)
        yield (y * (width * MULTIPLE) + x)[inside], nearness[inside]


def _runs(count: NDArray[np.int64]) -> Iterator[tuple[int, int]]:
    """Ranges of lines whose counts add up to about FRAGMENTS."""
    cuts = np.flatnonzero(np.diff(np.cumsum(count) // FRAGMENTS)) + 1
    bounds = [0, *cuts.tolist(), len(count)]
    return ((first, last) for first, last in pairwise(bounds) if first < last)
