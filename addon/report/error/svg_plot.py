"""Plots as SVG to stand in a page, by pygal: pure Python, so that Blender has it too."""

from __future__ import annotations

import re
from typing import Any

from .plot import Plot

SIZE = (760, 430)
LABEL_SIZE = 11
HEADROOM = 1.000001
"""The plot ends so far above its axis: pygal draws no number that stands at the very top."""


def why_missing() -> str:
    """Empty where plots can be drawn."""
    try:
        import pygal  # noqa: F401
    except ImportError as error:
        return f"plots need the Python module pygal, which is in the extension's zip ({error})"
    return ""


def svg(plot: Plot) -> str:
    """Without a script, and without an address of anything."""
    import pygal
    from pygal.style import Style

    x, y = plot.axis("x"), plot.axis("y")
    style = Style(
        background="white",
        plot_background="white",
        font_family="sans-serif",
        colors=tuple(series.colour for series in plot.series),
        opacity=1,
        title_font_size=15,
        label_font_size=LABEL_SIZE,
        major_label_font_size=LABEL_SIZE,
        legend_font_size=LABEL_SIZE,
        value_label_font_size=LABEL_SIZE,
        # By as much a point's label stands to the right of it and below: less than nothing, so that it stands above the
        # point, and never below an axis. Nothing else here has this size.
        value_font_size=-LABEL_SIZE,
        guide_stroke_color="#dddddd",
        major_guide_stroke_color="#dddddd",
    )
    chart = pygal.XY(
        style=style,
        width=SIZE[0],
        height=SIZE[1],
        logarithmic=True,
        js=[],
        title=plot.title,
        x_title=plot.x_title,
        y_title=plot.y_title,
        xrange=(x.low, x.high),
        range=(y.low, y.high * HEADROOM),
        x_labels=_labels(plot.x_labels or x.labels),
        y_labels=_labels(y.labels),
        show_x_guides=True,
        print_labels=True,
        truncate_legend=-1,
        dots_size=4,
        show_minor_x_labels=True,
    )
    for series in plot.series:
        chart.add(
            series.name,
            [_point(x.place(p.x), y.place(p.y), p.label, p.is_marked, series.colour) for p in series.points],
            stroke=series.is_line,
            stroke_style={"width": 1.5},
            show_dots=series.name != "Pareto front",
        )
    text: str = chart.render(is_unicode=True, disable_xml_declaration=True)
    return re.sub(r"<!--.*?-->|<script.*?</script>", "", text, flags=re.DOTALL)


def _labels(labels: tuple[tuple[float, str], ...]) -> list[dict[str, Any]]:
    return [{"value": value, "label": label} for value, label in labels]


def _point(x: float, y: float, label: str, is_marked: bool, colour: str) -> dict[str, Any]:
    point: dict[str, Any] = {"value": (x, y)}
    if label:
        point["label"] = label
    if is_marked:
        point |= {"node": {"r": 8}, "style": f"fill: {colour}; stroke: black; stroke-width: 2"}
    return point
