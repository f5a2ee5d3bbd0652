"""docs/benchmarks.md, from what was measured."""

from __future__ import annotations

from datetime import datetime
from functools import partial
from pathlib import Path

from . import bars, machine, plots, sections, sides
from .harness import PROJECT
from .plan import GROWING, KINDS, OTHERS, SCENES, SIZES, STEPS, jobs
from .results import Results
from .store import Store
from .tables import bar_table, number, summary_table, table

PAGE = PROJECT / "docs" / "benchmarks.md"
IMAGES = PROJECT / "docs" / "images"
NOTES = PROJECT / "benchmarks" / "notes.md"
METHOD = PROJECT / "benchmarks" / "method.md"


def write(store: Store, page: Path = PAGE, images: Path = IMAGES) -> None:
    """The page and its plots."""
    results = Results.stored(store)
    rows = bars.rows(results)
    drawn = plots.draw(results, images)
    notes = ["## Notes on the bars\n", NOTES.read_text()] if NOTES.exists() else []
    parts = [
        "# Benchmarks\n",
        _circumstances(store, results),
        "## Bars\n",
        "`fast` beside Embree's default, 2 threads each side. Ratios are ours over the peer's.\n",
        summary_table(rows),
        *notes,
        "### Each bar on each scene\n",
        bar_table(rows),
        "### `watertight` beside ROBUST\n",
        "No bar is set here yet: 1 stands for as fast.\n",
        bar_table(bars.exact_rows(results)),
        "### What being right costs\n",
        "In flight, 1 thread; the last two kinds of rays are aimed at vertices, and along an axis through vertices.\n",
        bar_table(bars.precision_rows(results)),
        "## Size\n",
        *(f"![{what}](images/{name})\n" for name, what in drawn.items()),
        *(_growth(results, scene) for scene in GROWING),
        "## Scenes\n",
        *(_scene(results, scene) for scene in SCENES if results.triangles(scene)),
        "## Steps a ray\n",
        "Nodes visited, leaves counted; no clock is involved.\n",
        _steps(results),
        "## Other scenes\n",
        _others(results),
        "## How it is measured\n",
        METHOD.read_text(),
        *filter(None, (sections.read(page, title) for title in sections.TITLES)),
    ]
    page.write_text("\n".join(parts))


def _circumstances(store: Store, results: Results) -> str:
    dates = sorted(date for date in map(store.date, jobs()) if date)
    stale = [job.name for job in jobs() if store.date(job) and not store.is_fresh(job)]
    lines = [f"- {what}: {fact}" for what, fact in machine.facts().items()]
    version = next((result["embree"] for result in results.by_job.values() if result.get("embree")), None)
    sets = {result["instruction_set"] for result in results.by_job.values() if "instruction_set" in result}
    if version:
        lines.append(f"- Embree {version // 10000}.{version // 100 % 100}.{version % 100}")
    lines.append(f"- our instruction set: {', '.join(sorted(sets)) or 'not measured'}")
    if dates:
        first, last = (datetime.fromisoformat(date).strftime("%Y-%m-%d %H:%M") for date in (dates[0], dates[-1]))
        lines.append(f"- measured from {first} to {last}")
    if stale:
        lines.append(f"- {len(stale)} of {len(jobs())} measurements are of older sources; `make bench` renews them")
    return "\n".join(lines) + "\n"


def _scene(results: Results, scene: str) -> str:
    parts = [f"### {scene}, {results.triangles(scene):,} triangles\n"]
    parts.append(_builds(results, scene))
    for threads, traces in ((2, sides.traces), (1, sides.traces_alone)):
        calls = tuple(dict.fromkeys(call for kind in KINDS for call in traces(kind)))
        parts.append(f"Mrays/s on {threads} thread{'s' if threads > 1 else ''}, and wrong answers a million:\n")
        parts.append(_traces(results, scene, calls, threads))
    parts.append("Milliseconds from the mesh to a picture of 1024 x 768, one shadow ray a sample, 2 threads:\n")
    parts.append(_images(results, scene))
    if results.python(scene):
        parts.append("From Python, on the same arrays; BVHTree takes a ray a call:\n")
        parts.append(_python(results, scene))
    return "\n".join(parts)


def _builds(results: Results, scene: str) -> str:
    lines = []
    for side in sides.BUILDS:
        seconds = [results.built(scene, side, threads=threads) for threads in (2, 1)]
        if seconds[0] is None:
            continue
        peak = results.built(scene, side, "peak_bytes")
        triangles = results.triangles(scene) or 1
        milliseconds = [number(None if value is None else 1e3 * value) for value in seconds]
        held = number(results.bytes_a_triangle(scene, side))
        lines.append([side, *milliseconds, held, number(None if peak is None else peak / triangles)])
    return table(["build", "ms, 2 threads", "ms, 1 thread", "bytes a triangle", "at the peak"], lines)


def _traces(results: Results, scene: str, calls: tuple[str, ...], threads: int) -> str:
    lines = []
    for call in calls:
        rows = [results.traced(scene, kind, call, threads) for kind in KINDS]
        if not any(rows):
            continue
        rates = [number(row["rays_a_second"] / 1e6 if row else None) for row in rows]
        wrong = sum(row.get(count, 0) for row in rows for count in ("missed", "invented", "nearer", "farther"))
        rays = sum(row.get("rays", 0) for row in rows)
        lines.append([call, *rates, number(1e6 * wrong / rays, 2)])
    return table(["call", *KINDS, "wrong"], lines)


def _images(results: Results, scene: str) -> str:
    lines = []
    for side in sides.IMAGES:
        seconds = [results.image(scene, side, samples) for samples in (1, 4, 16)]
        if any(seconds):
            lines.append([side, *(number(None if value is None else 1e3 * value) for value in seconds)])
    return table(["side", "1 sample", "4", "16"], lines)


def _python(results: Results, scene: str) -> str:
    lines = []
    for name, facts in results.python(scene).items():
        rates = [f"{facts[f'{kind}_rays_a_second'] / 1e6:.2f}" for kind in ("primary", "random")]
        differing = sum(facts[f"{kind}_differing"] for kind in ("primary", "random"))
        lines.append([name, number(1e3 * facts["build_seconds"]), *rates, number(differing)])
    return table(["peer", "build, ms", "primary, Mrays/s", "random, Mrays/s", "other hits or misses"], lines)


def _growth(results: Results, scene: str) -> str:
    builds = (sides.DEFAULT, sides.SAH, sides.LOW, sides.MEDIUM)
    whose = {side: partial(results.best_rate, side=side) for side in (sides.DEFAULT, sides.SAH, sides.MEDIUM)}
    lines = []
    for size in SIZES:
        name = f"{scene}@{size}"
        count = results.triangles(name)
        if not count:
            continue
        seconds = [results.built(name, side) for side in builds]
        rates = [rate(name, kind) for kind in ("primary", "bounce") for rate in whose.values()]
        cells = [number(None if value is None else 1e3 * value) for value in seconds]
        lines.append([f"{count:,}", *cells, *(number(None if rate is None else rate / 1e6) for rate in rates)])
    heads = [f"{scene}: triangles", *(f"build {side}, ms" for side in builds)]
    heads += [f"{kind} {who}, Mrays/s" for kind in ("primary", "bounce") for who in whose]
    return table(heads, lines) if lines else ""


def _steps(results: Results) -> str:
    lines = []
    for scene in STEPS:
        for kind in ("primary", "bounce", "random"):
            counts = [results.steps(scene, kind, side) for side in sides.COSTS]
            if any(counts):
                lines.append([f"{scene}, {kind}", *map(number, counts)])
    return table(["scene, rays", *sides.COSTS], lines)


def _others(results: Results) -> str:
    kinds = KINDS[:4]
    lines = []
    for scene in OTHERS:
        count = results.triangles(scene)
        if not count:
            continue
        seconds = [results.built(scene, side) for side in (sides.DEFAULT, sides.LOW, sides.MEDIUM)]
        cells = [number(None if value is None else 1e3 * value) for value in seconds]
        for kind in kinds:
            ours, best = results.rate(scene, kind, sides.DEFAULT), results.best_rate(scene, kind, sides.MEDIUM)
            cells.append(" / ".join(number(None if rate is None else rate / 1e6) for rate in (ours, best)))
        lines.append([scene, f"{count:,}", *cells])
    heads = ["scene", "triangles", *(f"build {side}, ms" for side in (sides.DEFAULT, sides.LOW, sides.MEDIUM))]
    return table([*heads, *(f"{kind}, ours / MEDIUM's best, Mrays/s" for kind in kinds)], lines)
