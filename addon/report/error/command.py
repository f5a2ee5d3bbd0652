"""The command: options of a command line in; files, lines and an exit status out."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ...pipeline.errors import UserError
from . import report
from .methods import Method, methods
from .options import QUICK, Options
from .progress import Told
from .subject import Subject, built_in

LEAST_TRIANGLES = 100
INTERRUPTED, BAR_MISSED = 130, 3


class Outcome(NamedTuple):
    """Lines for standard output and standard error, and the exit status."""

    lines: list[str]
    errors: list[str]
    status: int


def run(
    arguments: Namespace, read: Callable[[Namespace], Subject], told: Told, others: Sequence[Method] = ()
) -> Outcome:
    """Measure and write; `read` reads a .blend or a mesh, `others` are methods that only the host has.
    Raises UserError; then no file is written."""
    options = chosen(arguments)
    folder: Path = arguments.output
    if arguments.built_in:
        if arguments.triangles < LEAST_TRIANGLES:
            least = f"it must be at least {LEAST_TRIANGLES}"
            raise UserError(f"--triangles is {arguments.triangles}; {least}", exit_status=2)
        subject = built_in(arguments.built_in, arguments.triangles)
    else:
        subject = read(arguments)
    subject = subject.moved(arguments.offset)
    # Behind all that may be wrong with the rest, so that then no folder is made.
    report.check(subject, folder)
    results = report.measured(subject, options, [*methods(options.threads), *others], told)
    written = report.write(results, folder)
    lines = [*report.summary(results), *(f"note: {note}" for note in results.notes), str(written[-1])]
    if results.incomplete:
        return Outcome(lines, [f"{results.incomplete}; {written[-1]} has what was measured before"], INTERRUPTED)
    missed = report.missed_bar(results, options)
    return Outcome(lines, [missed] if missed else [], BAR_MISSED if missed else 0)


def chosen(arguments: Namespace) -> Options:
    """The options of a command line, checked. Raises UserError."""
    names = ("rays", "rounds", "threads", "max_wrong", "max_leaks")
    given = {name: value for name in names if (value := getattr(arguments, name)) is not None}
    return options_of(arguments.quick, arguments.only, **given)


def options_of(quick: bool, only: str | None, **given: Any) -> Options:
    """With names of sections in `only`, by commas (None: all); a hyphen may stand for a blank. Raises UserError."""
    if only is not None:
        names = (name.strip().replace("-", " ") for name in only.split(","))
        given["sections"] = tuple(filter(None, names))
    return Options(**{**(QUICK if quick else {}), **given}, quick=quick)
