"""The command: options of a command line in, a file and its lines out."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import fields, replace
from pathlib import Path

from ...pipeline.errors import UserError
from ...pipeline.files import check_target, written_beside
from ..rounds import Rounds
from . import made
from .options import QUICK, Options, Progress

LEAST_TRIANGLES = 1_000
FILE = "tables.md"


def run(arguments: Namespace, progress: Progress) -> list[str]:
    """Measure, write the file into the folder `arguments.output`, and return its lines. Raises UserError."""
    target: Path = arguments.output / FILE
    check_target(target)
    text = made(chosen(arguments), progress)
    with written_beside(target) as beside:
        beside.write_text(text, encoding="utf-8")
    return text.splitlines()


def chosen(arguments: Namespace) -> Options:
    """The options of a command line, checked. Raises UserError."""
    named = {field.name: getattr(arguments, field.name, None) for field in fields(Options)}
    given = {name: value for name, value in named.items() if value is not None}
    rounds = given.pop("rounds", None)
    for name, value in given.items():
        if name.endswith("_triangles") and value < LEAST_TRIANGLES:
            option = "--" + name.replace("_", "-")
            raise UserError(f"{option} is {value}; it must be at least {LEAST_TRIANGLES}", exit_status=2)
    if rounds is not None and rounds < 1:
        raise UserError(f"--rounds is {rounds}; it must be at least 1", exit_status=2)
    options = QUICK if arguments.quick else Options()
    return replace(options, **given, rounds=Rounds(rounds, options.rounds.seconds) if rounds else options.rounds)
