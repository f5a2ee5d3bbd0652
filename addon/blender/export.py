"""A Blender scene as plain arrays: the evaluated depsgraph in, SceneData out."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import replace
from itertools import islice
from time import perf_counter

import bpy
import numpy as np

from ..pipeline.errors import UserError
from ..pipeline.instance_bounds import InstanceBoxes
from ..pipeline.looks import Reading
from ..pipeline.mesh import Mesh
from ..pipeline.mesh_cache import MeshCache
from ..pipeline.scene import LIGHT_DTYPE, OBJECT_DTYPE, SceneData
from .camera import scene_view
from .faults import faults
from .instance_matrices import Matrices
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

TRACED = frozenset({"MESH", "LIGHT"})
NOT_FINITE = "its location, rotation or scale is NaN or infinite"

Progress = Callable[[str, float], bool | None]
"""As in addon/pipeline/prepared.py; the stage is "export"."""

INSTANCES_A_TICK = 4096
"""Progress is told so often: about every hundredth of a second."""

MANY = 20_000
"""More instances take a tenth of a second and longer: a window goes on while they are read."""

MOST_BOXES = 100_000
"""So many boxes take a tenth of a second to be drawn."""


def scene_data(
    depsgraph: bpy.types.Depsgraph,
    width: int,
    height: int,
    *,
    reading: Reading | None = None,
) -> SceneData:
    """Everything that `depsgraph` shows, seen by its scene's camera in width x height pixels.

    Raises UserError for a camera that is not perspective or orthographic, and as `contents` does.
    """
    view = scene_view(depsgraph, width, height)
    return replace(contents(depsgraph, reading=reading), camera=view)


def contents(
    depsgraph: bpy.types.Depsgraph,
    *,
    reading: Reading | None = None,
    progress: Progress | None = None,
) -> SceneData:
    """Everything that `depsgraph` shows, without a camera.

    Curves, surfaces, text, metaballs and the output of geometry nodes come out of `object_instances` as meshes, and
    a mesh that several instances show is read once. `reading` says what of their looks is wanted; None: all. What
    cannot be traced is named in `skipped`.
    Raises bihtree.Cancelled where `progress` returns False.
    """
    export = Export(reading=reading)
    export.read_all(depsgraph, progress)
    return export.scene(depsgraph)


class Export:
    """The export of one depsgraph, in parts where a window is to go on meanwhile.

    What iterates over instances is not valid from one call of Blender's to the next, so each part walks past those that
    are done; and to the end, because Blender 4.3 never frees 221 bytes an instance of a walk that is given up.
    Meshes that `meshes` has from before are not read again where Blender has not evaluated them anew.
    """

    def __init__(self, *, meshes: MeshCache | None = None, reading: Reading | None = None) -> None:
        self._cache = MeshCache() if meshes is None else meshes
        self._reading = reading or Reading()
        self._surfaces = Surfaces()
        self._read = _Meshes(self._cache, self._reading)
        self._objects = Objects(self._surfaces if self._reading.materials else None)
        self._looks: list[Row] = []
        self._shown: list[int] = []
        self._places: list[int] = []
        self._lights: list[np.void] = []
        self._skipped: dict[str, None] = {}
        self._matrices: Matrices | None = None
        self._done = 0
        self._boxes = InstanceBoxes()

    def is_long(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Whether so many instances are shown that to read them makes a person wait."""
        return self._matrices_of(depsgraph).count > MANY

    @property
    def share(self) -> float:
        """How much of it is read."""
        return self._done / self._matrices.count if self._matrices and self._matrices.count else 0.0

    @property
    def shown_count(self) -> int:
        """How many instances with triangles are read."""
        return len(self._shown)

    def read_all(self, depsgraph: bpy.types.Depsgraph, progress: Progress | None = None) -> None:
        """What is left. Raises bihtree.Cancelled where `progress` returns False, and as `steps` does."""
        with closing(self.steps(depsgraph)) as steps:
            for share in steps:
                if progress and progress("export", share) is False:
                    raise _cancelled()

    def read(self, depsgraph: bpy.types.Depsgraph, space: bpy.types.SpaceView3D | None, *, seconds: float) -> bool:
        """Read for so long, and a little longer; whether all is read."""
        until = 0.0
        with closing(self.steps(depsgraph, space)) as steps:
            for tick, _ in enumerate(steps):
                if tick == 1:
                    until = perf_counter() + seconds
                elif tick and perf_counter() >= until:
                    return False
        return True

    def steps(
        self, depsgraph: bpy.types.Depsgraph, space: bpy.types.SpaceView3D | None = None
    ) -> Generator[float, None, None]:
        """Read what is left, and give the share that is done every now and then. Nothing else may happen in Blender
        before it ends, or is closed; then another one goes on.

        Raises UserError where less is shown than when it began.
        """
        matrices = self._matrices_of(depsgraph)
        if not self._done:
            self._skipped.update(dict.fromkeys(faults(depsgraph)))
            matrices.read(depsgraph)
        yield self.share
        self._objects.layer = depsgraph.view_layer
        read, skipped, row_of = self._read, self._skipped, self._objects.row_of
        place = first = self._done
        instances = iter(depsgraph.object_instances)
        try:
            for place, instance in zip(range(first, matrices.count), islice(instances, first, None), strict=False):
                if place % INSTANCES_A_TICK == 0 or read.has_news:
                    self._done, read.has_news = place, False
                    yield self.share
                owner = instance.object
                if not instance.is_instance and instance.show_particles and _has_hair(owner):
                    skipped[f"object {owner.name!r}: hair particles have no triangles"] = None
                if not instance.show_self or (space and not owner.visible_in_viewport_get(space)):
                    continue
                kind = owner.type
                if kind in NOT_TRACED:
                    skipped[f"object {owner.name!r} is {NOT_TRACED[kind]}, which has no triangles"] = None
                if kind not in TRACED:
                    continue
                if matrices.is_by_one:
                    matrices.read_one(place, instance)
                if not matrices.is_finite[place]:
                    skipped[f"object {owner.name!r} is left out: {NOT_FINITE}"] = None
                elif kind == "LIGHT":
                    self._add_light(owner, matrices.world[place].astype(np.float64))
                elif isinstance(row := read.row_of(owner), str):
                    skipped[f"object {owner.name!r} {row}"] = None
                else:
                    self._shown.append(row)
                    self._places.append(place)
                    self._looks.append(row_of(instance))
        finally:
            deque(instances, maxlen=0)
        if place < matrices.count - 1:
            raise UserError("the scene changed while it was read; do it again")
        self._done = matrices.count

    def _add_light(self, owner: bpy.types.Object, matrix: np.ndarray) -> None:
        light, note = light_row(owner, matrix)
        self._lights.append(light)
        if note:
            self._skipped[note] = None

    def _matrices_of(self, depsgraph: bpy.types.Depsgraph) -> Matrices:
        if self._matrices is None:
            self._matrices = Matrices(depsgraph)
        return self._matrices

    def boxes(self, first: int = 0) -> np.ndarray:
        """(N, 2, 3) float64 lower and upper corners of what is read and has triangles, from the `first` of them on; of
        more than MOST_BOXES instances evenly chosen ones."""
        if self._matrices is None:
            return np.zeros((0, 2, 3))
        step = max(1, -(-self._matrices.count // MOST_BOXES))
        chosen = slice(-(-first // step) * step, None, step)
        rows, places = np.array(self._shown[chosen], np.int32), np.array(self._places[chosen], np.intp)
        return self._boxes.boxes(self._read.meshes, rows, self._matrices.world[places].astype(np.float64))

    def scene(self, depsgraph: bpy.types.Depsgraph) -> SceneData:
        """What was read, once it is all there."""
        self._cache.forget_unused()
        scene = depsgraph.scene_eval
        world, note = world_colour(scene.world)
        notes = [*self._skipped, *self._surfaces.notes, *filter(None, [note])]
        return SceneData(
            meshes=self._read.meshes,
            instance_mesh=np.array(self._shown, np.int32),
            instance_matrix=self._matrices_of(depsgraph).world[np.array(self._places, np.intp)].astype(np.float64),
            name=scene.name,
            lights=np.array(self._lights, LIGHT_DTYPE),
            skipped=tuple(notes),
            surfaces=self._surfaces.rows,
            objects=np.array(self._looks, OBJECT_DTYPE),
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
        self.has_news = False
        """Whether a mesh was read; who has heard of it says so."""

    def row_of(self, owner: bpy.types.Object) -> int | str:
        """Which of `meshes` an object shows now; where it shows none, why."""
        data = owner.data
        if data not in self._rows:
            self._rows[data] = self._read(owner)
            self.has_news = True
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


def _has_hair(owner: bpy.types.Object) -> bool:
    return any(system.settings.render_type == "PATH" for system in owner.particle_systems)
