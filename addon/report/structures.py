"""Acceleration structures as the tables measure them: built, and a picture taken with a very simple shader."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

import bihtree
import numpy as np

from ..pipeline.camera import CameraView
from .shapes import Shape

NOT_IN_THIS_VERSION = "not in this version"


@dataclass(frozen=True)
class Ours:
    """A tree of bihtree, by its options."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)

    def missing(self) -> str:
        try:
            bihtree.Tree(np.eye(3, dtype=np.float32), **self.options)
        except ValueError:
            return NOT_IN_THIS_VERSION
        return ""

    def build(self, mesh: Shape, view: CameraView) -> OurBuilt:
        tree = bihtree.Tree(mesh.vertices, mesh.triangles, **self.options, copy=False)
        return OurBuilt(tree, bihtree.Camera(view.clip_to_world, view.width, view.height))


@dataclass(frozen=True)
class OurBuilt:
    """Its picture is the headlight on grey matter: one product a pixel."""

    tree: bihtree.Tree
    camera: bihtree.Camera

    def frame(self) -> None:
        bihtree.render(self.tree, self.camera, passes=("combined",), shadows=False)

    def facts(self) -> dict[str, float]:
        stats = self.tree.stats
        return {"tree_bytes": stats.tree_bytes, "bound_bytes": stats.bound_bytes, "unbuilt": stats.unbuilt}


@dataclass(frozen=True)
class Embreex:
    """Embree through embreex: all rays in one call on one thread, the same product by NumPy. It does not tell its
    memory."""

    name: str = "embreex"

    def missing(self) -> str:
        return "" if find_spec("embreex") else "embreex is not installed"

    def build(self, mesh: Shape, view: CameraView) -> EmbreexBuilt:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        scene = EmbreeScene()
        geometry = TriangleMesh(scene, mesh.vertices, mesh.triangles.astype(np.int32))
        built = EmbreexBuilt(scene, geometry, view)
        # The first ray builds.
        scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
        return built


class EmbreexBuilt:
    """The mesh lives as long as its scene."""

    def __init__(self, scene: Any, geometry: Any, view: CameraView) -> None:
        self.scene, self.geometry, self.view = scene, geometry, view

    def frame(self) -> None:
        camera = bihtree.Camera(self.view.clip_to_world, self.view.width, self.view.height)
        origins, directions = (values.astype(np.float32) for values in camera.rays())
        hits = self.scene.run(origins, directions, output=1)
        normals = hits["Ng"]
        lengths = np.linalg.norm(normals, axis=1)
        cosine = np.abs(np.einsum("ij,ij->i", normals, directions)) / np.where(lengths > 0, lengths, 1)
        np.where(hits["primID"] >= 0, 0.8 * cosine, 0).reshape(self.view.height, self.view.width)

    def facts(self) -> dict[str, float]:
        return {}
