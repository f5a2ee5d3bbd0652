"""Text for pictures, from glyphs that were rendered once.

OpenImageIO's render_text needs FreeType and a font. Blender's own OpenImageIO is built without FreeType (5.0.1: "not
compiled with FreeType"), and Debian's finds no default font. So the glyphs of Droid Sans (Apache-2.0, part of
OpenImageIO) lie beside this file as pixels, made by tools/make_lettering.py, and every host writes the same text.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

GLYPHS = Path(__file__).with_name("lettering.npz")
UNKNOWN = "?"

LINE_HEIGHT = 52
"""Rows of a line of text."""


class Glyphs(NamedTuple):
    """The glyph of characters[i] is coverage[:, starts[i]:starts[i + 1]], first row at the top; `margin` columns on
    each side hold what reaches beyond its advance."""

    characters: str
    coverage: NDArray[np.uint8]
    starts: NDArray[np.int32]
    margin: int


@cache
def glyphs() -> Glyphs:
    with np.load(GLYPHS, allow_pickle=False) as archive:
        return Glyphs(str(archive["characters"]), archive["coverage"], archive["starts"], int(archive["margin"]))


def text_coverage(text: str) -> NDArray[np.float32]:
    """One line of text as coverage in [0, 1], (LINE_HEIGHT, width), first row at the top; a character that is not
    in Latin-1 becomes a question mark."""
    characters, coverage, starts, margin = glyphs()
    rows = [characters.find(character) if character in characters else characters.find(UNKNOWN) for character in text]
    advances = [int(starts[row + 1] - starts[row]) - 2 * margin for row in rows]
    line = np.zeros((coverage.shape[0], sum(advances) + 2 * margin), np.uint8)
    pen = 0
    for row, advance in zip(rows, advances, strict=True):
        place = line[:, pen : pen + advance + 2 * margin]
        np.maximum(place, coverage[:, starts[row] : starts[row + 1]], out=place)
        pen += advance
    return line[:, margin : margin + pen].astype(np.float32) / 255.0
