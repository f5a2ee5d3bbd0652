"""How what is traced looks: what bihtree.render is given beside the triangles, flattened or not."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh
from .scene import OBJECT_DTYPE, SceneData
from .settings import Settings

SHADED = frozenset({"combined"})
"""Passes made of light."""
BY_NORMAL = SHADED | {"normal"}
BY_SURFACE = SHADED | {"material_index"}
BY_OBJECT = frozenset({"instance", "object_index"})

RANGED_DTYPE = np.dtype([("first_triangle", "i8"), *((name, OBJECT_DTYPE[name]) for name in OBJECT_DTYPE.names or ())])


@dataclass(frozen=True)
class Reading:
    """What of the looks is read from Blender: what no pass shows stays there."""

    normals: bool = True
    materials: bool = True

    @classmethod
    def of(cls, settings: Settings, passes: Collection[str]) -> Reading:
        """What `passes` need."""
        return cls(
            normals=settings.smooth and not BY_NORMAL.isdisjoint(passes),
            materials=not BY_SURFACE.isdisjoint(passes),
        )


def lights(scene: SceneData, settings: Settings) -> NDArray[np.void]:
    """Those that shine: none where the headlight is chosen, and of no size where shadows are hard."""
    if settings.shading == "headlight":
        return scene.lights[:0]
    if settings.soft_shadows or not scene.lights["size"].any():
        return scene.lights
    hard = scene.lights.copy()
    hard["size"] = 0
    return hard


def surroundings(scene: SceneData, settings: Settings) -> dict[str, Any]:
    """What comes from all around, and what is seen behind all."""
    given: dict[str, Any] = {}
    if scene.world is None:
        return given
    if settings.shading != "headlight" and len(scene.lights):
        given["ambient"] = scene.world
    if not scene.film_transparent:
        given["background"] = (*scene.world, 1.0)
    return given


def objects(
    scene: SceneData, passes: Collection[str], *, has_surfaces: bool, flat: bool = True
) -> NDArray[np.void] | None:
    """One row an instance, of a flattened scene with its first triangle among all; None where nothing asks for them."""
    own = scene.objects
    is_plain = own is None or not own["flags"].any()
    if is_plain and not has_surfaces and not BY_OBJECT & set(passes):
        return None
    if not flat:
        return np.zeros(len(scene.instance_mesh), OBJECT_DTYPE) if own is None else own
    rows = np.zeros(len(scene.instance_mesh), RANGED_DTYPE)
    rows["first_triangle"][1:] = np.cumsum(scene.triangle_counts)[:-1]
    if own is not None:
        for name in OBJECT_DTYPE.names or ():
            rows[name] = own[name]
    return rows


def materials(scene: SceneData, *, flat: bool = True) -> NDArray[np.int32] | list[NDArray[np.int32] | None] | None:
    """(T,) the slot of each triangle, or not `flat` one array or None a mesh; None where all are the first."""
    if not flat:
        each = [mesh.materials for mesh in scene.meshes]
        return each if any(slots is not None for slots in each) else None
    shown = [scene.meshes[row] for row in scene.instance_mesh]
    if all(mesh.materials is None for mesh in shown):
        return None
    slots = [np.zeros(len(mesh.triangles), np.int32) if mesh.materials is None else mesh.materials for mesh in shown]
    return slots[0] if len(slots) == 1 else np.concatenate(slots)


def corner_normals(
    scene: SceneData, *, flat: bool = True
) -> NDArray[np.float32] | list[NDArray[np.float32] | None] | None:
    """(T, 3, 3) in the world, of any length, 0 where a triangle has its own, or not `flat` one array or None a mesh in
    its own space; None where all have."""
    if not flat:
        each = [mesh.corner_normals for mesh in scene.meshes]
        return each if any(normals is not None for normals in each) else None
    shown = [scene.meshes[row] for row in scene.instance_mesh]
    if all(mesh.corner_normals is None for mesh in shown):
        return None
    if len(shown) == 1 and not scene.moves:
        only: NDArray[np.float32] | None = shown[0].corner_normals
        return only
    normals = np.zeros((scene.triangle_count, 3, 3), np.float32)
    first = 0
    for mesh, matrix in zip(shown, scene.instance_matrix, strict=True):
        part = normals[first : first + len(mesh.triangles)]
        first += len(mesh.triangles)
        if mesh.corner_normals is not None:
            part[:] = turned(mesh, matrix)
    return normals


def turned(mesh: Mesh, matrix: NDArray[np.float64]) -> NDArray[np.float32]:
    """The mesh's corner normals through `matrix` (4, 4): by its cofactors, which singular matrices have too."""
    assert mesh.corner_normals is not None
    if np.array_equal(matrix[:3, :3], np.eye(3)):
        return mesh.corner_normals
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        x, y, z = (matrix[:3, :3] / np.abs(matrix[:3, :3]).max()).T
        cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)])
        # Not a matrix product: BLAS rounds differently from one processor to the next.
        a, b, c = (mesh.corner_normals[..., i, None] * cofactors[i] for i in range(3))
        normals: NDArray[np.float32] = (a + b + c).astype(np.float32)
    return normals
