"""The section on hits: tables and plots."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..markdown import number
from . import html_page as html
from .decided import MEANS
from .hits import COSTS, COUNTED, FEW, SLOW, Hits, Row, cost_of, front_of
from .methods import EXACT, WATERTIGHT
from .plot import Plot, scatter

WRONG = "wrong answers a million rays"


def plots(hits: Hits) -> list[Plot]:
    """Wrong answers against each cost, and against the error of t."""
    rows = [row for row in hits.rows if row.rays and not row.missing]
    found = [
        scatter(
            f"hits-{cost}",
            f"Wrong answers against {what}",
            (what, WRONG),
            [(_legend(row), cost_of(row, cost), row.wrong_a_million, cost in row.fronts) for row in rows],
        )
        for cost, what in COSTS.items()
    ]
    precise = front_of(rows, "seconds", lambda row: row.t_error_999)
    error = [(_legend(row), cost_of(row, "seconds"), row.t_error_999, row.name in precise) for row in rows]
    titles = (COSTS["seconds"], "99.9 % error of t, ulp of float32")
    return [*found, scatter("hits-precision", "Error of t against seconds", titles, error)]


def _legend(row: Row) -> str:
    """Few rays prove little, whoever is right about all of them."""
    return f"{row.name}, {row.rays:,} rays" if row.every > FEW else row.name


def section(hits: Hits) -> Iterator[str]:
    yield html.heading(2, "Hits")
    rays = sum(kind["rays"] for kind in hits.rays.values())
    yield html.paragraph(
        f"{rays:,} rays, the same for all. The truth is exact: boxes and double precision with proven bounds leave out "
        "what is clear, whole numbers decide the rest; it shares no code with the methods. An answer is wrong where a "
        "hit is missed, where nothing is hit and something is named, or where another triangle is nearer than the "
        "named one; of several at one distance any is right. A neighbour shares a corner with the right triangle: "
        "it is wrong, and hardly seen in a picture. Methods in single precision round the vertices and rays of a "
        "float64 mesh, and what they then get wrong counts."
    )
    yield html.paragraph(
        "Aimed rays start inside the mesh (where it has an inside) and aim at its vertices and edges; one leaks where "
        "it passes through what it hits. They are a fifth of all rays, far more than in a picture: what is wrong of a "
        "million is said of this mix, and a table below has it by kind. Bounced rays start 1/10,000 of the scene's "
        "size off the surface."
    )
    yield html.paragraph(
        f"Medians of {hits.rounds} rounds in turn after one that warms up, with ranges; what takes more than "
        f"{SLOW:.0f} s is measured once. A method that takes longer is given one ray in so many, its seconds are "
        f"those of all rays in proportion, and its nodes are counted in one of {COUNTED} of those. Errors of t are "
        "those of right answers, in ulp of float32 at the true t. Bytes are those beside the mesh. A large point is a "
        "method that no other beats in both axes (the Pareto front), without those that were given less than one ray "
        f"in {FEW}."
    )
    yield html.table(
        ["rays", "count", "that hit", "ties", "decided in whole numbers"],
        [
            [kind, f"{f['rays']:,}", f"{f['hit']:,}", f"{f['ties']:,}", f"{f['in whole numbers']:,}"]
            for kind, f in hits.rays.items()
        ],
    )
    heads = ["method", "build, ms", "trace, ms", "total, ms", "wrong hits a million", "of these a neighbour"]
    heads += [
        "misses a million",
        "leaks",
        "t error, max",
        "99.9 %",
        "bytes a triangle",
        "nodes a ray",
        "on the front of",
    ]
    yield html.table(heads, [_cells(row) for row in hits.rows if not row.missing and row.rays])
    notes = [f"{row.name}: {row.note}" for row in hits.rows if row.note and not row.missing]
    notes += [f"{row.name}: left out, {row.missing}" for row in hits.rows if row.missing]
    for note in notes:
        yield html.paragraph(note, "note")
    for plot in plots(hits):
        yield html.figure(plot)
    yield from _by_kind(hits)
    yield from _decided(hits)
    yield from _worst(hits)


def _few(row: Row) -> str:
    return f"one ray in {row.every:,}" if row.every > 1 else ""


def _cells(row: Row) -> list[str]:
    def a_million(count: int) -> str:
        if row.every > FEW:
            return html.above(html.marked(f"{count:,}", "bad") if count else "0", f"of {row.rays:,} rays")
        text = number(1e6 * count / row.rays)
        return html.marked(text, "bad") if count else text

    return [
        html.above(html.marked(row.name, "front" if row.fronts else ""), _few(row)),
        *(html.spanned(value, 1e3) for value in (row.build, row.trace, row.total)),
        a_million(row.false_hits + row.other_triangle),
        f"{row.neighbours:,}" if row.every > FEW else number(1e6 * row.neighbours / row.rays),
        a_million(row.missed),
        html.above(html.marked(f"{row.leaks:,}", "bad" if row.leaks else ""), f"of {row.aimed:,}"),
        number(row.t_error_max),
        number(row.t_error_999),
        number(row.bytes_a_triangle),
        number(row.nodes_a_ray),
        ", ".join(row.fronts),
    ]


def _by_kind(hits: Hits) -> Iterator[str]:
    kinds = list(hits.rays)
    yield html.heading(3, "Wrong answers by kind of ray")
    rows = [row for row in hits.rows if row.wrong_by_kind]
    yield html.table(
        ["method", *kinds],
        [[html.above(row.name, _few(row)), *(f"{row.wrong_by_kind.get(kind, 0):,}" for kind in kinds)] for row in rows],
    )


def _decided(hits: Hits) -> Iterator[str]:
    if not hits.decided:
        return
    yield html.heading(3, "What it took to decide")
    which = "all rays" if hits.decided_every == 1 else f"one ray in {hits.decided_every:,}"
    yield html.paragraph(
        f"Tests of {which} against triangles in {WATERTIGHT}; {EXACT} decides as it does. What one means cannot tell "
        "is left to the next, from left to right. The share of tests that each decided:"
    )
    yield html.table(
        ["rays", "tests a ray", *MEANS],
        [[kind, number(found.tests_a_ray), *map(_share, found.tests.values())] for kind, found in hits.decided.items()],
    )
    yield html.paragraph("The share of rays with a test that came to it:")
    yield html.table(
        ["rays", *MEANS[1:]],
        [[kind, *map(_share, list(found.rays.values())[1:])] for kind, found in hits.decided.items()],
    )


def _share(part: float) -> str:
    # Not all, however near to it: what is left is what the table is about.
    text = f"{100 * part:.3f}" if 0.999 < part < 1.0 else number(100 * part)
    text = f"{100 * part:.9f}".rstrip("0") if text == "100.000" else text
    return f"{text} %" if part > 0.0 else "none"


def _worst(hits: Hits) -> Iterator[str]:
    """The worst ray of each method, and what every other answered."""
    if not hits.beside:
        return
    yield html.heading(3, "The worst rays")
    yield html.paragraph(
        "Of each method that is ever wrong the ray where it is furthest off, or one of those: triangle and t of the "
        "truth and of each answer; in red is a miss or another triangle, not a t that is off. results.json has the "
        "rays, and more of them."
    )
    whose: dict[tuple[str, int], list[str]] = {}
    for row in hits.rows:
        if row.worst:
            whose.setdefault((row.worst[0]["kind"], row.worst[0]["ray"]), []).append(row.name)
    shown = {(ray["kind"], ray["ray"]): ray for ray in hits.beside}
    worst = [shown[ray] for ray in whose]
    rows = [["truth", *(_answer(ray["truth"]) for ray in worst)]]
    rows += [[name, *(_answer(ray["answers"][name]) for ray in worst)] for name in hits.beside[0]["answers"]]
    yield html.table(["answer of", *(f"worst of {', '.join(who)}; {kind}" for (kind, _), who in whose.items())], rows)


def _answer(answer: dict[str, Any]) -> str:
    text = "miss" if answer["t"] is None else f"{answer['triangle']} at {answer['t'] + 0.0:.7g}"
    return html.marked(text, "bad") if answer.get("is_wrong") else text
