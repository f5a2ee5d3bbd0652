"""What the benchmark of construction on demand says of its clocks."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks import on_demand, on_demand_page
from benchmarks.on_demand_page import Seconds


def facts(milliseconds: tuple[float, ...], tree_bytes: int, unbuilt: int = 0, pieces: int = 0) -> dict[str, Any]:
    clocks = zip(("build", "first", "second", "third", "image"), milliseconds, strict=True)
    counts = {"tree_bytes": tree_bytes, "unbuilt": unbuilt, "pieces": pieces, "differing_pixels": 0}
    return {name: {"seconds": 1e-3 * clock} for name, clock in clocks} | counts


SIDES = {
    on_demand.EAGER: facts((80, 20, 20, 20, 100), 1000),
    on_demand.ON_DEMAND: facts((30, 40, 30, 25, 70), 250, 300, 400),
    f"{on_demand.ON_DEMAND}/piece64": facts((35, 45, 30, 20, 80), 200, 3000, 4000),
}


def test_alone_is_the_build_and_what_the_first_picture_takes_more_than_the_third() -> None:
    usual, small = on_demand_page.shares("head", "primary", SIDES)
    assert usual.alone == pytest.approx((30 + 15) / 80)
    assert small.alone == pytest.approx((35 + 25) / 80)
    assert (usual.image, usual.steady, usual.memory) == pytest.approx((0.7, 20 / 25, 0.25))
    assert usual.parts == ("67 + 33 %", "43 + 57 %")
    assert usual.built == "100 of 400"
    # A first picture that happens to be faster takes nothing back.
    assert Seconds(1, 2, 3, 4, 5).slower == 0


def test_the_section_says_which_bars_are_missed() -> None:
    shares = on_demand_page.shares("head", "primary", SIDES)
    said = on_demand_page.section(shares[:1], shares, on_demand.PIECES)
    assert "| head, 1280x1024 | primary | 0.56 (≤ 0.6) | 67 + 33 % | 0.70 (≤ 1.05) |" in said
    assert "| **0.80 (≥ 0.95)** | 0.25 | 100 of 400 |" in said
    assert "| head | primary | 64 | 0.75 | 0.80 | 1.00 | 0.20 | 1000 of 4000 |" in said
    assert "alone  0.56" in on_demand_page.line(shares[0])
    assert "###" not in on_demand_page.section(shares[:1], [], on_demand.PIECES)
