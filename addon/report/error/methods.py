"""The methods that a report compares: each builds something from a mesh and answers rays in batches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any, NamedTuple, Protocol

import bihtree
import numpy as np
from numpy.typing import NDArray

from ...pipeline.mesh import Mesh
from ..structures import NOT_IN_THIS_VERSION
from .rays import Rays

PAIRS = 10_000_000
"""Pairs of ray and triangle that the naive method is given: it tests them all."""


class Answers(NamedTuple):
    """Of N rays: the row of a triangle or -1, and t in the method's own precision (inf for a miss)."""

    triangle: NDArray[np.integer[Any]]
    t: NDArray[np.floating[Any]]


class Built(Protocol):
    """What a method's build returns."""

    def trace(self, rays: Rays) -> Answers: ...

    def bytes(self) -> int | None:
        """Held beyond the mesh; None where it does not tell."""

    def nodes(self, rays: Rays) -> float | None:
        """Visited by a ray, the mean; None where it does not tell."""


class Method(Protocol):
    """A way to find hits."""

    @property
    def name(self) -> str: ...

    @property
    def note(self) -> str:
        """What a reader has to know of its numbers."""

    def missing(self) -> str:
        """Why it cannot be measured here; empty where it can."""

    def every(self, mesh: Mesh, rays: int) -> int:
        """It is given one ray in so many."""

    def build(self, mesh: Mesh) -> Built: ...


@dataclass(frozen=True)
class Ours:
    """A tree of bihtree, by its options."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""

    def missing(self) -> str:
        try:
            bihtree.Tree(np.eye(3, dtype=np.float32), **self.options)
        except ValueError:
            return NOT_IN_THIS_VERSION
        return ""

    def every(self, mesh: Mesh, rays: int) -> int:
        return 1

    def build(self, mesh: Mesh) -> OurBuilt:
        return OurBuilt(bihtree.Tree(mesh.vertices, mesh.triangles, **self.options, copy=False))


@dataclass(frozen=True)
class OurBuilt:
    tree: bihtree.Tree

    def trace(self, rays: Rays) -> Answers:
        hits = self.tree.intersect(*rays)
        return Answers(hits.triangle, hits.t)

    def bytes(self) -> int | None:
        return self.tree.stats.tree_bytes

    def nodes(self, rays: Rays) -> float | None:
        return float(self.tree.traversal_cost(*rays)[0].mean()) if len(rays.origins) else 0.0


@dataclass(frozen=True)
class Embree:
    """Embree through embreex, in single precision."""

    name: str
    robust: bool
    note: str = "rays on one thread, built on all; in single precision; does not tell its memory"

    def missing(self) -> str:
        return "" if find_spec("embreex") else "embreex is not installed"

    def every(self, mesh: Mesh, rays: int) -> int:
        return 1

    def build(self, mesh: Mesh) -> EmbreeBuilt:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        scene = EmbreeScene(robust=self.robust)
        with np.errstate(over="ignore"):
            geometry = TriangleMesh(scene, np.ascontiguousarray(mesh.vertices, np.float32), mesh.triangles)
        built = EmbreeBuilt(scene, geometry)
        # The first ray builds.
        built.trace(Rays(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32)))
        return built


class EmbreeBuilt:
    """The mesh lives as long as its scene."""

    def __init__(self, scene: Any, geometry: Any) -> None:
        self.scene, self.geometry = scene, geometry

    def trace(self, rays: Rays) -> Answers:
        with np.errstate(over="ignore"):
            origins, directions = (np.ascontiguousarray(values, np.float32) for values in rays)
        found = self.scene.run(origins, directions, output=1)
        rows = np.asarray(found["primID"]).astype(np.int32)
        return Answers(rows, np.where(rows < 0, np.float32(np.inf), np.asarray(found["tfar"], np.float32)))

    def bytes(self) -> int | None:
        return None

    def nodes(self, rays: Rays) -> float | None:
        return None


@dataclass(frozen=True)
class Naive:
    """Every ray against every triangle, in single precision (Möller and Trumbore 1997)."""

    name: str = "naive, float32"
    note: str = "NumPy, on few of the rays; its seconds are those of all rays in proportion"

    def missing(self) -> str:
        return ""

    def every(self, mesh: Mesh, rays: int) -> int:
        return max(1, rays * len(mesh.triangles) // PAIRS)

    def build(self, mesh: Mesh) -> NaiveBuilt:
        with np.errstate(over="ignore"):
            return NaiveBuilt(mesh.vertices.astype(np.float32)[mesh.triangles])


@dataclass(frozen=True)
class NaiveBuilt:
    corners: NDArray[np.float32]

    def trace(self, rays: Rays) -> Answers:
        rows, distances = [], []
        first = self.corners[:, 0]
        one, two = self.corners[:, 1] - first, self.corners[:, 2] - first
        for origin, direction in zip(rays.origins.astype(np.float32), rays.directions.astype(np.float32), strict=True):
            with np.errstate(all="ignore"):
                across = np.cross(direction, two)
                scale = 1 / (one * across).sum(axis=1)
                seen = origin - first
                u = (seen * across).sum(axis=1) * scale
                along = np.cross(seen, one)
                v = (along @ direction) * scale
                t = (two * along).sum(axis=1) * scale
                t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & np.isfinite(scale), t, np.inf)
            rows.append(int(np.argmin(t)))
            distances.append(t[rows[-1]])
        t = np.array(distances, np.float32)
        return Answers(np.where(np.isfinite(t), np.array(rows, np.int64), -1), t)

    def bytes(self) -> int | None:
        return 0

    def nodes(self, rays: Rays) -> float | None:
        return 0.0


FAST, WATERTIGHT, EXACT = "BIH fast", "BIH watertight", "BIH exact"


def methods(threads: int) -> list[Method]:
    """All of them; ours use so many threads (0: all)."""

    def ours(name: str, **options: Any) -> Ours:
        return Ours(name, {**options, "threads": threads})

    return [
        ours(FAST, precision="fast"),
        ours(WATERTIGHT),
        ours(EXACT, precision="exact"),
        ours("BIH presorted", presort=True),
        ours("BIH on demand", build="on_demand"),
        ours("BIH compact", layout="compact"),
        ours("BIH classic", layout="classic"),
        ours("kd_tree", structure="kd_tree"),
        ours("bvh", structure="bvh"),
        Embree("embreex", robust=False),
        Embree("embreex robust", robust=True),
        Naive(),
    ]
