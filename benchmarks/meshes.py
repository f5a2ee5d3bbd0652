"""Scenes as files for the harness: `python -m benchmarks.meshes bunny terrain soup gears@100000`.

A name with @ asks for about so many triangles. Meshes that no formula makes come from `--meshes FOLDER`, or the folder
that BIH_MESHES names, as .npz files with the arrays `vertices` and `triangles`.
"""

from __future__ import annotations

import argparse
import os
import struct
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from addon.report.scenes import SCENES
from addon.report.shapes import shape
from addon.report.view import Scene, View

BUILT = Path(__file__).resolve().parent.parent / "build" / "bench" / "meshes"
FILES = {"bunny": "stanford-bunny", "dragon": "dragon-full"}
MILLION = 1_000_000


class Unavailable(Exception):
    """A scene that this machine does not have; the message says what to do."""


def folder(chosen: Path | None = None) -> Path:
    """Where meshes that cannot be made by formula lie."""
    return chosen or Path(os.environ.get("BIH_MESHES", Path(__file__).resolve().parents[2] / "shared" / "meshes"))


def framed(lower: NDArray[np.float64], upper: NDArray[np.float64]) -> View:
    """From the front and a little above, the whole of it in the picture."""
    centre, size = (lower + upper) / 2, upper - lower
    eye = centre + np.array([0.1, 0.15, 1.9]) * [size[0], size[1], max(size[1], 0.75 * size[0])]
    light = centre + [2, 3, 3] * size[[0, 1, 1]]
    return View(tuple(eye.tolist()), tuple(centre.tolist()), (0, 1, 0), 35, tuple(light.tolist()))


def scene(name: str, meshes: Path | None = None) -> Scene:
    """By its name, such as "bunny", "terrain" (a million triangles) or "terrain@100000"."""
    kind, _, size = name.partition("@")
    if kind in SCENES:
        return SCENES[kind](int(size or MILLION))
    if kind not in FILES:
        raise Unavailable(f"no scene {kind!r}; there are {', '.join([*FILES, *SCENES])}")
    path = folder(meshes) / f"{FILES[kind]}.npz"
    if not path.exists():
        raise Unavailable(f"{kind}: no {path}; give the folder by --meshes or BIH_MESHES")
    with np.load(path, allow_pickle=False) as archive:
        mesh = shape(archive["vertices"], archive["triangles"])
    return Scene(mesh, framed(mesh.vertices.min(axis=0).astype(float), mesh.vertices.max(axis=0).astype(float)))


def write(path: Path, found: Scene) -> None:
    """In the form that the harness reads: benchmarks/harness/src/mesh.rs."""
    mesh, view = found
    path.parent.mkdir(parents=True, exist_ok=True)
    head = struct.pack("<8sQQ", b"BIHBENCH", len(mesh.vertices), len(mesh.triangles))
    head += struct.pack("<13d", *view.eye, *view.target, *view.up, view.angle, *view.light)
    temporary = path.with_suffix(".part")
    with temporary.open("wb") as file:
        file.write(head)
        mesh.vertices.astype("<f4").tofile(file)
        mesh.triangles.astype("<u4").tofile(file)
    temporary.replace(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--meshes", type=Path)
    arguments = parser.parse_args()
    for name in arguments.names:
        try:
            write(BUILT / f"{name}.mesh", scene(name, arguments.meshes))
        except Unavailable as reason:
            print(reason, file=sys.stderr)
            return 1
        print(BUILT / f"{name}.mesh")
    return 0


if __name__ == "__main__":
    sys.exit(main())
