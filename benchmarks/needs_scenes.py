"""Ten scenes that need different things, for benchmarks/needs.py."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from addon.pipeline.camera import CameraView, framing_view, perspective_view
from addon.pipeline.mesh import Mesh
from addon.pipeline.scene import LIGHT_DTYPE, POINT, SUN, SceneData
from addon.pipeline.settings import Settings
from addon.report.scenes import city, soup, terrain
from addon.report.shapes import Shape, box, sphere

LARGE = (320, 240)
"""Of most pictures."""


@dataclass(frozen=True)
class Case:
    """A scene and what is asked of it."""

    scene: SceneData
    settings: Settings

    def smaller(self, factor: int) -> Case:
        """The same in a picture of so many times fewer pixels a side."""
        view = self.scene.camera
        assert view is not None
        camera = replace(view, width=max(1, view.width // factor), height=max(1, view.height // factor))
        return replace(self, scene=replace(self.scene, camera=camera))


def mesh_of(name: str, part: Shape) -> Mesh:
    """As the pipeline has it."""
    return Mesh(name, part.vertices, part.triangles.view(np.int32))


def _lights(*rows: tuple[int, tuple[float, float, float], float]) -> NDArray[np.void]:
    """(kind, its direction or position, what it gives)."""
    lights = np.zeros(len(rows), LIGHT_DTYPE)
    for light, (kind, vector, given) in zip(lights, rows, strict=True):
        light["kind"], light["colour"] = kind, given
        light["direction" if kind == SUN else "position"] = vector
    return lights


def framed(mesh: Mesh, size: tuple[int, int], lights: NDArray[np.void] | None = None) -> SceneData:
    """One still object, whole in the picture."""
    bounds = np.stack([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])
    none = np.zeros(0, LIGHT_DTYPE)
    view = framing_view(bounds, *size)
    return SceneData(
        [mesh], np.zeros(1, np.int32), np.eye(4)[None], mesh.name, view, none if lights is None else lights
    )


def triangle(size: int) -> Case:
    """One, in a picture of an icon's size."""
    mesh = Mesh("triangle", np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
    return Case(framed(mesh, (32, 32)), Settings(passes=("combined",)))


def cube(size: int) -> Case:
    """Twelve triangles and a sun."""
    return Case(framed(mesh_of("cube", box()), (160, 120), _lights((SUN, (-1, 2, -3), 3))), Settings())


def ball(size: int) -> Case:
    """Needs none of the parts but its picture: one still object and no light."""
    return Case(framed(mesh_of("ball", sphere(5)), LARGE), Settings(passes=("combined",)))


def land(size: int) -> Case:
    """A landscape, a sun, and every pass but the cost."""
    passes = ("combined", "depth", "normal", "position", "triangle")
    mesh = mesh_of("land", terrain(size).mesh)
    return Case(framed(mesh, LARGE, _lights((SUN, (1, -2, 1), 3))), Settings(passes=passes))


def dust(size: int) -> Case:
    """A soup of triangles, of which the depth alone is wanted."""
    return Case(
        framed(mesh_of("dust", soup(size).mesh), LARGE, _lights((SUN, (1, 1, -1), 3))), Settings(passes=("depth",))
    )


def night(size: int) -> Case:
    """A city by one lamp; two more are switched off."""
    mesh = mesh_of("night", city(size).mesh)
    side = float(mesh.vertices.max())
    lamps = _lights((POINT, (0, side, 0), 0), (POINT, (0, side, -side), 40 * side * side), (SUN, (0, -1, 0), 0))
    return Case(framed(mesh, LARGE, lamps), Settings(passes=("combined",)))


def double(size: int) -> Case:
    """Double precision that single precision would hold."""
    mesh = terrain(size // 2).mesh
    wide = Mesh("double", mesh.vertices.astype(np.float64), mesh.triangles.view(np.int32))
    return Case(framed(wide, LARGE), Settings(passes=("combined", "normal")))


def far(size: int) -> Case:
    """The same far away, where it would not."""
    mesh = terrain(size // 2).mesh
    away = mesh.vertices + np.array([1e6, 2e6, 3e6]) / 3
    return Case(framed(Mesh("far", away, mesh.triangles.view(np.int32)), LARGE), Settings(passes=("combined",)))


def stage(size: int) -> Case:
    """Balls all around the camera, which sees a few of them; a sun, so that some throw shadows into the picture."""
    part = sphere(4)
    count = max(16, size // len(part.triangles))
    turn = np.arange(count) * 2.399963  # the golden angle
    out = 3 + 0.05 * np.arange(count)
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, 3] = np.stack([out * np.cos(turn), out * np.sin(turn), np.zeros(count)], axis=1)
    eye, target, up = np.zeros(3), np.array([0.0, 1, 0]), np.array([0, 0, 1.0])
    view = perspective_view(eye, target, up, *LARGE, field_of_view=0.7, near=0.1, far=100.0)
    lights = _lights((SUN, (0.4, 1, -0.2), 3))
    rows = np.zeros(count, np.int32)
    return Case(
        SceneData([mesh_of("ball", part)], rows, matrices, "stage", view, lights),
        Settings(passes=("combined", "triangle")),
    )


def close(size: int) -> Case:
    """A few metres of a landscape of ten times the size."""
    mesh = mesh_of("close", terrain(10 * size).mesh)
    eye, target, up = np.array([5.0, 1.2, 5]), np.array([5.4, 0.6, 5.5]), np.array([0, 1.0, 0])
    view: CameraView = perspective_view(eye, target, up, *LARGE, field_of_view=0.6, near=0.01, far=2.0)
    return Case(SceneData.of_mesh(mesh, view), Settings(passes=("combined",)))


SCENES: dict[str, Callable[[int], Case]] = {
    "triangle": triangle,
    "cube": cube,
    "ball": ball,
    "land": land,
    "dust": dust,
    "night": night,
    "double": double,
    "far": far,
    "stage": stage,
    "close": close,
}
"""By name; each is called with about how many triangles the larger ones shall have."""
