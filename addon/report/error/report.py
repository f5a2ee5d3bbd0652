"""The report: measure section by section, keep what there is, write it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import bihtree

from ...pipeline.errors import UserError
from ...pipeline.files import written_beside
from . import hits, image_error, left_out, machine, page, png_plot, result_files, stability
from .methods import EXACT, WATERTIGHT, Method
from .options import Options
from .pace import PATIENT
from .progress import Progress, Told
from .results import Results
from .subject import Subject

SECONDS = {
    "hits": {"truth": (8.0, 1.0), "hits": (15.0, 10.0)},
    "image": {"image": (50.0, 3.0)},
    "stability": {"stability": (300.0, 9.0)},
    "left out": {"left out": (60.0, 15.0)},
}
"""What the parts of each section take, in seconds, about: of a full report, and of a quick one."""
PAGE, JSON, CSV = "index.html", "results.json", "results.csv"


def check(subject: Subject, folder: Path) -> None:
    """Make the folder where it is missing. Raises UserError where nothing can be written into it, and before it is made
    where there is nothing to trace."""
    subject.mesh  # noqa: B018 - raises where there is none
    probe = folder / ".bih"
    try:
        folder.mkdir(exist_ok=True)
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise UserError(f"cannot write into {folder}: {error.strerror or error}") from None


def measured(subject: Subject, options: Options, methods: Sequence[Method], told: Told) -> Results:
    """All sections, or those until `told` returns False or Ctrl-C is pressed. Raises UserError for an empty scene."""
    mesh = subject.mesh
    results = Results(
        scene=mesh.name,
        source=subject.source,
        triangles=len(mesh.triangles),
        vertices=len(mesh.vertices),
        vertex_precision=str(mesh.vertices.dtype),
        options=options.shown(),
        machine={**machine.facts(), "processes at work before it": machine.load()},
        notes=[*subject.scene.skipped],
    )
    started = perf_counter()
    seconds = [part for name in options.sections for part in SECONDS[name].items()]
    progress = Progress(told, {part: of_quick if options.quick else of_full for part, (of_full, of_quick) in seconds})
    try:
        if "hits" in options.sections:
            hits.measure(results.hits, subject, methods, options.rays, options.rounds, options.patience, progress)
            ours = results.hits.row(WATERTIGHT)
            if ours and ours.every > 1:  # pictures will take as long as they may
                progress.expect_later("image", PATIENT * options.patience)
                progress.expect_later("left out", PATIENT * options.patience)
        if "image" in options.sections:
            image_error.measure(
                results.image, subject, options.width, options.samples, options.rounds, options.patience, progress
            )
        if "stability" in options.sections:
            stability.measure(results.stability, methods, options.sweep_rays, options.steps, options.rounds, progress)
        if "left out" in options.sections:
            left_out.measure(results.left_out, subject, options.width, options.pairs, options.patience, progress)
    except bihtree.Cancelled:
        results.incomplete = "cancelled"
    except KeyboardInterrupt:
        results.incomplete = "interrupted"
    results.seconds = perf_counter() - started
    return results


def write(results: Results, folder: Path) -> list[Path]:
    """The page last: where it is, the rest is too. Raises UserError."""
    written = []
    plots = page.plots(results)
    why = png_plot.why_missing()
    if why:
        results.notes.append(why)
    for plot in [] if why else plots:
        written.append(folder / f"{plot.name}.png")
        with written_beside(written[-1]) as beside:
            png_plot.write(plot, beside)
    for name, text in ((JSON, result_files.as_json), (CSV, result_files.as_csv), (PAGE, page.text)):
        written.append(folder / name)
        with written_beside(written[-1]) as beside:
            beside.write_text(text(results), encoding="utf-8")
    return written


def missed_bar(results: Results, options: Options) -> str:
    """A line where ours are wrong, or leak, more often than was allowed; else nothing."""
    for name in (WATERTIGHT, EXACT):
        row = results.hits.row(name)
        for what, count, most in (
            ("wrong answers", row.wrong if row else 0, options.max_wrong),
            ("leaks", row.leaks if row else 0, options.max_leaks),
        ):
            if row and most is not None and count > most:
                return f"{name}: {count:,} {what} of {row.rays:,} rays; at most {most:,} were allowed"
    return ""


def summary(results: Results) -> list[str]:
    """A line a method."""
    lines = []
    for row in results.hits.rows:
        if row.missing:
            lines.append(f"{row.name:<18} left out: {row.missing}")
        elif row.total:
            wrong = f"{row.wrong_a_million:12,.1f} wrong a million"
            if row.every > hits.FEW:
                wrong = f"{row.wrong:12,} wrong of {row.rays:,}"
            lines.append(f"{row.name:<18} {row.total.median:9.3f} s {wrong}  {row.leaks:,} leaks")
    return lines
