"""The peers that Python has, on the same arrays: embreex, and Blender's BVHTree, which takes a ray a call."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import Any, NamedTuple

import bihtree
import numpy as np
from numpy.typing import NDArray

from addon.report.shapes import Shape
from addon.report.view import Scene

from .harness import Result

RAYS = 200_000
EVERY = 10
"""Those that take a ray a call are given one in so many."""

Hits = NDArray[np.int64]


class Rays(NamedTuple):
    """(N, 3) float32 each."""

    origins: NDArray[np.float32]
    directions: NDArray[np.float32]


def primary_rays(scene: Scene, count: int = RAYS) -> Rays:
    """Through a grid of 4 x 3 parts, row by row."""
    view = scene.view
    rows = round((count * 3 / 4) ** 0.5)
    columns = count // rows
    eye, forward = np.asarray(view.eye), np.subtract(view.target, view.eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, view.up)
    right /= np.linalg.norm(right)
    tangent = np.tan(np.radians(view.angle) / 2)
    y, x = np.mgrid[1 : -1 : complex(rows), -1 : 1 : complex(columns)].reshape(2, -1, 1)
    directions = forward + x * tangent * 4 / 3 * right + y * tangent * np.cross(right, forward)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = np.broadcast_to(eye, directions.shape)
    return Rays(np.ascontiguousarray(origins, np.float32), directions.astype(np.float32))


def random_rays(mesh: Shape, count: int = RAYS) -> Rays:
    """From a sphere around the mesh to points in its bounds."""
    rng = np.random.default_rng(5)
    lower, upper = mesh.vertices.min(axis=0).astype(np.float64), mesh.vertices.max(axis=0).astype(np.float64)
    around = rng.standard_normal((count, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    origins = (lower + upper) / 2 + 0.6 * np.linalg.norm(upper - lower) * around
    directions = lower + rng.random((count, 3)) * (upper - lower) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return Rays(origins.astype(np.float32), directions.astype(np.float32))


def _embreex(mesh: Shape) -> Callable[[Rays], Hits]:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    geometry = TriangleMesh(scene, mesh.vertices, mesh.triangles.astype(np.int32))

    def trace(rays: Rays) -> Hits:
        # The mesh lives as long as its scene is traced.
        assert geometry is not None
        return np.asarray(scene.run(rays.origins, rays.directions), np.int64)

    # The scene is built by the first ray.
    trace(Rays(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32)))
    return trace


def _bihtree(**options: Any) -> Callable[[Shape], Callable[[Rays], Hits]]:
    def build(mesh: Shape) -> Callable[[Rays], Hits]:
        tree = bihtree.Tree(mesh.vertices, mesh.triangles.astype(np.int32), **options)
        return lambda rays: tree.intersect(rays.origins, rays.directions).triangle.astype(np.int64)

    return build


def _bvh_tree(mesh: Shape) -> Callable[[Rays], Hits]:
    import bpy  # noqa: F401 - brings mathutils along
    from mathutils import Vector
    from mathutils.bvhtree import BVHTree

    tree = BVHTree.FromPolygons(mesh.vertices.tolist(), mesh.triangles.tolist(), all_triangles=True)

    def trace(rays: Rays) -> Hits:
        pairs = zip(rays.origins[::EVERY].tolist(), rays.directions[::EVERY].tolist(), strict=True)
        found = [tree.ray_cast(Vector(origin), Vector(direction))[2] for origin, direction in pairs]
        return np.array([-1 if triangle is None else triangle for triangle in found], np.int64)

    return trace


PEERS: dict[str, Callable[[Shape], Callable[[Rays], Hits]]] = {
    "bihtree": _bihtree(layout="wide"),
    "bihtree, 1 thread": _bihtree(layout="wide", threads=1),
    "embreex": _embreex,
    "BVHTree": _bvh_tree,
}


def measure(scene: Scene, rounds: int = 3) -> Result:
    """Each peer's median build and rays a second, and how many of its rays hit what those of bihtree miss, or not."""
    mesh = scene.mesh
    kinds = {"primary": primary_rays(scene), "random": random_rays(mesh)}
    table: Result = {name: {} for name in PEERS}
    built: dict[str, Callable[[Rays], Hits]] = {}
    clocks: dict[tuple[str, str], list[float]] = {}
    answers: dict[tuple[str, str], Hits] = {}
    for turn in range(rounds + 1):
        for name, build in PEERS.items():
            # Blender's own takes a second a million triangles, and needs no second opinion.
            if turn < (2 if name == "BVHTree" else rounds + 1):
                start = perf_counter()
                built[name] = build(mesh)
                clocks.setdefault((name, "build"), []).append(perf_counter() - start)
            for kind, rays in kinds.items():
                start = perf_counter()
                answers[name, kind] = built[name](rays)
                clocks.setdefault((name, kind), []).append(perf_counter() - start)
    for (name, what), seconds in clocks.items():
        # The first round warms up.
        table[name][f"{what}_seconds"] = median(seconds[1:])
        if what != "build":
            found = answers[name, what]
            reference = answers["bihtree", what][:: EVERY if name == "BVHTree" else 1]
            table[name][f"{what}_rays_a_second"] = len(found) / median(seconds[1:])
            table[name][f"{what}_differing"] = int(((found < 0) != (reference < 0)).sum())
    return {"peers": table, "triangles": len(mesh.triangles)}
