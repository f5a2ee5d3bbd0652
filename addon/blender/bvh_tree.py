"""Blender's own BVHTree as a method of the report; it takes a ray a call."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from ..pipeline.mesh import Mesh
from ..report.error.methods import Answers
from ..report.error.rays import Rays


@dataclass(frozen=True)
class BlenderTree:
    """In single precision."""

    why_missing: str = ""
    name: str = "Blender's BVHTree"
    note: str = "a call a ray from Python, most of its time; in single precision; does not tell its memory"

    def missing(self) -> str:
        return self.why_missing

    def every(self, mesh: Mesh, rays: int) -> int:
        return max(1, rays // 20_000)

    def build(self, mesh: Mesh) -> BlenderTreeBuilt:
        import_module("bpy")  # the wheel brings mathutils along with it
        tree = import_module("mathutils.bvhtree").BVHTree
        return BlenderTreeBuilt(tree.FromPolygons(mesh.vertices.tolist(), mesh.triangles.tolist(), all_triangles=True))


class BlenderTreeBuilt:
    def __init__(self, tree: Any) -> None:
        self.tree = tree
        self.vector = import_module("mathutils").Vector

    def trace(self, rays: Rays) -> Answers:
        """Its distances are in lengths: each is divided by that of its direction."""
        rows, distances = [], []
        lengths = np.linalg.norm(rays.directions.astype(np.float64), axis=1)
        for origin, direction in zip(rays.origins.tolist(), rays.directions.tolist(), strict=True):
            _, _, row, distance = self.tree.ray_cast(self.vector(origin), self.vector(direction))
            rows.append(-1 if row is None else row)
            distances.append(np.inf if row is None else distance)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            t = (np.array(distances, np.float64) / lengths).astype(np.float32)
        return Answers(np.array(rows, np.int64), t)

    def bytes(self) -> int | None:
        return None

    def nodes(self, rays: Rays) -> float | None:
        return None
