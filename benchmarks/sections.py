"""Sections of docs/benchmarks.md that commands of their own write; the rest of the page carries them over."""

from __future__ import annotations

import re
from pathlib import Path

NEEDS = "What a scene does not need"
NEEDS_COUNTED = "What a scene does not need, by instructions"
TABLES = "The slides' tables, on today's machine"
ON_DEMAND = "Construction on demand"
TITLES = (TABLES, ON_DEMAND, NEEDS, NEEDS_COUNTED)


def read(page: Path, title: str) -> str:
    """The section with its heading; empty where the page has none."""
    if not page.exists():
        return ""
    found = re.search(rf"^## {re.escape(title)}\n.*?(?=^## |\Z)", page.read_text(), re.MULTILINE | re.DOTALL)
    return found[0].rstrip("\n") + "\n" if found else ""


def refresh(page: Path, title: str, text: str) -> None:
    """Put `text` below the heading, in the place of what was there, or at the end of the page."""
    old, new = read(page, title), f"## {title}\n\n{text.strip()}\n"
    before = page.read_text() if page.exists() else "# Benchmarks\n"
    after = before.replace(old, new) if old else f"{before.rstrip()}\n\n{new}"
    temporary = page.with_suffix(".part")
    temporary.write_text(after)
    temporary.replace(page)
