"""What a report is about: a scene as the pipeline takes it, and all of it as one mesh in the world."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...pipeline.camera import CameraView
from ...pipeline.errors import UserError
from ...pipeline.mesh import Mesh, bounds_of
from ...pipeline.scene import SceneData
from ...pipeline.settings import Settings
from ..scenes import SCENES
from ..view import camera_of

PICTURE = (640, 480)


@dataclass(frozen=True)
class Subject:
    """The scene has a camera; `source` says where it comes from."""

    scene: SceneData
    settings: Settings
    source: str

    @cached_property
    def mesh(self) -> Mesh:
        """Every object where it stands. Raises UserError where there is nothing to trace."""
        for row in np.unique(self.scene.instance_mesh):
            self.scene.meshes[row].check_finite()
        vertices, triangles = self.scene.flatten()
        if not len(triangles):
            raise UserError(f"{self.source}: no triangles to trace; show an object with faces in renders")
        return Mesh(self.scene.name, np.ascontiguousarray(vertices), np.ascontiguousarray(triangles, np.int32))

    @property
    def camera(self) -> CameraView:
        if self.scene.camera is None:
            raise UserError(f"{self.source}: scene {self.scene.name!r} has no camera; add one and save the file again")
        return self.scene.camera

    @property
    def size(self) -> str:
        """Of its picture."""
        return f"{self.camera.width} x {self.camera.height}"

    def in_width(self, most: int) -> Subject:
        """The same picture in at most so many pixels across."""
        view = self.camera
        if view.width <= most:
            return self
        height = max(1, round(view.height * most / view.width))
        return replace(self, scene=replace(self.scene, camera=replace(view, width=most, height=height)))

    def moved(self, sizes: float) -> Subject:
        """All of it, camera too, moved by so many times its size, in double precision."""
        if not sizes:
            return self
        lower, upper = bounds_of(self.mesh.vertices.astype(np.float64))
        step = sizes * float((upper - lower).max()) * np.array([1.0, 0.7, -0.4])
        shift = np.eye(4)
        shift[:3, 3] = step
        view = replace(self.camera, clip_to_world=shift @ self.camera.clip_to_world)
        lights = self.scene.lights.copy()
        lights["position"] += step
        mesh = Mesh(self.mesh.name, self.mesh.vertices.astype(np.float64) + step, self.mesh.triangles)
        scene = replace(SceneData.of_mesh(mesh, view), lights=lights)
        return replace(self, scene=scene, source=f"{self.source}, moved by {sizes:g} times its size")


def built_in(name: str, triangles: int) -> Subject:
    """A scene by formula, of about so many triangles. Raises UserError for an unknown name."""
    if name not in SCENES:
        raise UserError(f"unknown scene {name!r}; choose from {', '.join(SCENES)}", exit_status=2)
    made = SCENES[name](triangles)
    mesh = Mesh(name, made.mesh.vertices, made.mesh.triangles.astype(np.int32))
    return Subject(SceneData.of_mesh(mesh, camera_of(made, *PICTURE)), Settings(), f"built-in scene {name}")


def size_of(vertices: NDArray[np.floating[Any]]) -> float:
    """The length of the diagonal of their bounds."""
    lower, upper = bounds_of(vertices.astype(np.float64))
    return float(np.linalg.norm(upper - lower))
