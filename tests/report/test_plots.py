"""The report's plots: axes, what is drawn of them, and points on the front."""

from __future__ import annotations

import re

import pytest

from addon.report.error import svg_plot
from addon.report.error.plot import axis, scatter


def test_zeros_stand_on_an_axis_of_their_own():
    drawn = axis([0.0, 3.0, 250.0])
    assert (drawn.low, drawn.high) == (0.1, 1000)
    assert drawn.labels == ((0.1, "0"), (1.0, "1"), (10.0, "10"), (100.0, "100"), (1000.0, "1000"))
    assert drawn.place(0.0) == 0.1
    assert axis([]).labels
    assert [text for _, text in axis([0.02, 0.3]).labels] == ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"]
    plot = scatter(
        "a", "A", ("x", "y"), [("one", 1.0, 0.0, True), ("two", None, 1.0, False), ("three", 0.5, 2.0, True)]
    )
    assert [series.name for series in plot.series] == ["one", "three", "Pareto front"]
    if not svg_plot.why_missing():
        text = svg_plot.svg(plot)
        assert text.startswith("<svg")
        # Not among the numbers of the axis that it stands on.
        heights = [float(y) for y in re.findall(r'<circle cx="[^"]*" cy="([^"]*)"', text)]
        labels = [float(y) for y in re.findall(r'<text x="[^"]*" y="([^"]*)" class="label"', text)]
        assert len(labels) == 2 and max(labels) < max(heights)


def test_every_number_of_both_axes_is_drawn():
    if reason := svg_plot.why_missing():
        pytest.skip(reason)
    plot = scatter("a", "A", ("x", "y"), [("one", 3.0, 0.0, True), ("two", 7e5, 2e4, False)])
    text = svg_plot.svg(plot)
    for which in ("x", "y"):
        # Up to the next axis, or the curves.
        axis_text = re.split(r'<g class="(?:axis|series)', text[text.index(f'<g class="axis {which}') + 1 :])[0]
        drawn = re.findall(r"<text[^>]*>([^<]*)</text>", axis_text)
        assert drawn == [label for _, label in plot.axis(which).labels]
