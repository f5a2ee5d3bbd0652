"""The rays of a report, by kind: what a camera sends out, what bounces, any, and rays aimed to slip through."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import bihtree
import numpy as np
from numpy.typing import NDArray

from ...pipeline.camera import CameraView
from ...pipeline.mesh import Mesh, bounds_of
from .subject import size_of
from .truth import Nearest, Truth

SHARES = {"camera": 0.4, "bounce": 0.2, "random": 0.2, "at vertices": 0.1, "at edges": 0.1}
"""Of all rays, by kind."""
AIMED = ("at vertices", "at edges")
AWAY = 1e-4
"""Bounced rays start so far from the surface, in sizes of the scene, as renderers do."""
PLACES = 64
"""Points tried for those inside the mesh, where aimed rays start."""

Floats = NDArray[np.float64]


class Rays(NamedTuple):
    """(N, 3) each, of the mesh's own precision."""

    origins: NDArray[np.floating[Any]]
    directions: NDArray[np.floating[Any]]

    def every(self, step: int) -> Rays:
        return Rays(self.origins[::step], self.directions[::step])


@dataclass(frozen=True)
class Kind:
    """One kind of rays, and what they truly hit."""

    rays: Rays
    truth: Nearest


def of_kinds(truth: Truth, mesh: Mesh, view: CameraView, count: int) -> Iterator[tuple[str, Rays, Nearest]]:
    """All kinds with what they hit; about `count` rays."""
    rng = np.random.default_rng(6)
    counts = {kind: max(1, round(share * count)) for kind, share in SHARES.items()}
    seen = camera_rays(view, counts["camera"], mesh.vertices.dtype)
    seen_hits = truth.nearest(*seen)
    yield "camera", seen, seen_hits
    for kind, rays in (
        ("bounce", bounced(truth, seen, seen_hits, counts["bounce"], size_of(mesh.vertices), rng)),
        ("random", around(mesh, counts["random"], rng)),
        ("at vertices", aimed(truth, mesh, counts["at vertices"], rng, at_vertices=True)),
        ("at edges", aimed(truth, mesh, counts["at edges"], rng, at_vertices=False)),
    ):
        yield kind, rays, truth.nearest(*rays)


def _rays(origins: Floats, targets: Floats, dtype: np.dtype[Any]) -> Rays:
    """Origins are rounded first, so that each ray still aims at its target; none has a direction of zero."""
    start = origins.astype(dtype)
    directions = (targets - start.astype(np.float64)).astype(dtype)
    directions[~directions.any(axis=1)] = [0, 0, 1]
    return Rays(np.ascontiguousarray(start), np.ascontiguousarray(directions))


def camera_rays(view: CameraView, count: int, dtype: np.dtype[Any]) -> Rays:
    """Through the middles of the pixels of a smaller picture by the same camera."""
    width = max(1, round((count * view.width / view.height) ** 0.5))
    camera = bihtree.Camera(view.clip_to_world, width, max(1, round(count / width)))
    origins, directions = camera.rays()
    return Rays(np.ascontiguousarray(origins, dtype), np.ascontiguousarray(directions, dtype))


def bounced(truth: Truth, rays: Rays, hits: Nearest, count: int, size: float, rng: np.random.Generator) -> Rays:
    """From where rays hit, by the cosine around the normal; where nothing is hit, none."""
    rows = np.flatnonzero(hits.hit)
    chosen = rng.choice(rows, count) if len(rows) else rows
    origins, directions = (values[chosen].astype(np.float64) for values in rays)
    corners = truth.corners[hits.triangle[chosen]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals *= -np.sign((normals * directions).sum(axis=1, keepdims=True))
    points = origins + directions * hits.t[chosen, None] + normals * (AWAY * size)
    outward = rng.normal(size=(len(chosen), 3))
    outward = normals + outward / np.linalg.norm(outward, axis=1, keepdims=True)
    return _rays(points, points + size * outward, rays.origins.dtype)


def around(mesh: Mesh, count: int, rng: np.random.Generator) -> Rays:
    """From a sphere about the mesh to random points of its bounds."""
    lower, upper = bounds_of(mesh.vertices.astype(np.float64))
    away = rng.normal(size=(count, 3))
    away *= 0.6 * np.linalg.norm(upper - lower) / np.linalg.norm(away, axis=1, keepdims=True)
    return _rays((lower + upper) / 2 + away, rng.uniform(lower, upper, (count, 3)), mesh.vertices.dtype)


def inside(truth: Truth, mesh: Mesh, rng: np.random.Generator) -> Floats:
    """Points that a random ray leaves through an odd number of triangles; if there are none, any of the bounds."""
    lower, upper = bounds_of(mesh.vertices.astype(np.float64))
    points = rng.uniform(lower, upper, (PLACES, 3)).astype(mesh.vertices.dtype).astype(np.float64)
    crossed = truth.count(points, rng.normal(size=(PLACES, 3)))
    odd = points[crossed % 2 == 1]
    return odd if len(odd) else points


def aimed(truth: Truth, mesh: Mesh, count: int, rng: np.random.Generator, *, at_vertices: bool) -> Rays:
    """From inside the mesh to its vertices, or to random points of its edges."""
    corners = truth.corners[rng.integers(0, len(mesh.triangles), count)]
    weight = np.zeros((count, 1)) if at_vertices else rng.random((count, 1))
    places = inside(truth, mesh, rng)
    origins = places[rng.integers(0, len(places), count)]
    targets = corners[:, 0] + weight * (corners[:, 1] - corners[:, 0])
    return _rays(origins, targets, mesh.vertices.dtype)
