"""Sections of the page that commands of their own write, and what they say of ratios."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks import needs, page, sections
from benchmarks.needs_page import Ratio, counted_section, timed_section, verdict
from benchmarks.store import Store


def test_a_section_is_put_at_the_end_then_in_its_own_place(tmp_path: Path) -> None:
    target = tmp_path / "page.md"
    sections.refresh(target, sections.TABLES, "first\n\n### part\n")
    assert target.read_text() == f"# Benchmarks\n\n## {sections.TABLES}\n\nfirst\n\n### part\n"
    sections.refresh(target, sections.NEEDS, "second")
    sections.refresh(target, sections.NEEDS_COUNTED, "third")
    sections.refresh(target, sections.TABLES, "again")
    titles = [line for line in target.read_text().splitlines() if line.startswith("## ")]
    assert titles == [f"## {title}" for title in (sections.TABLES, sections.NEEDS, sections.NEEDS_COUNTED)]
    assert sections.read(target, sections.TABLES) == f"## {sections.TABLES}\n\nagain\n"
    assert sections.read(target, sections.NEEDS) == f"## {sections.NEEDS}\n\nsecond\n"
    assert "first" not in target.read_text()
    assert sections.read(target, "none") == sections.read(tmp_path / "none.md", sections.NEEDS) == ""


def test_the_rest_of_the_page_carries_them_over(tmp_path: Path) -> None:
    target = tmp_path / "page.md"
    sections.refresh(target, sections.NEEDS, "measured before")
    for _ in range(2):
        page.write(Store(tmp_path / "none"), target, tmp_path / "images")
        assert target.read_text().count(f"## {sections.NEEDS}\n\nmeasured before\n") == 1
    assert "## How it is measured" in target.read_text()


def test_the_interval_of_a_median_holds_it_19_times_of_20() -> None:
    rng = np.random.default_rng(1)
    for count in (21, 41):
        drawn = np.sort(rng.random((4000, count)), axis=1).tolist()
        held = np.mean([lower <= 0.5 <= upper for lower, upper in map(needs._interval, drawn)])
        assert 0.94 < held < 0.99


@pytest.mark.parametrize(
    ("middle", "lower", "upper", "said"),
    [
        (1.00, 0.98, 1.04, "met"),
        (1.04, 0.98, 1.10, "met, not surely"),
        (1.06, 0.98, 1.10, "**missed**, not surely"),
        (1.10, 1.06, 1.20, "**missed**"),
    ],
)
def test_a_verdict_says_how_sure_it_is(middle: float, lower: float, upper: float, said: str) -> None:
    ratio = Ratio("ball", "all on", 12.5, middle, lower, upper)
    assert verdict(ratio) == said
    for text in (timed_section([ratio], 21), counted_section([ratio])):
        assert f"| {middle:.3f} |" in text
        assert f"- met: {int(middle <= 1.05)} of 1" in text
