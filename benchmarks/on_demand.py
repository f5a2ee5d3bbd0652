"""When construction on demand pays: `python -m benchmarks.on_demand [--rounds 7] [--curve] [dragon head …]`.

Each view's first picture with an eager tree and with one that is built on demand, in turn, round by round: with
shadows, and with primary rays alone as in the slides. `--curve` adds, for the dragon whole, sizes of the pieces that
are finished at once; hits do not depend on them. All views together write their section of docs/benchmarks.md; some
alone are printed.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from . import on_demand_page, sections
from .harness import Failed, Harness
from .meshes import BUILT, Unavailable, write
from .on_demand_page import Share
from .on_demand_scenes import CASES
from .page import PAGE

EAGER, ON_DEMAND = "bih/wide", "bih/wide/demand"
USUAL = 1024
PIECES = {ON_DEMAND: USUAL} | {f"{ON_DEMAND}/piece{size}": size for size in (64, 256, 512, 2048, 4096, 16384)}
"""The most triangles of a piece, by side."""
CURVED = ("dragon", "dragon-large")


def measured(harness: Harness, name: str, arguments: argparse.Namespace) -> list[Share]:
    """All sides of a view, each told as it is known. Raises Failed and Unavailable."""
    path, case = BUILT / f"on-demand-{name}.mesh", CASES[name]
    sides = [EAGER, *(PIECES if arguments.curve and name in CURVED else [ON_DEMAND])]
    options = {"size": case.size, "first": ",".join(sides), "rounds": str(arguments.rounds)}
    options |= {"seconds": str(arguments.seconds), "threads": str(arguments.threads)}
    write(path, case.scene(arguments.meshes))
    try:
        found = harness.run(path, options)["first"]
    finally:
        path.unlink()
    shares = [share for rays, sides in found.items() for share in on_demand_page.shares(name, rays, sides)]
    for share in shares:
        print(on_demand_page.line(share), flush=True)
    return shares


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.on_demand", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", help=", ".join(CASES))
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--curve", action="store_true")
    parser.add_argument("--meshes", type=Path)
    arguments = parser.parse_args()
    if unknown := set(arguments.scenes) - set(CASES):
        parser.error(f"no scene {', '.join(sorted(unknown))}; there are {', '.join(CASES)}")
    found: list[Share] = []
    try:
        harness = Harness.built()
        for name in arguments.scenes or CASES:
            try:
                found += measured(harness, name, arguments)
            except Unavailable as reason:
                print(f"{name}: skipped, {reason}", file=sys.stderr)
    except Failed as reason:
        print(reason, file=sys.stderr)
        return 1
    if not arguments.scenes:
        usual = [share for share in found if share.side == ON_DEMAND]
        curved = [share for share in found if arguments.curve and share.name in CURVED]
        curve = sorted(curved, key=lambda share: (share.name, share.rays, PIECES[share.side]))
        sections.refresh(PAGE, sections.ON_DEMAND, on_demand_page.section(usual, curve, PIECES))
        print(PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
