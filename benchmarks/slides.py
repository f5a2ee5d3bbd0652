"""The tables of the slides on this machine, into their section of docs/benchmarks.md: `make tables`.

Where there is the file of the Dragon that the other benchmarks use, and no other is named, it is taken.
"""

from __future__ import annotations

import argparse
import sys

from addon.pipeline.errors import UserError
from addon.report import table_arguments
from addon.report.tables import command, made
from addon.report.view import Scene

from . import machine, sections
from .harness import Failed, Harness
from .meshes import BUILT, FILES, folder, write
from .page import PAGE


def sort_as_published(scene: Scene, name: str) -> tuple[float, float, float] | None:
    """By the harness: seconds of the slides' construction without and with their bucket sort, and the frame rate with
    it over that without; None where the harness cannot be built."""
    path, sides = BUILT / "slides.mesh", "slides/plain,slides/buckets"
    options = {"threads": "1", "rounds": "5", "seconds": "20", "size": "640x480", "rays": "primary"}
    try:
        harness = Harness.built()
        write(path, scene)
        result = harness.run(path, {**options, "build": sides, "trace": sides})
    except Failed as reason:
        print(f"{name}: {reason}", file=sys.stderr)
        return None
    finally:
        path.unlink(missing_ok=True)
    (plain, sort), rates = result["build"].values(), result["trace"]["primary"]
    share = rates["slides/buckets"]["rays_a_second"] / rates["slides/plain"]["rays_a_second"]
    return plain["seconds"], sort["seconds"], share


def section(arguments: argparse.Namespace) -> str:
    """What is measured, and on what."""

    def progress(what: str) -> None:
        print(what, file=sys.stderr, flush=True)

    tables = made(command.chosen(arguments), progress, None if arguments.quick else sort_as_published)
    facts = [f"- {what}: {fact}" for what, fact in machine.facts().items()]
    return "\n".join(["By `make tables`; medians of rounds in which all take turns.\n", *facts, "", tables])


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.slides", description=__doc__)
    table_arguments.add(parser)
    parser.add_argument("--print", action="store_true", dest="is_printed", help="leave docs/benchmarks.md as it is")
    arguments = parser.parse_args()
    usual = folder() / f"{FILES['dragon']}.npz"
    if not arguments.dragon and not arguments.quick and usual.exists():
        arguments.dragon = usual
    try:
        text = section(arguments)
    except UserError as error:
        print(error, file=sys.stderr)
        return error.exit_status
    print(text)
    if not arguments.is_printed and not arguments.quick:
        sections.refresh(PAGE, sections.TABLES, text)
        print(PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
