"""Views that need a part of a mesh, or all of it, and what is wanted of construction on demand there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from addon.report.view import Scene, View

from .meshes import scene

MILLION = 1_000_000


@dataclass(frozen=True)
class Case:
    """A scene, the size of its picture, and the bounds of two shares of the eager tree's time, where there are some."""

    size: str
    scene: Callable[[Path | None], Scene]
    alone: float | None = None
    image: float = 1.05


def head(meshes: Path | None) -> Scene:
    """A close-up of the dragon's head: a fifth of its triangles."""
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


CASES = {
    "dragon": Case("640x480", lambda meshes: scene("dragon", meshes)),
    "dragon-large": Case("1280x1024", lambda meshes: scene("dragon", meshes)),
    "head": Case("1280x1024", head, alone=0.6),
    "street-1m": Case("1280x1024", lambda _: street(MILLION), alone=0.6),
    "street-10m": Case("1280x1024", lambda _: street(10 * MILLION), alone=0.45, image=0.75),
    "patch-10m": Case("1280x1024", lambda _: patch(10 * MILLION), alone=0.45, image=0.75),
    "room-10m": Case("1280x1024", lambda _: scene(f"building@{10 * MILLION}"), alone=0.45, image=0.75),
}
