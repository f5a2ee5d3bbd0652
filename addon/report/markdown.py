"""Numbers and Markdown tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import fill


def number(value: float | None, digits: int = 3) -> str:
    """So many significant digits, without an exponent; a dash for what was not measured."""
    if value is None:
        return "–"
    if value == 0:
        return "0"
    if abs(value) >= 10 ** (digits - 1):
        return f"{value:,.0f}"
    text = f"{value:#.{digits}g}"
    return f"{value:.2g}" if "e" in text else text.rstrip(".")


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """The first column to the left, the others to the right."""
    lines = [heads, ["---", *["---:"] * (len(heads) - 1)], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


def paragraph(*sentences: str) -> str:
    """In lines of 120 characters at most."""
    return fill(" ".join(sentences), 120) + "\n"
