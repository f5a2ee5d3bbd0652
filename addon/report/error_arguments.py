"""What the command `report` can be told; it needs no NumPy, so that a missing one can be said in a line."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path


def add(parser: ArgumentParser) -> None:
    """To the command's parser."""
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--scene", type=Path, metavar="FILE.blend", help="the scene, seen by its active camera")
    source.add_argument("--mesh", type=Path, metavar="FILE", help="a mesh instead, as for render")
    source.add_argument("--built-in", metavar="NAME", help="a scene by formula: terrain, stadium, gears, …")
    parser.add_argument("--output", type=Path, required=True, metavar="FOLDER", help="index.html and all else go there")
    parser.add_argument("--triangles", type=int, default=100_000, metavar="N", help="of a built-in scene (100,000)")
    parser.add_argument("--offset", type=float, default=0.0, metavar="X", help="move the scene by X times its size")
    parser.add_argument("--frame", type=int, metavar="N", help="frame of the scene (its current one)")
    parser.add_argument("--rays", type=int, metavar="N", help="that each method is given (50,000)")
    parser.add_argument("--rounds", type=int, metavar="N", help="times that each thing is measured (5)")
    parser.add_argument("--threads", type=int, metavar="N", help="of ours (1, as embreex has; 0, all)")
    parser.add_argument("--only", metavar="A,B,…", help="these sections alone: hits, image, stability, left-out")
    parser.add_argument("--quick", action="store_true", help="fewer rays and rounds: about a minute")
    parser.add_argument("--max-wrong", type=int, metavar="N", help="exit status 3 where ours are wrong more often")
    parser.add_argument("--max-leaks", type=int, metavar="N", help="exit status 3 where ours leak more often")
