"""Which objects no ray of a picture can reach: those outside its frustum, and outside the way from it to the lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .camera import CameraView
from .mesh import bounds_of
from .scene import ELLIPSE, RECTANGLE, SUN, SceneData

MARGIN = 2.0**-16
"""Of the largest coordinate: eight times how far precision `fast` lifts the start of a shadow ray (2^-19 of it), and
far more than the rounding of the few operations on doubles that a ray and a plane here are made of."""


@dataclass(frozen=True)
class Rays:
    """A convex body that all rays of one kind stay in: the hull of `points` (N, 3), and what the hull sweeps along
    `way` (3,) without end, if there is one."""

    points: NDArray[np.float64]
    way: NDArray[np.float64] | None = None
    spread: float = 0.0
    """The sine of the angle that ways may be away from `way`; 1: any."""
    grown: float = 0.0
    """How far beyond the hull they reach in any direction."""


def unreached(scene: SceneData, *, shadows: bool, distance: float = 0.0) -> NDArray[np.bool_]:
    """(M,) for each instance, whether its box is apart from all rays. None is where the camera sees without end.

    `distance` is how far rays of ambient occlusion go from what the camera sees."""
    none = np.zeros(len(scene.instance_mesh), bool)
    assert scene.camera is not None
    frustum = _frustum(scene.camera)
    if not np.isfinite(frustum).all() or not np.isfinite(distance):
        return none
    boxes = _boxes(scene)
    if not np.isfinite(boxes).all():
        return none
    kinds = [Rays(frustum, grown=distance)]
    if shadows:
        for light in scene.lights:
            if light["kind"] == SUN:
                half = 0.5 * min(float(light["size"][0]), np.pi)
                kinds.append(Rays(frustum, -light["direction"], spread=float(np.sin(half))))
            else:
                kinds.append(Rays(np.concatenate([frustum, _corners_of_light(light)])))
    axes = _axes(frustum)
    apart = ~none
    for rays in kinds:
        apart &= _apart(boxes, rays, axes)
    return apart


def _corners_of_light(light: np.void) -> NDArray[np.float64]:
    """(8, 3) of a cube about it."""
    size = float(np.hypot(*light["size"])) if light["kind"] in (RECTANGLE, ELLIPSE) else 2 * float(light["size"][0])
    steps = np.stack(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5]), axis=-1).reshape(-1, 3)
    corners: NDArray[np.float64] = light["position"] + size * steps
    return corners


def _frustum(view: CameraView) -> NDArray[np.float64]:
    """(8, 3) its corners, x fastest; not finite where the camera sees to infinity."""
    x, y, z = np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], indexing="ij")
    clip = np.stack([x.ravel(order="F"), y.ravel(order="F"), z.ravel(order="F"), np.ones(8)], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        world = clip @ view.clip_to_world.T
        corners: NDArray[np.float64] = world[:, :3] / world[:, 3:]
    # Of a frustum, all corners lie on one side of infinity.
    return corners if (world[:, 3] > 0).all() or (world[:, 3] < 0).all() else np.full((8, 3), np.inf)


def _boxes(scene: SceneData) -> NDArray[np.float64]:
    """(M, 8, 3) corners of each instance's box in its own space, moved to the world."""
    corners = np.array([_corners(mesh.vertices) for mesh in scene.meshes]).reshape(-1, 8, 3)[scene.instance_mesh]
    with np.errstate(over="ignore", invalid="ignore"):
        turned: NDArray[np.float64] = corners @ scene.instance_matrix[:, :3, :3].transpose(0, 2, 1)
        turned += scene.instance_matrix[:, None, :3, 3]
    return turned


def _corners(vertices: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """(8, 3) of their box."""
    if not len(vertices):
        return np.zeros((8, 3))
    ends = bounds_of(vertices).astype(np.float64)
    return np.stack([grid.ravel() for grid in np.meshgrid(*ends.T)], axis=1)


def _axes(frustum: NDArray[np.float64]) -> NDArray[np.float64]:
    """(9, 3) unit directions along which bodies are compared: the frustum's own planes, and the world's axes."""
    corner = dict(zip(("000", "100", "010", "110", "001", "101", "011", "111"), frustum, strict=True))
    planes = [
        np.cross(corner[b] - corner[a], corner[c] - corner[a])
        for a, b, c in (
            ("000", "100", "010"), ("001", "101", "011"),
            ("000", "010", "001"), ("100", "110", "101"),
            ("000", "100", "001"), ("010", "110", "011"),
        )
    ]  # fmt: skip
    lengths = np.linalg.norm(planes, axis=1, keepdims=True)
    is_plane = (lengths > 0) & np.isfinite(lengths)
    normals = np.where(is_plane, planes / np.where(is_plane, lengths, 1), [[1.0, 0, 0]])
    axes: NDArray[np.float64] = np.concatenate([normals, np.eye(3)])
    return axes


def _apart(boxes: NDArray[np.float64], rays: Rays, axes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(M,) whether some plane lies between a box (8, 3) and the rays."""
    margin = MARGIN * max(float(np.abs(rays.points).max()), float(np.abs(boxes).max(initial=0.0)))
    both: Sequence[NDArray[np.float64]] = (axes, -axes)
    apart = np.zeros(len(boxes), bool)
    for directions in both:
        reach = (rays.points @ directions.T).max(axis=0) + rays.grown
        if rays.way is not None:
            # Margin in the angle too: a sweep that only just turns away has no end here.
            ahead = directions @ rays.way > -(MARGIN + rays.spread) * np.linalg.norm(rays.way)
            reach = np.where(ahead, np.inf, reach)
        least = (boxes @ directions.T).min(axis=1)
        apart |= (least > reach + margin).any(axis=1)
    return apart


def share_in_view(scene: SceneData, samples: int = 4096) -> float:
    """About what share of the triangles lies within the camera's frustum, hidden ones too: that of an even sample of
    first corners."""
    assert scene.camera is not None
    step = max(1, scene.triangle_count // samples)
    inside = total = 0
    to_clip = scene.camera.world_to_clip
    for row, matrix in zip(scene.instance_mesh, scene.instance_matrix, strict=True):
        mesh = scene.meshes[row]
        corners = mesh.vertices[mesh.triangles[::step, 0]].astype(np.float64)
        clip = corners @ (to_clip @ matrix)[:, :3].T + (to_clip @ matrix)[:, 3]
        inside += int(np.count_nonzero((np.abs(clip[:, :3]) <= clip[:, 3:]).all(axis=1)))
        total += len(clip)
    return inside / max(1, total)
