"""What the tables are made of, and how large."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ...pipeline.errors import UserError
from ...pipeline.mesh import read_npz
from ...pipeline.ply import read_ply
from ..markdown import number
from ..rounds import Rounds
from ..shapes import shape
from ..subdivision import scan
from ..view import Scene, framed

PICTURE = (640, 480)
BOEING_PICTURE = (1280, 1024)
THREADS = (1, 0)
"""One, and all."""

Progress = Callable[[str], None]
"""Told what is measured now."""

READERS = {".npz": read_npz, ".ply": read_ply}


@dataclass(frozen=True)
class Options:
    """Files of real meshes (.npz or .ply) in the place of formulas, and sizes."""

    dragon: Path | None = None
    buddha: Path | None = None
    thai: Path | None = None
    dragon_triangles: int = 871_414
    buddha_triangles: int = 1_087_716
    thai_triangles: int = 10_000_000
    airframe_triangles: int = 10_000_000
    shrink: int = 1
    """Pictures have so many times fewer pixels a side."""
    rounds: Rounds = field(default_factory=Rounds)

    def picture(self, size: tuple[int, int] = PICTURE) -> tuple[int, int]:
        """Width and height."""
        return size[0] // self.shrink, size[1] // self.shrink


QUICK = Options(
    dragon_triangles=2_000,
    buddha_triangles=3_000,
    thai_triangles=4_000,
    airframe_triangles=10_000,
    shrink=8,
    rounds=Rounds(1, 0.0),
)
"""Small meshes and one round: the form of the tables in a few seconds, and figures that mean nothing."""


@dataclass(frozen=True)
class Named:
    """A scene and what it is called in the tables."""

    name: str
    scene: Scene

    @property
    def triangles(self) -> int:
        return len(self.scene.mesh.triangles)

    def __str__(self) -> str:
        return f"{self.name}, {self.triangles:,}"


def scanned(name: str, path: Path | None, triangles: int) -> Named:
    """The file's mesh, y up, seen whole from its front and a little above; without one, a scan by formula, and so
    named. Raises UserError."""
    if not path:
        return Named("scan by formula", scan(triangles))
    if path.suffix.lower() not in READERS:
        raise UserError(f"{path}: the tables read {' and '.join(READERS)} files")
    mesh = READERS[path.suffix.lower()](path)
    mesh.check_finite()
    if not len(mesh.triangles):
        raise UserError(f"{path}: no triangles in it")
    made = shape(mesh.vertices, mesh.triangles)
    return Named(name, Scene(made, framed(made, (0.15, 0.2, 1))))


def percent(part: float, whole: float) -> str:
    """Of two of a kind."""
    return f"{100 * part / whole:.0f} %"


def milliseconds(seconds: float) -> str:
    """Three digits of them."""
    return number(1e3 * seconds)


def threads_named(count: int) -> str:
    """As a cell."""
    return str(count) if count else "all"
