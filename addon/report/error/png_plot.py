"""Plots as PNG files by matplotlib, where it is installed; in no Blender."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from .plot import Plot


def why_missing() -> str:
    """Empty where files can be drawn."""
    return "" if find_spec("matplotlib") else "PNG files of the plots need matplotlib, which no Blender has"


def write(plot: Plot, path: Path) -> None:
    """The same plot as on the page."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    x, y = plot.axis("x"), plot.axis("y")
    figure = Figure(figsize=(7.6, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xscale="log", yscale="log", title=plot.title, xlabel=plot.x_title, ylabel=plot.y_title)
    for series in plot.series:
        places = [(x.place(point.x), y.place(point.y)) for point in series.points]
        style = "-" if series.is_line else "none"
        marker = "" if series.name == "Pareto front" else "."
        axes.plot(
            *zip(*places, strict=True),
            linestyle=style,
            marker=marker,
            color=series.colour,
            label=series.name,
            clip_on=False,
        )
        for point, place in zip(series.points, places, strict=True):
            if point.is_marked:
                axes.plot(*place, marker="o", markersize=9, color=series.colour, markeredgecolor="black", clip_on=False)
            if point.label:
                axes.annotate(point.label, place, xytext=(6, 6), textcoords="offset points", fontsize=7)
    axes.set_xticks(*zip(*(plot.x_labels or x.labels), strict=True))
    axes.set_yticks(*zip(*y.labels, strict=True))
    axes.set_ylim(y.low, y.high * 1.2)
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1, 0.5))
    figure.savefig(path, dpi=110, format="png")
