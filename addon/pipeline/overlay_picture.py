"""The overlay picture: the tree drawn over the traced picture, with a legend."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .camera import CameraView
from .image import encode_srgb
from .overlay import Face, Kind, Lines, overlay_faces, overlay_lines, scene_nearness
from .overlay_legend import legend
from .overlay_raster import Stroke, face_thickness, line_layer, pushed_away
from .overlay_style import (
    COLOURS, DESIGN_HEIGHT, FACE_OPACITY, FADE, HATCH_PERIOD, HATCH_WIDTH, HIDDEN, LEVELS, PAPER,
    face_opacity, line_opacity, line_width,
)

LINE_ORDER = (Kind.LEFT, Kind.RIGHT, Kind.LEAF_BOX, Kind.BOX)
"""Of one depth, the first on top."""


def draw_overlay(
    picture: NDArray[np.float32], depth: NDArray[np.float32], nodes: NDArray[np.void], view: CameraView,
    max_depth: int, *, caption: Mapping[str, str],
) -> NDArray[np.uint8]:
    """The boxes of nodes() down to max_depth and their clip planes over a picture, as sRGB (H, W, 3) uint8.

    `picture` (H, W, 4) is the combined pass, scene-linear and premultiplied; `depth` (H, W, 1) the depth pass along
    the viewing axis, counted from the camera, inf for a miss; both, like the result, with their first row at the
    bottom. A plane is hidden by nearer surface, a line shows through it faintly. The legend lies over the corner with
    the fewest hits and ends with the entries of `caption`.
    """
    drawn = nodes[nodes["depth"] <= max_depth]
    scene = pushed_away(scene_nearness(depth[..., 0], drawn, view))
    image = encode_srgb(picture[..., :3] + (1.0 - picture[..., 3:]) * PAPER).astype(np.float32)
    image += FADE * (1.0 - image)
    scale = view.height / DESIGN_HEIGHT
    image = _with_faces(image, list(overlay_faces(drawn, view)), scene, scale)
    lines = line_layer(_strokes(overlay_lines(drawn, view), scale), scene)
    image = image * (1.0 - lines[..., 3:]) + lines[..., :3]
    panel = legend(drawn, max_depth, caption, view.width, view.height)[::-1]
    image[_freest_corner(np.isfinite(depth[..., 0]), panel.shape[0], panel.shape[1])] = panel
    return (np.clip(image, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def _with_faces(
    image: NDArray[np.float32], faces: list[Face], scene: NDArray[np.float32], scale: float
) -> NDArray[np.float32]:
    opacity = {kind: face_opacity(kind) for kind in FACE_OPACITY}
    faces = [face for face in faces if face.depth < LEVELS and opacity[face.kind][face.depth] > 0.0]
    thickness = face_thickness(faces, opacity, scene, (HATCH_PERIOD * scale, HATCH_WIDTH * scale))
    total = np.zeros(scene.shape, np.float32)
    tint = np.zeros_like(image)
    for kind, part in thickness.items():
        total += part
        tint += part[..., None] * np.array(COLOURS[kind], np.float32)
    tint /= np.where(total > 0.0, total, 1.0)[..., None]
    return tint + np.exp(-total)[..., None] * (image - tint)


def _strokes(lines: Lines, scale: float) -> list[Stroke]:
    strokes = []
    for depth in range(LEVELS):
        at_depth = lines.depth == depth if depth < LEVELS - 1 else lines.depth >= depth
        opacity = line_opacity(depth)
        for kind in LINE_ORDER:
            ends = lines.ends[at_depth & (lines.kind == kind)]
            seen, hidden = (*COLOURS[kind], opacity), (*COLOURS[kind], HIDDEN * opacity)
            strokes.append(Stroke(ends, scale * line_width(kind, depth), seen, hidden))
    return strokes


def _freest_corner(hit: NDArray[np.bool_], rows: int, columns: int) -> tuple[slice, slice]:
    """Where a panel of rows x columns pixels hides the fewest hits; the upper left of equals."""
    height, width = hit.shape
    margin = min(width, height) // 50
    vertical = (slice(height - margin - rows, height - margin), slice(margin, margin + rows))
    horizontal = (slice(margin, margin + columns), slice(width - margin - columns, width - margin))
    corners = [(up, along) for up in vertical for along in horizontal]
    return min(corners, key=lambda corner: int(np.count_nonzero(hit[corner])))
