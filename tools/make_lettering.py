"""Make addon/pipeline/lettering.npz: the glyphs of Droid Sans as OpenImageIO renders them.

Run it with the OpenImageIO wheel of the Python package index, which has FreeType and the font:
python -m tools.make_lettering
"""

from __future__ import annotations

from typing import Any

import numpy as np
import OpenImageIO
from numpy.typing import NDArray

from addon.pipeline.lettering import GLYPHS, LINE_HEIGHT

FONT, SIZE, MARGIN = "DroidSans", 40, 8
ASCENT = 40  # rows above the baseline, which leave room for accents on capitals
CHARACTERS = "".join(chr(code) for code in (*range(32, 127), *range(160, 256))) + "–—"


def rendered() -> dict[str, Any]:
    """The arrays of the file."""
    cells = [_cell(character) for character in CHARACTERS]
    return {
        "characters": np.array(CHARACTERS),
        "coverage": np.concatenate(cells, axis=1),
        "starts": np.cumsum([0] + [cell.shape[1] for cell in cells]).astype(np.int32),
        "margin": np.int32(MARGIN),
    }


def _cell(character: str) -> NDArray[np.uint8]:
    # What a character adds between two others is its advance; its own ink says nothing about it.
    advance = _width(f"H{character}H") - _width("HH")
    image = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(advance + 2 * MARGIN, LINE_HEIGHT, 1, "float"))
    OpenImageIO.ImageBufAlgo.zero(image)
    if not OpenImageIO.ImageBufAlgo.render_text(image, MARGIN, ASCENT, character, SIZE, FONT, (1.0,)):
        raise SystemExit(f"cannot render {character!r}: {image.geterror()}")
    ink = np.clip(np.asarray(image.get_pixels(OpenImageIO.FLOAT))[..., 0], 0.0, 1.0)
    cell: NDArray[np.uint8] = np.rint(ink * 255.0).astype(np.uint8)
    return cell


def _width(text: str) -> int:
    size = OpenImageIO.ImageBufAlgo.text_size(text, SIZE, FONT)
    return int(size.xend - size.xbegin)


if __name__ == "__main__":
    np.savez_compressed(GLYPHS, **rendered())
