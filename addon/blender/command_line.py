"""The commands `blender --command bih render …`, `… report …` and `… tables …`.

Under the bpy wheel, or with no Blender at all for an .npz mesh, tables or a built-in scene: `python -m
addon.blender.command_line …`.
"""

from __future__ import annotations

import signal
import sys
from argparse import ArgumentParser, ArgumentTypeError, BooleanOptionalAction, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from ..pipeline.errors import UserError
from ..pipeline.settings import LARGEST_SIDE, PARTS, PASSES, SHADING, SHADINGS, Settings
from ..report import error_arguments, table_arguments
from . import modules

LAST_FRAME = 1048574  # Blender's own limit


def execute(argv: Sequence[str]) -> int:
    """Run one command; the exit status: 0 done, 1 an error, 2 wrong usage, 3 an accuracy bar missed, 130 interrupted.

    An error is one line on standard error. No file is left half written.
    """
    # Blender's own handler would take Ctrl-C for itself
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        arguments = _parser().parse_args(list(argv))
        return int(arguments.run(arguments))
    except UserError as error:
        print(f"bih: {' '.join(str(error).split())}", file=sys.stderr)
        return error.exit_status
    except MemoryError:
        print("bih: not enough memory; choose a smaller --size, or a smaller scene", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("bih: interrupted", file=sys.stderr)
        return 130
    except SystemExit as stop:  # argparse after --help
        return int(stop.code or 0)


def _render(arguments: Namespace) -> int:
    chosen = {
        name: value
        for name in ("passes", "samples", "threads", "overlay_depth", *SHADING)
        if (value := getattr(arguments, name)) is not None
    }
    if chosen.get("ambient_occlusion_distance") is not None:
        chosen.setdefault("ambient_occlusion", True)
    chosen["parts"] = {**dict.fromkeys(arguments.leave_out, False), **dict.fromkeys(arguments.keep, True)}
    Settings(**chosen)  # a wrong value is found before any file is opened
    modules.require("numpy", "bihtree")
    from ..pipeline.preview import Outputs
    from . import job

    size = tuple(arguments.size) if arguments.size else None
    source = job.Source(arguments.scene, arguments.mesh, arguments.frame, size)
    outputs = Outputs(tuple(arguments.output), arguments.overlay, arguments.stats, arguments.heat_map)
    for line in job.run(source, chosen, outputs):
        print(line)
    return 0


def _report(arguments: Namespace) -> int:
    modules.require("numpy", "bihtree")
    from ..report.error import command
    from . import report_job

    def told(line: str, share: float) -> None:
        print(line, file=sys.stderr, flush=True)

    outcome = command.run(arguments, report_job.read, told, report_job.methods())
    for line in outcome.lines:
        print(line)
    for line in outcome.errors:
        print(f"bih: {line}", file=sys.stderr)
    return outcome.status


def _tables(arguments: Namespace) -> int:
    modules.require("numpy", "bihtree")
    from ..report.tables import command

    for line in command.run(arguments, lambda what: print(what, file=sys.stderr, flush=True)):
        print(line)
    return 0


class _Parser(ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise UserError(f"{message} (--help says what there is)", exit_status=2)


def _parser() -> ArgumentParser:
    parser = _Parser(prog="bih", description="Trace a picture by a Bounding Interval Hierarchy.")
    commands = parser.add_subparsers(required=True, metavar="render, report or tables")
    tables = commands.add_parser("tables", help="measure the tables of the slides on this machine (some minutes)")
    tables.set_defaults(run=_tables)
    tables.add_argument("--output", type=Path, required=True, metavar="FOLDER", help="tables.md is written there")
    table_arguments.add(tables)
    report = commands.add_parser("report", help="measure error against run time on a scene (some minutes)")
    report.set_defaults(run=_report)
    error_arguments.add(report)
    render = commands.add_parser("render", help="trace one picture of a scene or a mesh")
    render.set_defaults(run=_render)
    source = render.add_mutually_exclusive_group(required=True)
    source.add_argument("--scene", type=Path, metavar="FILE.blend", help="the scene, seen by its active camera")
    source.add_argument(
        "--mesh", type=Path, metavar="FILE", help="a mesh instead: .npz, or what Blender's importers read; Z is up"
    )
    render.add_argument(
        "--output",
        type=Path,
        action="append",
        required=True,
        metavar="IMAGE",
        help="the picture; .exr holds every pass. May be given more than once",
    )
    render.add_argument("--overlay", type=Path, metavar="IMAGE", help="the tree's boxes and planes over the picture")
    render.add_argument(
        "--heat-map", type=Path, metavar="IMAGE", help="nodes and triangles each pixel took, as colours"
    )
    render.add_argument("--stats", type=Path, metavar="FILE.json", help="counts, times and sizes")
    render.add_argument("--frame", type=_frame, metavar="N", help="frame to render (the scene's current one)")
    render.add_argument(
        "--size",
        type=_side,
        nargs=2,
        metavar=("W", "H"),
        help="pixels (the scene's own; 1280 720 for a mesh)",
    )
    render.add_argument("--passes", type=_names, metavar="A,B,…", help=f"of {', '.join(PASSES)} (the scene's choice)")
    render.add_argument("--overlay-depth", type=int, metavar="N", help="deepest level that the overlay shows")
    render.add_argument("--samples", type=int, metavar="N", help="rays a pixel")
    _add_shading(render)
    render.add_argument("--threads", type=int, metavar="N", help="threads to use (0, all)")
    for option, what in (("--keep", "keep"), ("--leave-out", "leave out wherever the picture stays the same")):
        render.add_argument(
            option, type=_parts, default=(), metavar="PART,…", help=f"{what} these parts of the work, or all (by need)"
        )
    return parser


def _add_shading(render: ArgumentParser) -> None:
    """What is not given stays as the scene has it."""
    render.add_argument("--shading", choices=SHADINGS, help="the scene's own lights, or a headlight")
    for name, what in (
        ("shadows", "whether lights cast shadows"),
        ("soft-shadows", "whether lights have a size: 16 samples and more"),
        ("ambient-occlusion", "whether surfaces hide the surroundings from each other"),
        ("smooth", "whether smooth faces are shaded as smooth"),
    ):
        render.add_argument(f"--{name}", action=BooleanOptionalAction, help=what)
    render.add_argument(
        "--ambient-occlusion-distance", type=float, metavar="D", help="how far, in units of the scene (without end)"
    )


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


def _parts(text: str) -> tuple[str, ...]:
    """Names of parts of the work; a hyphen may stand for a blank."""
    names = tuple(name.replace("-", " ") for name in _names(text))
    return PARTS if names == ("all",) else names


def _side(text: str) -> int:
    return _integer(text, 1, LARGEST_SIDE)


def _frame(text: str) -> int:
    return _integer(text, -LAST_FRAME, LAST_FRAME)


def _integer(text: str, least: int, most: int) -> int:
    try:
        value = int(text)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a whole number") from None
    if not least <= value <= most:
        raise ArgumentTypeError(f"{value} is not from {least} to {most}")
    return value


if __name__ == "__main__":
    sys.exit(execute(sys.argv[1:]))
