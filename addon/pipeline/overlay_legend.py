"""The legend of an overlay picture: what each colour means, how deep it goes, how much there is."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .image import openimageio
from .lettering import LINE_HEIGHT, text_coverage
from .overlay import INNER, LEAF, UNBUILT, Kind, overlapping
from .overlay_style import COLOURS, Colour

PITCH = round(1.15 * LINE_HEIGHT)  # from line to line; all sizes here are those of the lettering
PAD = LINE_HEIGHT // 2
SWATCH = (int(0.8 * LINE_HEIGHT), 3 * LINE_HEIGHT)  # rows, columns
STROKE = 4
INK: Colour = (0.1, 0.1, 0.1)

TEXT_HEIGHT = 1 / 36
"""Height of a line of text in a picture of height 1, where the legend leaves enough of the picture free."""

MOST_HEIGHT, MOST_WIDTH = 0.6, 0.36

Image = NDArray[np.float32]


def legend(nodes: NDArray[np.void], max_depth: int, caption: Mapping[str, str], width: int, height: int) -> Image:
    """The panel for a picture of width x height pixels: sRGB (rows, columns, 3) in [0, 1], first row at the top.

    `nodes` are the ones that are drawn, the root first.
    """
    return fitted(panel_of(_entries(nodes, max_depth, caption)), width, height)


def fitted(panel: Image, width: int, height: int) -> Image:
    """A panel at the size it has in a picture of width x height pixels."""
    rows, columns = panel.shape[:2]
    scale = min(TEXT_HEIGHT * height / LINE_HEIGHT, MOST_HEIGHT * height / rows, MOST_WIDTH * width / columns)
    return _resized(panel, max(1, round(rows * scale)), max(1, round(columns * scale)))


def legend_texts(nodes: NDArray[np.void], max_depth: int, caption: Mapping[str, str]) -> list[str]:
    """The lines of the legend."""
    return [text for _, text in _entries(nodes, max_depth, caption)]


def _entries(nodes: NDArray[np.void], max_depth: int, caption: Mapping[str, str]) -> list[tuple[Image | None, str]]:
    """Swatch and text of each line."""
    inner, leaves, unbuilt = (int(np.count_nonzero(nodes["kind"] == kind)) for kind in (INNER, LEAF, UNBUILT))
    overlaps = len(overlapping(nodes))
    triangles = int(nodes["count"][0]) if len(nodes) else 0
    return [
        (None, f"Bounding interval hierarchy to depth {max_depth}"),
        (None, "a node stores an axis and two clip planes:"),
        (_children_swatch(0.5, None), "left child: upper clip plane"),
        (_children_swatch(None, 0.5), "right child: lower clip plane"),
        (_children_swatch(0.65, 0.35), "overlap: in both children"),
        (_children_swatch(0.35, 0.65), "gap: in neither, skipped"),
        (_box_swatch(COLOURS[Kind.BOX]), "box of a node"),
        (_box_swatch(COLOURS[Kind.LEAF_BOX]), "box of a leaf"),
        *([(_box_swatch(COLOURS[Kind.UNBUILT_BOX]), f"not yet subdivided: {unbuilt:,}")] if unbuilt else []),
        (None, "thinner: deeper; faint: behind the surface"),
        (None, f"{_counted(len(nodes), 'node')}: {inner:,} inner, {_counted(leaves, 'leaf', 'leaves')}"),
        (None, f"{overlaps:,} with an overlap; {_counted(triangles, 'triangle')}"),
        *((None, f"{name}: {value}") for name, value in caption.items()),
    ]


def _counted(count: int, one: str, more: str = "") -> str:
    return f"{count:,} {one if count == 1 else more or one + 's'}"


def panel_of(entries: list[tuple[Image | None, str]]) -> Image:
    """A line for each text, with its swatch (SWATCH pixels of colour) where it has one."""
    indent = SWATCH[1] + PAD
    texts = [text_coverage(text) for _, text in entries]
    columns = max(
        text.shape[1] + (0 if swatch is None else indent) for text, (swatch, _) in zip(texts, entries, strict=True)
    )
    panel = np.ones((PITCH * len(entries) + 2 * PAD, columns + 2 * PAD, 3), np.float32)
    _outline(panel, INK, STROKE // 2)
    for row, (text, (swatch, _)) in enumerate(zip(texts, entries, strict=True)):
        top, left = PAD + row * PITCH, PAD
        if swatch is not None:
            middle = top + (LINE_HEIGHT - SWATCH[0]) // 2
            panel[middle : middle + SWATCH[0], left : left + SWATCH[1]] = swatch
            left += indent
        place = panel[top : top + LINE_HEIGHT, left : left + text.shape[1]]
        place += text[..., None] * (np.array(INK, np.float32) - place)
    return panel


def _outline(image: Image, colour: Colour, stroke: int) -> None:
    for edge in (np.s_[:stroke], np.s_[-stroke:], np.s_[:, :stroke], np.s_[:, -stroke:]):
        image[edge] = colour


def _box_swatch(colour: Colour) -> Image:
    swatch = np.ones((*SWATCH, 3), np.float32)
    _outline(swatch, colour, STROKE)
    return swatch


def _children_swatch(left_end: float | None, right_start: float | None) -> Image:
    """A node from the side: the left child ends, and the right one starts, at these parts of its width."""
    swatch = np.ones((*SWATCH, 3), np.float32)
    x, y = np.arange(SWATCH[1]), np.arange(SWATCH[0])[:, None]
    in_left = x < (left_end or 0.0) * SWATCH[1]
    in_right = x >= (1.0 if right_start is None else right_start) * SWATCH[1]
    for kind, inside in ((Kind.LEFT, in_left), (Kind.RIGHT, in_right)):
        swatch[:, inside] += 0.3 * (np.array(COLOURS[kind], np.float32) - swatch[:, inside])
    swatch[in_left & in_right & ((x + y) % (4 * STROKE) < 2 * STROKE)] = COLOURS[Kind.OVERLAP]
    _outline(swatch, COLOURS[Kind.BOX], STROKE // 2)
    for kind, at in ((Kind.LEFT, left_end), (Kind.RIGHT, right_start)):
        if at is not None:
            column = int(at * SWATCH[1])
            swatch[:, column - STROKE // 2 : column + STROKE - STROKE // 2] = COLOURS[kind]
    return swatch


def _resized(image: Image, rows: int, columns: int) -> Image:
    oiio = openimageio()
    source = oiio.ImageBuf(oiio.ImageSpec(image.shape[1], image.shape[0], 3, "float"))
    source.set_pixels(source.roi, image)
    resized = oiio.ImageBufAlgo.resize(source, "triangle", roi=oiio.ROI(0, columns, 0, rows, 0, 1, 0, 3))
    pixels: Image = resized.get_pixels("float")
    return pixels
