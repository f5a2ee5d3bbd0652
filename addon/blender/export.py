"""A Blender scene as plain arrays: the evaluated depsgraph in, SceneData out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import bpy
import numpy as np

from ..pipeline.looks import Reading
from ..pipeline.mesh import Mesh
from ..pipeline.mesh_cache import MeshCache
from ..pipeline.scene import LIGHT_DTYPE, OBJECT_DTYPE, SceneData
from .camera import camera_view
from .faults import faults
from .lights import light_row
from .mesh import read_mesh
from .objects import Objects, Row
from .surfaces import Surfaces, world_colour

NOT_TRACED = {
    "VOLUME": "a volume",
    "CURVES": "hair curves",
    "POINTCLOUD": "a point cloud",
    "GREASEPENCIL": "grease pencil",
    "GPENCIL": "grease pencil",
}

Progress = Callable[[str, float], bool | None]
"""As in addon/pipeline/prepared.py; the stage is "export"."""

INSTANCES_A_TICK = 4096
"""Progress is told so often: about every hundredth of a second."""


def scene_data(
    depsgraph: bpy.types.Depsgraph,
    width: int,
    height: int,
    *,
    meshes: MeshCache | None = None,
    reading: Reading | None = None,
    progress: Progress | None = None,
) -> SceneData:
    """Everything that `depsgraph` shows, seen by its scene's camera in width x height pixels.

    Raises UserError for a camera that is not perspective or orthographic, and as `contents` does.
    """
    camera = depsgraph.scene_eval.camera
    view = camera_view(camera, depsgraph, width, height) if camera else None
    return replace(contents(depsgraph, meshes=meshes, reading=reading, progress=progress), camera=view)


def contents(
    depsgraph: bpy.types.Depsgraph,
    *,
    meshes: MeshCache | None = None,
    space: bpy.types.SpaceView3D | None = None,
    reading: Reading | None = None,
    progress: Progress | None = None,
) -> SceneData:
    """Everything that `depsgraph` shows, without a camera; in `space`, what that viewport shows.

    Curves, surfaces, text, metaballs and the output of geometry nodes come out of `object_instances` as meshes, and
    a mesh that several instances show is read once. Those that `meshes` has from before are not read again where
    Blender has not evaluated them anew. `reading` says what of their looks is wanted; None: all. What cannot be traced
    is named in `skipped`.
    Raises bihtree.Cancelled where `progress` returns False.
    """
    cache = MeshCache() if meshes is None else meshes
    reading = reading or Reading()
    surfaces = Surfaces()
    objects = Objects(depsgraph, surfaces if reading.materials else None)
    read = _Meshes(cache, reading)
    looks: list[Row] = []
    shown: list[int] = []
    places: list[int] = []
    lights: list[np.void] = []
    skipped: dict[str, None] = dict.fromkeys(faults(depsgraph))
    matrices = _matrices(depsgraph)
    finite = np.isfinite(matrices).all(axis=(1, 2))
    for place, instance in enumerate(depsgraph.object_instances):
        if progress and place % INSTANCES_A_TICK == 0 and progress("export", place / len(matrices)) is False:
            raise _cancelled()
        owner = instance.object
        if not instance.is_instance and instance.show_particles and _has_hair(owner):
            skipped[f"object {owner.name!r}: hair particles have no triangles"] = None
        if not instance.show_self or (space and not owner.visible_in_viewport_get(space)):
            continue
        kind = owner.type
        if kind in {"MESH", "LIGHT"} and not finite[place]:
            skipped[f"object {owner.name!r} is left out: its location, rotation or scale is NaN or infinite"] = None
        elif kind == "MESH":
            row = read.row_of(owner)
            if isinstance(row, str):
                skipped[f"object {owner.name!r} {row}"] = None
            else:
                shown.append(row)
                places.append(place)
                looks.append(objects.row_of(instance))
        elif kind == "LIGHT":
            light, note = light_row(owner, matrices[place])
            lights.append(light)
            if note:
                skipped[note] = None
        elif kind in NOT_TRACED:
            skipped[f"object {owner.name!r} is {NOT_TRACED[kind]}, which has no triangles"] = None
    cache.forget_unused()
    scene = depsgraph.scene_eval
    world, note = world_colour(scene.world)
    notes = [*skipped, *surfaces.notes, *filter(None, [note])]
    return SceneData(
        meshes=read.meshes,
        instance_mesh=np.array(shown, np.int32),
        instance_matrix=matrices[np.array(places, np.intp)],
        name=scene.name,
        lights=np.array(lights, LIGHT_DTYPE),
        skipped=tuple(notes),
        surfaces=surfaces.rows,
        objects=np.array(looks, OBJECT_DTYPE),
        world=world,
        film_transparent=scene.render.film_transparent,
    )


class _Meshes:
    """The meshes of one export, each read once."""

    def __init__(self, cache: MeshCache, reading: Reading) -> None:
        self.meshes: list[Mesh] = []
        self._cache, self._reading = cache, reading
        self._rows: dict[bpy.types.Mesh, int | str] = {}
        self._of_owner: Counter[int] = Counter()

    def row_of(self, owner: bpy.types.Object) -> int | str:
        """Which of `meshes` an object shows now; where it shows none, why."""
        data = owner.data
        if data not in self._rows:
            self._rows[data] = self._read(owner)
        return self._rows[data]

    def _read(self, owner: bpy.types.Object) -> int | str:
        uid = owner.original.session_uid
        number = self._of_owner[uid]
        self._of_owner[uid] += 1
        try:
            mesh = _kept(self._cache, owner, owner.data, number, self._reading)
        except MemoryError:
            return "is left out: there is no memory for its mesh"
        if not len(mesh.triangles):
            return "has no faces"
        self.meshes.append(mesh)
        return len(self.meshes) - 1


def _cancelled() -> Exception:
    """bihtree may be missing, and the engine says so; this file is read all the same."""
    from bihtree import Cancelled

    return Cancelled("cancelled")


def _kept(cache: MeshCache, owner: bpy.types.Object, data: bpy.types.Mesh, number: int, reading: Reading) -> Mesh:
    """The mesh `number` of those that `owner` shows. Each evaluation of a mesh has a number of its own in a session;
    what is being edited in edit mode is not in the evaluated mesh."""
    identity = (owner.original.session_uid, number, reading)
    if not data.is_editmode:
        return cache.mesh(identity, lambda: read_mesh(data, owner.name, reading), evaluation=data.session_uid)
    try:
        return cache.mesh(identity, lambda: read_mesh(owner.to_mesh(), owner.name, reading))
    finally:
        owner.to_mesh_clear()


def _matrices(depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """(M, 4, 4) float64, object to world, of all instances in their order; all at once takes a fifth of the time."""
    columns = np.empty((len(depsgraph.object_instances), 4, 4), np.float32)
    depsgraph.object_instances.foreach_get("matrix_world", columns.ravel())
    return columns.transpose(0, 2, 1).astype(np.float64)


def _has_hair(owner: bpy.types.Object) -> bool:
    return any(system.settings.render_type == "PATH" for system in owner.particle_systems)
