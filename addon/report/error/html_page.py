"""Pieces of a page that needs nothing but itself: text, tables, plots and pictures, readable on paper."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape

from ..markdown import number
from . import svg_plot
from .hits import Span
from .plot import Plot

STYLE = """
body { font: 15px/1.5 sans-serif; max-width: 62em; margin: 2em auto; padding: 0 1em; color: #111; background: #fff }
h1 { font-size: 1.6em } h2 { font-size: 1.3em; margin-top: 2em; border-bottom: 1px solid #999 }
h3 { font-size: 1.05em } p { max-width: 48em }
table { border-collapse: collapse; font-size: 12.5px; margin: 1em 0; font-variant-numeric: tabular-nums }
th, td { padding: 2px 8px; text-align: right; border-bottom: 1px solid #ddd; vertical-align: top }
th { border-bottom: 1px solid #555; vertical-align: bottom } th:first-child, td:first-child { text-align: left }
.words td:nth-child(-n+3), .words th:nth-child(-n+3) { text-align: left } .words td:nth-child(2) { white-space: nowrap }
.range { color: #666; font-size: 11px; white-space: nowrap }
.front { font-weight: bold } .bad { color: #b00 } .note { color: #555; font-size: 12.5px }
.incomplete { border: 2px solid #b00; padding: .5em 1em; font-weight: bold }
figure { margin: 1em 0; break-inside: avoid } figure svg { width: 100%; max-width: 760px; height: auto }
img { max-width: 100%; min-width: 20em; image-rendering: pixelated }
@media print {
  body { font-size: 9.5pt; margin: 0; max-width: none } table { font-size: 7.5pt; break-inside: avoid }
  tr { break-inside: avoid } th, td { padding: 1px 4px } h2, h3 { break-after: avoid }
  @page { size: A4; margin: 14mm }
}
"""


class Html(str):
    """Text that is markup already."""

    __slots__ = ()


def page(title: str, parts: Iterable[str]) -> str:
    """A whole document."""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def heading(level: int, text: str) -> str:
    return f"<h{level}>{escape(text)}</h{level}>"


def paragraph(text: str, kind: str = "") -> str:
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], words: str = "") -> str:
    """Cells are text, or `Html`; `words` are a class of the table."""
    head = "".join(f"<th>{_cell(text)}</th>" for text in heads)
    body = "\n".join("<tr>" + "".join(f"<td>{_cell(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<table class="{words}"><thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table>'


def _cell(text: str) -> str:
    return text if isinstance(text, Html) else _whole(escape(text))


def _whole(text: str) -> str:
    """A number is not broken behind the hyphen of its exponent."""
    return re.sub(r"(?<=\de)-(?=\d)", "−", text)


def marked(text: str, kind: str) -> Html:
    return Html(f'<span class="{kind}">{escape(text)}</span>')


def spanned(value: Span | None, factor: float = 1.0) -> str:
    """The median, and below it the range."""
    if value is None:
        return "–"
    middle = number(factor * value.median)
    if value.count < 2:
        return middle
    return above(middle, f"{number(factor * value.least)} – {number(factor * value.most)}")


def above(text: str, below: str) -> str:
    """A cell of two lines, the second one small; of one, where there is no second."""
    return Html(f'{_cell(text)}<br><span class="range">{_cell(below)}</span>') if below else text


def figure(plot: Plot) -> str:
    """As SVG; nothing where nothing was measured, or where plots cannot be drawn."""
    if plot.is_empty or svg_plot.why_missing():
        return ""
    return f"<figure>{svg_plot.svg(plot)}</figure>"


def picture(png: bytes, caption: str) -> str:
    """A PNG inside the page."""
    data = b64encode(png).decode()
    text = escape(caption)
    image = f'<img src="data:image/png;base64,{data}" alt="{text}">'
    return f'<figure>{image}<figcaption class="note">{text}</figcaption></figure>'
