"""A Blender scene as plain arrays: the evaluated depsgraph in, SceneData out."""

from __future__ import annotations

import bpy
import numpy as np

from ..pipeline.errors import UserError
from ..pipeline.mesh import Mesh
from ..pipeline.scene import LIGHT_DTYPE, SceneData
from .camera import camera_view
from .lights import light_row

NOT_TRACED = {
    "VOLUME": "a volume",
    "CURVES": "hair curves",
    "POINTCLOUD": "a point cloud",
    "GREASEPENCIL": "grease pencil",
    "GPENCIL": "grease pencil",
}


def scene_data(depsgraph: bpy.types.Depsgraph, width: int, height: int) -> SceneData:
    """Everything that `depsgraph` shows, seen by its scene's camera in width x height pixels.

    Curves, surfaces, text, metaballs and the output of geometry nodes come out of `object_instances` as meshes, and
    a mesh that several instances show is read once. What a mesh cannot hold is named in `skipped`.
    Raises UserError for a camera that is not perspective or orthographic, and for a transform that is not finite.
    """
    scene = depsgraph.scene_eval
    meshes: list[Mesh] = []
    rows: dict[bpy.types.Mesh, int | None] = {}
    shown: list[int] = []
    matrices: list[np.ndarray] = []
    lights: list[np.void] = []
    skipped: dict[str, None] = {}
    for instance in depsgraph.object_instances:
        owner = instance.object
        if instance.show_particles and not instance.is_instance and _has_hair(owner):
            skipped[f"object {owner.name!r}: hair particles have no triangles"] = None
        if not instance.show_self:
            continue
        if owner.type == "MESH":
            data = owner.data
            if data not in rows:
                mesh = read_mesh(data, owner.name)
                rows[data] = len(meshes) if len(mesh.triangles) else None
                if len(mesh.triangles):
                    meshes.append(mesh)
            row = rows[data]
            if row is None:
                skipped[f"object {owner.name!r} has no faces"] = None
                continue
            shown.append(row)
            matrices.append(_matrix(instance))
        elif owner.type == "LIGHT":
            light, note = light_row(owner, _matrix(instance))
            lights.append(light)
            if note:
                skipped[note] = None
        elif owner.type in NOT_TRACED:
            skipped[f"object {owner.name!r} is {NOT_TRACED[owner.type]}, which has no triangles"] = None
    return SceneData(
        meshes=meshes,
        instance_mesh=np.array(shown, np.int32),
        instance_matrix=np.array(matrices, np.float64).reshape(-1, 4, 4),
        name=scene.name,
        camera=camera_view(scene.camera, depsgraph, width, height) if scene.camera else None,
        lights=np.array(lights, LIGHT_DTYPE),
        skipped=tuple(skipped),
    )


def read_mesh(mesh: bpy.types.Mesh, name: str) -> Mesh:
    """Vertices (V, 3) float32 and triangles (T, 3) int32 of an evaluated mesh, as Blender triangulates it.

    The dtypes are those that Blender stores: with any other, foreach_get goes through one Python object a number.
    """
    triangle_count = len(mesh.loop_triangles)
    vertices = np.empty((len(mesh.vertices), 3), np.float32)
    corners = np.empty((triangle_count, 3), np.uint32)
    vertex_of_corner = np.empty(len(mesh.loops), np.int32)
    if triangle_count:
        mesh.attributes["position"].data.foreach_get("vector", vertices.ravel())
        mesh.loop_triangles.foreach_get("loops", corners.ravel())
        mesh.attributes[".corner_vert"].data.foreach_get("value", vertex_of_corner)
    return Mesh(name, vertices, vertex_of_corner[corners])


def _matrix(instance: bpy.types.DepsgraphObjectInstance) -> np.ndarray:
    """A copy: the instance's own matrix is gone when the loop goes on."""
    matrix = np.array(instance.matrix_world, np.float64)
    if not np.isfinite(matrix).all():
        raise UserError(
            f"object {instance.object.name!r}: its location, rotation or scale is NaN or infinite. "
            "Clear its transform, or hide it from renders."
        )
    return matrix


def _has_hair(owner: bpy.types.Object) -> bool:
    return any(system.settings.render_type == "PATH" for system in owner.particle_systems)
