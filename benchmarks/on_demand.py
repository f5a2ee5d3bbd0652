"""When construction on demand pays: `python -m benchmarks.on_demand [--rounds 7] [--curve] [dragon head …]`.

Each scene's first picture with an eager tree and with one that is built on demand, in turn, round by round: with
shadows, and with primary rays alone as in the slides. Columns, on demand as a share of eager: `alone` is the
construction, the first picture's slow-down against the second one included; `image` all of it; `steady` the rays a
second of the second picture; `memory` the acceleration data then, references included. `--curve` adds sizes of the
pieces that are finished at once; hits do not depend on them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from addon.report.view import Scene, View

from .harness import Failed, Harness, Result
from .meshes import BUILT, Unavailable, scene, write

EAGER, ON_DEMAND = "bih/wide", "bih/wide/demand"
CURVE = (64, 256, 512, 2048, 4096)


def head(meshes: Path | None) -> Scene:
    """A close-up of the dragon's head: a third of its triangles."""
    mesh, whole = scene("dragon", meshes)
    return Scene(mesh, View((-0.16, 0.18, 0.12), (-0.09, 0.15, 0.0), (0, 1, 0), 25, whole.light))


def street(triangles: int) -> Scene:
    """One street of the city, near its middle."""
    mesh, whole = scene(f"city@{triangles}")
    side = whole.light[1]
    x, z = round(0.5 * side) + 0.5, round(0.42 * side) + 0.5
    return Scene(mesh, View((x, 1.0, z), (x, 0.6, z + 8), (0, 1, 0), 50, (x + side, side, 0.0)))


def patch(triangles: int) -> Scene:
    """A landscape from above one slope of it."""
    mesh, whole = scene(f"terrain@{triangles}")
    return Scene(mesh, View((5, 2.4, 5), (5.4, 0.9, 5.5), (0, 1, 0), 40, whole.light))


MILLION = 1_000_000
SCENES: dict[str, tuple[str, Callable[[Path | None], Scene]]] = {
    "dragon": ("640x480", lambda meshes: scene("dragon", meshes)),
    "dragon-large": ("1280x1024", lambda meshes: scene("dragon", meshes)),
    "head": ("1280x1024", head),
    "street-1m": ("1280x1024", lambda _: street(MILLION)),
    "street-10m": ("1280x1024", lambda _: street(10 * MILLION)),
    "patch-10m": ("1280x1024", lambda _: patch(10 * MILLION)),
}


def shown(name: str, result: Result) -> None:
    """A line for each side."""
    for kind, sides in result["first"].items():
        eager = sides[EAGER]
        for side, facts in sides.items():
            build, first, second = (facts[part]["seconds"] for part in ("build", "first", "second"))
            alone = build + max(0.0, first - second)
            alone_of_eager = eager["build"]["seconds"] + max(
                0.0, eager["first"]["seconds"] - eager["second"]["seconds"]
            )
            print(
                f"{name:<13}{kind:<9}{side:<26}{1e3 * facts['image']['seconds']:9.1f} ms: build {1e3 * build:8.1f}, "
                f"first {1e3 * first:8.1f}, second {1e3 * second:8.1f}; alone {alone / alone_of_eager:5.2f}, "
                f"image {facts['image']['seconds'] / eager['image']['seconds']:5.2f}, "
                f"steady {eager['second']['seconds'] / second:5.2f}, "
                f"memory {facts['tree_bytes'] / eager['tree_bytes']:5.2f}; "
                f"unbuilt {facts['unbuilt']} of {facts['pieces']}; {facts['differing_pixels']} pixels differ"
            )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", help=", ".join(SCENES))
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--curve", action="store_true")
    parser.add_argument("--meshes", type=Path)
    arguments = parser.parse_args()
    if unknown := set(arguments.scenes) - set(SCENES):
        parser.error(f"no scene {', '.join(sorted(unknown))}; there are {', '.join(SCENES)}")
    sides = [EAGER, ON_DEMAND]
    if arguments.curve:
        sides += [f"{ON_DEMAND}/piece{size}" for size in CURVE]
    try:
        harness = Harness.built()
        for name in arguments.scenes or SCENES:
            size, make = SCENES[name]
            path = BUILT / f"on-demand-{name}.mesh"
            try:
                write(path, make(arguments.meshes))
            except Unavailable as reason:
                print(f"{name}: skipped, {reason}", file=sys.stderr)
                continue
            options = {"size": size, "first": ",".join(sides), "rounds": str(arguments.rounds)}
            options |= {"seconds": str(arguments.seconds), "threads": str(arguments.threads)}
            shown(name, harness.run(path, options))
            path.unlink()
    except Failed as reason:
        print(reason, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
