"""index.html: all results on one page."""

from __future__ import annotations

from collections.abc import Iterator

from . import hits_page, image_page, stability_page, svg_plot
from . import html_page as html
from .options import WORDS
from .plot import Plot
from .results import Results


def plots(results: Results) -> list[Plot]:
    """All of them that show anything."""
    drawn = [
        *hits_page.plots(results.hits),
        *image_page.plots(results.image),
        *stability_page.plots(results.stability),
    ]
    return [plot for plot in drawn if not plot.is_empty]


def text(results: Results) -> str:
    """The document."""
    return html.page(f"Error against run time: {results.scene}", _parts(results))


def _parts(results: Results) -> Iterator[str]:
    yield html.heading(1, f"Error against run time: {results.scene}")
    if results.incomplete:
        yield html.paragraph(f"Incomplete: {results.incomplete}. What is here was measured before.", "incomplete")
    yield html.paragraph(
        f"{results.source}: {results.triangles:,} triangles, {results.vertices:,} vertices in "
        f"{results.vertex_precision}. Measured in {results.seconds:.0f} s."
    )
    facts = {**results.machine, **{WORDS.get(name, name): str(value) for name, value in results.options.items()}}
    yield html.table(["measured on and with", ""], [[name, value] for name, value in facts.items()])
    for note in [*results.notes, *filter(None, [svg_plot.why_missing()])]:
        yield html.paragraph(note, "note")
    if results.hits.rows:
        yield from hits_page.section(results.hits)
    if results.image.rows:
        yield from image_page.image_section(results.image)
    if results.stability.rows:
        yield from stability_page.section(results.stability)
    if results.left_out.rows:
        yield from image_page.left_out_section(results.left_out)
