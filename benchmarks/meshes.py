"""Scenes as files for the harness: `python -m benchmarks.meshes bunny terrain gears@100000 stadium/9`.

A number after @ asks for about so many triangles, one after a slash is the exponent of the stadium's scale ratio.
Meshes that no formula makes come from `--meshes FOLDER`, or the folder that BIH_MESHES names, as .npz files with the
arrays `vertices` and `triangles`.
"""

from __future__ import annotations

import argparse
import os
import struct
import sys
from pathlib import Path

import numpy as np

from addon.report.scenes import SCENES, stadium
from addon.report.shapes import Shape, shape
from addon.report.view import Scene, View

from .harness import PROJECT, sources_stamp
from .harness import SCENES as SCENE_SOURCES

BUILT = PROJECT / "build" / "bench" / "meshes"
FILES = {"bunny": "stanford-bunny", "dragon": "dragon-full"}
MILLION = 1_000_000


class Unavailable(Exception):
    """A scene that this machine does not have; the message says what to do."""


def folder(chosen: Path | None = None) -> Path:
    """Where meshes that cannot be made by formula lie."""
    return chosen or Path(os.environ.get("BIH_MESHES", PROJECT.parent / "shared" / "meshes"))


def _framed(mesh: Shape) -> View:
    """A scanned model, y up, from its front and a little above: most of it in the picture."""
    lower, upper = mesh.vertices.min(axis=0).astype(float), mesh.vertices.max(axis=0).astype(float)
    centre, size = (lower + upper) / 2, upper - lower
    eye = centre + np.array([0.1, 0.15, 1.9]) * [size[0], size[1], max(size[1], 0.75 * size[0])]
    light = centre + [2, 3, 3] * size[[0, 1, 1]]
    return View((eye[0], eye[1], eye[2]), (centre[0], centre[1], centre[2]), (0, 1, 0), 35, (*light,))


def scene(name: str, meshes: Path | None = None) -> Scene:
    """By its name, such as "bunny", "terrain" (a million triangles), "terrain@100000" or "stadium/9@100000"."""
    name, _, count = name.partition("@")
    kind, _, exponent = name.partition("/")
    size = int(count or MILLION)
    if exponent:
        return stadium(size, float(exponent))
    if kind in SCENES:
        return SCENES[kind](size)
    if kind not in FILES:
        raise Unavailable(f"no scene {kind!r}; there are {', '.join([*FILES, *SCENES])}")
    path = folder(meshes) / f"{FILES[kind]}.npz"
    if not path.exists():
        raise Unavailable(f"{kind}: no {path}; give the folder by --meshes or BIH_MESHES")
    with np.load(path, allow_pickle=False) as archive:
        mesh = shape(archive["vertices"], archive["triangles"])
    return Scene(mesh, _framed(mesh))


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


def written(name: str, meshes: Path | None = None) -> Path:
    """The scene's file, made now if there is none of these sources."""
    path = BUILT / f"{name.replace('/', '-')}.mesh"
    stamp = path.with_suffix(".stamp")
    if not path.exists() or not stamp.exists() or stamp.read_text() != sources_stamp(*SCENE_SOURCES):
        write(path, scene(name, meshes))
        stamp.write_text(sources_stamp(*SCENE_SOURCES))
    return path


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--meshes", type=Path)
    arguments = parser.parse_args()
    for name in arguments.names:
        try:
            print(written(name, arguments.meshes))
        except Unavailable as reason:
            print(reason, file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
