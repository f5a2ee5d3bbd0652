"""One of Blender's meshes as plain arrays. The dtypes are those that Blender stores: with any other, foreach_get goes
through one Python object a number."""

from __future__ import annotations

import bpy
import numpy as np

from ..pipeline.looks import Reading
from ..pipeline.mesh import Mesh


def read_mesh(mesh: bpy.types.Mesh, name: str, reading: Reading | None = None) -> Mesh:
    """Vertices (V, 3) float32 and triangles (T, 3) int32 of an evaluated mesh, as Blender triangulates it, and what
    `reading` says of its looks; None: all."""
    reading = reading or Reading()
    triangle_count = len(mesh.loop_triangles)
    vertices = np.empty((len(mesh.vertices), 3), np.float32)
    corners = np.empty((triangle_count, 3), np.uint32)
    vertex_of_corner = np.empty(len(mesh.loops), np.int32)
    if not triangle_count:
        return Mesh(name, vertices, vertex_of_corner[corners])
    mesh.attributes["position"].data.foreach_get("vector", vertices.ravel())
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    mesh.attributes[".corner_vert"].data.foreach_get("value", vertex_of_corner)
    return Mesh(
        name,
        vertices,
        vertex_of_corner[corners],
        _materials(mesh) if reading.materials else None,
        _corner_normals(mesh, corners) if reading.normals else None,
    )


def _materials(mesh: bpy.types.Mesh) -> np.ndarray | None:
    """(T,) int32 slots; None where all are the first. As in Blender, a slot that there is not is the last one."""
    attribute = mesh.attributes.get("material_index")
    last = len(mesh.materials) - 1
    if attribute is None or last < 1 or attribute.domain != "FACE" or attribute.data_type != "INT":
        return None
    slots = np.empty(len(mesh.polygons), np.int32)
    attribute.data.foreach_get("value", slots)
    np.clip(slots, 0, last, out=slots)
    if not slots.any():
        return None
    polygon = np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", polygon)
    return slots[polygon]


def _corner_normals(mesh: bpy.types.Mesh, corners: np.ndarray) -> np.ndarray | None:
    """(T, 3, 3) float32; None where all faces are flat."""
    if mesh.normals_domain == "FACE":
        return None
    normals = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", normals.ravel())
    return normals[corners]
