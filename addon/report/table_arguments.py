"""What the tables' commands can be told; it needs no NumPy, so that a missing one can be said in a line."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path


def add(parser: ArgumentParser) -> None:
    """To the parser of either command."""
    for name, what in (("dragon", "Dragon"), ("buddha", "Buddha"), ("thai", "Thai statue")):
        parser.add_argument(
            f"--{name}", type=Path, metavar="FILE", help=f"the {what} as .npz or .ply, y up (a scan by formula)"
        )
    for name, what in (
        ("dragon", "the scan in the Dragon's place"),
        ("buddha", "that in the Buddha's"),
        ("thai", "that in the Thai statue's"),
        ("airframe", "the airframe"),
    ):
        parser.add_argument(f"--{name}-triangles", type=int, metavar="N", help=f"size of {what}")
    parser.add_argument("--rounds", type=int, metavar="N", help="times that each thing is measured, at most (5)")
    parser.add_argument("--quick", action="store_true", help="small meshes and one round: the form alone")
