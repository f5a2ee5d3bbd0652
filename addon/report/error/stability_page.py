"""The section on stability: a table and curves for each sweep."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..markdown import number
from ..sweeps import SWEEPS
from . import html_page as html
from .plot import COLOURS, Plot, Point, Series
from .stability import BREAKS, COMPARED, TIMES, Row, Stability

Value = Callable[[Row], float | None]

CURVES: dict[str, tuple[str, Value]] = {
    "wrong": ("wrong answers a million rays", lambda row: row.wrong_a_million),
    "t": ("99.9 % error of t, ulp of float32", lambda row: row.t_error_999),
    "nodes": ("nodes a ray", lambda row: row.nodes_a_ray),
    "time": ("nanoseconds a ray", lambda row: row.nanoseconds_a_ray.median if row.nanoseconds_a_ray else None),
}
MOST_LABELS = 10


def plots(stability: Stability) -> list[Plot]:
    """Four a sweep."""
    return [
        _curve(stability, sweep, curve)
        for sweep in SWEEPS
        if any(row.sweep == sweep for row in stability.rows)
        for curve in CURVES
    ]


def _curve(stability: Stability, sweep: str, curve: str) -> Plot:
    """k is an exponent, so its axis is that of a power; 2 whichever the sweep's base is, as labels name k."""
    title, value = CURVES[curve]
    series = []
    ks = sorted({row.k for row in stability.rows if row.sweep == sweep})
    for place, name in enumerate(COMPARED):
        breaks = stability.breaks.get(sweep, {}).get(name, ())
        points = tuple(
            Point(2.0**row.k, height, "", row.k in breaks)
            for row in sorted(stability.of(sweep, name), key=lambda row: row.k)
            if (height := value(row)) is not None
        )
        if points:
            # Such curves hide each other.
            always = ", always 0" if not any(point.y for point in points) else ""
            series.append(Series(f"{name}{always}", points, COLOURS[place], is_line=True))
    step = -(-len(ks) // MOST_LABELS)
    labels = tuple((2.0**k, str(k)) for k in ks[::step])
    file = f"stability-{sweep.replace(' ', '-')}-{curve}"
    return Plot(file, f"{sweep.capitalize()}: {title}", f"k: {SWEEPS[sweep].k_is}", title, tuple(series), labels)


def section(stability: Stability) -> Iterator[str]:
    yield html.heading(2, "Stability")
    yield html.paragraph(
        "Small meshes, the same for every report, whose stiffness grows by orders of magnitude; most rays aim at "
        "vertices, edges and what lies just beside them. Structures that are not drawn decide as one of these does. A "
        f"method breaks where more than one answer in {1 / BREAKS:.0f} is wrong, and {TIMES} times as many as of the "
        "least stiff step, triangles that share a corner with the right one not counted: the large point. Zeros stand "
        "on the axis. Of curves that lie on each other the last one is seen."
    )
    names = [name for name in COMPARED if any(row.name == name for row in stability.rows)]
    yield html.heading(3, "Where each method breaks (k)")
    yield html.paragraph(
        "One that never breaks may be wrong all the same, as often at the start: below k are the wrong answers a "
        "million of its worst step, neighbours counted. The tables of the sweeps have wrong answers a million, below "
        "them how many of these are neighbours, and the largest error of t in ulp of float32; where no ray hits, the "
        "mesh has collapsed in the numbers that its vertices have.",
    )
    yield html.table(
        ["sweep", *names],
        [
            [sweep, *(_broken(stability.of(sweep, name), found.get(name, ())) for name in names)]
            for sweep, found in stability.breaks.items()
        ],
    )
    drawn = {plot.name: plot for plot in plots(stability)}
    for sweep in stability.breaks:
        yield html.heading(3, f"{sweep.capitalize()}: {SWEEPS[sweep].k_is}")
        yield html.table(["k, rays that hit", *names], _rows(stability, sweep, names))
        for curve in CURVES:
            yield html.figure(drawn[f"stability-{sweep.replace(' ', '-')}-{curve}"])


def _rows(stability: Stability, sweep: str, names: list[str]) -> Iterator[list[str]]:
    by_place = {(row.k, row.name): row for row in stability.rows if row.sweep == sweep}
    for k in sorted({k for k, _ in by_place}):
        found = [by_place.get((k, name)) for name in names]
        most = max((row for row in found if row), key=lambda row: row.rays)
        yield [html.above(str(k), f"{most.hits:,} of {most.rays:,}"), *map(_cell, found)]


def _cell(row: Row | None) -> str:
    if row is None:
        return "–"
    neighbours = f"{number(1e6 * row.neighbours / row.rays)} near; " if row.missed + row.wrong_hits else ""
    return html.above(number(row.wrong_a_million), f"{neighbours}t {number(row.t_error_max)}")


def _broken(rows: list[Row], ks: tuple[int, ...]) -> str:
    worst = max((row.wrong_a_million for row in rows), default=0.0)
    return html.above(", ".join(map(str, ks)) or "–", f"at most {number(worst)}" if worst else "never wrong")
