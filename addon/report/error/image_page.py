"""The sections on the picture's error, and on what was left out."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..markdown import number
from . import html_page as html
from .hits import SLOW
from .image_error import Image, Row
from .left_out import LeftOut
from .plot import COLOURS, Plot, Point, Series

ERRORS: dict[str, tuple[str, Callable[[Row], float | None]]] = {
    "rmse": ("RMSE of sRGB, from 0 to 1", lambda row: row.rmse),
    "flip": ("mean FLIP", lambda row: row.flip),
}


def plots(image: Image) -> list[Plot]:
    """Each error as seconds pass."""
    drawn = []
    for error, (title, value) in ERRORS.items():
        series = []
        for place, name in enumerate(dict.fromkeys(row.name for row in image.rows)):
            points = tuple(
                # They have the same samples, and lie close together: one curve has labels.
                Point(row.seconds.median, height, "" if place else str(row.samples))
                for row in image.rows
                if row.name == name and row.seconds and (height := value(row)) is not None
            )
            if points:
                series.append(Series(f"BIH {name}", points, COLOURS[place], is_line=True))
        titles = ("seconds, build and trace", title)
        drawn.append(Plot(f"image-{error}", f"Error of the picture: {title}", *titles, tuple(series)))
    return drawn


def image_section(image: Image) -> Iterator[str]:
    yield html.heading(2, "Image")
    yield html.paragraph(
        f"The preview render, {image.size}, all threads that the scene asks for: seconds from the arrays to the "
        "finished picture, what the tree takes to build included, with 1, 2, 4, … samples a pixel (the numbers at the "
        f"points of one curve, for all). The reference has {image.reference_samples} samples at other places, by the "
        f"default precision. Medians with ranges; what takes more than {SLOW:.0f} s is measured once."
    )
    rows = [
        [row.name, str(row.samples), html.spanned(row.seconds, 1e3), number(1e3 * row.build_seconds), number(row.rmse)]
        + [number(row.psnr), number(row.flip)]
        for row in image.rows
    ]
    yield html.table(["precision", "samples", "total, ms", "of it build, ms", "RMSE", "PSNR, dB", "FLIP"], rows)
    for note in image.notes:
        yield html.paragraph(note, "note")
    for plot in plots(image):
        yield html.figure(plot)
    for what, png in image.pictures.items():
        yield html.picture(png, what)


def left_out_section(left_out: LeftOut) -> Iterator[str]:
    yield html.heading(2, "What was left out")
    yield html.paragraph(
        f"What this scene does without ({left_out.picture}): the picture has the same bits either way. What each part "
        "would have cost is measured by forcing it on: both in turn, medians with ranges; the ratio is of pairs. "
        "A dash stands where a part is kept, or cannot be forced on for this scene."
    )
    rows = [
        [
            row.name,
            "kept" if row.kept else "left out",
            f"{row.why}; {row.saves}" if row.saves else row.why,
            *(html.spanned(value, 1e3) for value in (row.without, row.forced)),
            html.spanned(row.ratio),
        ]
        for row in left_out.rows
    ]
    heads = ["part", "", "why, and what that saves", "without, ms", "forced on, ms", "forced on ÷ without"]
    yield html.table(heads, rows, "words")
    for note in left_out.notes:
        yield html.paragraph(note, "note")
