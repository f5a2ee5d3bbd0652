"""The overlay picture: the tree drawn over the traced picture, with a legend."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from . import overlay_style as style
from .camera import CameraView
from .image import encode_srgb
from .overlay import Face, Kind, overlay_faces, overlay_lines, scene_nearness
from .overlay_legend import legend
from .overlay_raster import Look, face_thickness, line_layer, pushed_away

LINE_KINDS = (Kind.BOX, Kind.LEAF_BOX, Kind.RIGHT, Kind.LEFT, Kind.UNBUILT_BOX)

NODES = 8192
"""Nodes whose lines are held at once."""


def draw_overlay(
    picture: NDArray[np.float32],
    depth: NDArray[np.float32],
    nodes: NDArray[np.void],
    view: CameraView,
    max_depth: int,
    *,
    caption: Mapping[str, str],
) -> NDArray[np.uint8]:
    """`tree_over_picture` with a legend, as sRGB (H, W, 3) uint8.

    The legend lies over the corner with the fewest hits and ends with the entries of `caption`. UserError where
    OpenImageIO is missing.
    """
    image = tree_over_picture(picture, depth, nodes, view, max_depth)
    panel = legend(nodes[nodes["depth"] <= max_depth], max_depth, caption, view.width, view.height)[::-1]
    image[freest_corner(np.isfinite(depth[..., 0]), panel.shape[0], panel.shape[1])] = panel
    finished: NDArray[np.uint8] = (np.clip(image, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    return finished


def tree_over_picture(
    picture: NDArray[np.float32],
    depth: NDArray[np.float32],
    nodes: NDArray[np.void],
    view: CameraView,
    max_depth: int,
) -> NDArray[np.float32]:
    """The boxes of nodes() down to max_depth and their clip planes over a picture: sRGB (H, W, 3) in [0, 1].

    `picture` (H, W, 4) is the combined pass, scene-linear and premultiplied; `depth` (H, W, 1) the depth pass along
    the viewing axis, counted from the camera, inf for a miss; both, like the result, with their first row at the
    bottom. A plane is hidden by nearer surface, a line shows through it faintly.
    """
    drawn = nodes[nodes["depth"] <= max_depth]
    scene = pushed_away(scene_nearness(depth[..., 0], drawn, view))
    image = encode_srgb(picture[..., :3] + (1.0 - picture[..., 3:]) * style.PAPER).astype(np.float32)
    image += style.FADE * (1.0 - image)
    scale = min(view.width / style.DESIGN_SIZE[0], view.height / style.DESIGN_SIZE[1])
    image = _with_faces(image, list(overlay_faces(drawn[drawn["depth"] < style.FACE_LEVELS], view)), scene, scale)
    lines = _line_layer(drawn, view, scene, scale)
    blended: NDArray[np.float32] = image * (1.0 - lines[..., 3:]) + lines[..., :3]
    return blended


def _with_faces(
    image: NDArray[np.float32], faces: list[Face], scene: NDArray[np.float32], scale: float
) -> NDArray[np.float32]:
    period = max(style.HATCH_PERIOD * scale, style.LEAST_HATCH_PERIOD)
    stripe = period * style.HATCH_WIDTH / style.HATCH_PERIOD
    thickness = face_thickness(faces, style.FACE_OPACITY, scene, (period, stripe))
    total = np.zeros(scene.shape, np.float32)
    tint = np.zeros_like(image)
    for kind, part in thickness.items():
        total += part
        tint += part[..., None] * np.array(style.COLOURS[kind], np.float32)
    tint /= np.where(total > 0.0, total, 1.0)[..., None]
    blended: NDArray[np.float32] = tint + np.exp(-total)[..., None] * (image - tint)
    return blended


def _line_layer(
    nodes: NDArray[np.void], view: CameraView, scene: NDArray[np.float32], scale: float
) -> NDArray[np.float32]:
    kinds = [(kind, depth) for kind in LINE_KINDS for depth in range(style.LEVELS)]
    kinds.sort(key=lambda look: style.line_rank(*look))
    looks = []
    for kind, depth in kinds:
        colour, opacity = style.COLOURS[kind], style.line_opacity(kind, depth)
        looks.append(Look(scale * style.line_width(kind, depth), (*colour, opacity), (*colour, style.HIDDEN * opacity)))

    def by_look() -> Iterator[tuple[int, NDArray[np.float64]]]:
        for first in range(0, len(nodes), NODES):
            lines = overlay_lines(nodes[first : first + NODES], view)
            level = np.minimum(lines.depth, style.LEVELS - 1)
            for row, (kind, depth) in enumerate(kinds):
                yield row, lines.ends[(lines.kind == kind) & (level == depth)]

    return line_layer(looks, by_look(), scene)


def freest_corner(hit: NDArray[np.bool_], rows: int, columns: int) -> tuple[slice, slice]:
    """Where a panel of rows x columns pixels hides the fewest hits; the upper left of equals."""
    height, width = hit.shape
    margin = min(width, height) // 50
    vertical = (slice(height - margin - rows, height - margin), slice(margin, margin + rows))
    horizontal = (slice(margin, margin + columns), slice(width - margin - columns, width - margin))
    corners = [(up, along) for up in vertical for along in horizontal]
    return min(corners, key=lambda corner: int(np.count_nonzero(hit[corner])))
