"""The shipped glyphs, and lines of text made of them."""

from __future__ import annotations

import numpy as np

from addon.pipeline.lettering import LINE_HEIGHT, glyphs, text_coverage
from tools.make_lettering import CHARACTERS, rendered


def test_the_shipped_glyphs_are_those_that_openimageio_renders() -> None:
    shipped, made = glyphs(), rendered()
    assert shipped.characters == CHARACTERS == str(made["characters"])
    np.testing.assert_array_equal(shipped.starts, made["starts"])
    assert shipped.coverage.shape[0] == LINE_HEIGHT
    assert shipped.margin == made["margin"]
    # FreeType's rasteriser may round otherwise in another version.
    assert np.abs(shipped.coverage.astype(int) - made["coverage"]).max() <= 2


def test_every_character_but_the_spaces_has_ink_within_its_rows() -> None:
    for character in CHARACTERS:
        ink = text_coverage(f"H{character}H").sum() - 2 * text_coverage("H").sum()
        assert (ink > 1) != (character in " \xa0"), repr(character)
    assert not glyphs().coverage[[0, -1]].any()


def test_a_line_is_the_characters_side_by_side() -> None:
    line = text_coverage("HO")
    first, second = text_coverage("H"), text_coverage("O")
    assert line.shape == (LINE_HEIGHT, first.shape[1] + second.shape[1])
    np.testing.assert_array_equal(line, np.hstack([first, second]))
    assert line.min() == 0.0
    assert line.max() == 1.0


def test_the_first_row_is_the_top() -> None:
    ink = text_coverage("L").sum(axis=1)
    lowest = np.flatnonzero(ink)[-4:]
    assert ink[lowest].max() > 2 * np.median(ink[ink > 0])


def test_an_unknown_character_is_a_question_mark_and_no_text_is_empty() -> None:
    np.testing.assert_array_equal(text_coverage("a兎b"), text_coverage("a?b"))
    assert text_coverage("").shape == (LINE_HEIGHT, 0)
