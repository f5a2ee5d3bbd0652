"""Make examples/bunny.blend from the Stanford bunny: python -m tools.make_examples BUNNY.npz

Run it with the bpy 4.2 wheel: a .blend of Blender 5 does not open in Blender 4.2. BUNNY is the mesh as Stanford gives
it, in metres with Y up: an .npz of `vertices` and `triangles`, or an .obj.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from addon.blender import classes
from addon.blender.engine import BihPreviewEngine
from addon.blender.mesh import read_mesh
from addon.pipeline.mesh import Mesh, read_npz

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
HEIGHT = 1.6
FLOOR = 1.3
"""Height of the bunny and half the side of the floor, in metres."""


def main(arguments: list[str]) -> int:
    if len(arguments) != 1 or bpy.app.version[:2] != (4, 2):
        print(__doc__, file=sys.stderr)
        return 2
    bunny = read_bunny(Path(arguments[0]))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with classes.registered():
        scene = bpy.context.scene
        scene.name = "Bunny"
        add("Bunny", mesh_of("Bunny", standing(bunny.vertices), bunny.triangles.tolist()))
        add("Floor", floor()).location.x = 0.12  # the shadow falls on that side
        add_lights()
        add_camera()
        scene.render.engine = BihPreviewEngine.bl_idname
        scene.render.resolution_x, scene.render.resolution_y = 1280, 720
        scene.view_settings.view_transform = "Standard"
        scene.bih.samples, scene.bih.overlay_depth = 4, 4
        path = EXAMPLES / "bunny.blend"
        bpy.context.preferences.filepaths.save_version = 0
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
        scene.render.engine = "BLENDER_WORKBENCH"
    print(f"{path}: {path.stat().st_size:,} bytes, saved by Blender {bpy.app.version_string}")
    return 0


def read_bunny(path: Path) -> Mesh:
    """The mesh with the axes of its file."""
    if path.suffix == ".npz":
        return read_npz(path)
    bpy.ops.wm.obj_import(filepath=str(path.absolute()), forward_axis="Y", up_axis="Z")
    return read_mesh(bpy.context.object.data, path.stem)


def standing(vertices: NDArray[Any]) -> NDArray[np.float64]:
    """Z up, HEIGHT tall, its lowest vertex on z = 0 and its box around the z axis."""
    x, y, z = vertices.astype(np.float64).T
    turned: NDArray[np.float64] = np.stack([x, -z, y], axis=1)
    turned -= (turned.min(axis=0) + turned.max(axis=0)) / 2
    turned[:, 2] -= turned[:, 2].min()
    turned *= HEIGHT / turned[:, 2].max()
    return turned


def floor() -> bpy.types.Mesh:
    """A square of small squares: two huge triangles would overlap every box of the tree."""
    steps = 33
    x, y = np.meshgrid(*[np.linspace(-FLOOR, FLOOR, steps)] * 2)
    corner = (np.arange(steps - 1)[:, None] * steps + np.arange(steps - 1)).reshape(-1, 1)
    faces = corner + [0, 1, steps + 1, steps]
    return mesh_of("Floor", np.stack([x, y, np.zeros_like(x)], axis=2).reshape(-1, 3), faces.tolist())


def add_lights() -> None:
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy = 2.7
    add("Sun", sun).matrix_world = looking(Vector((-2.4, -0.15, 3.4)), Vector((0.0, 0.0, 0.0)))
    fill = bpy.data.lights.new("Fill", "POINT")
    fill.energy = 260.0
    add("Fill", fill).location = (1.5, -5.0, 3.5)


def add_camera() -> None:
    camera = bpy.data.cameras.new("Camera")
    camera.lens, camera.shift_x = 37.5, 0.017  # room for the legend of the overlay picture
    made = add("Camera", camera)
    made.matrix_world = looking(Vector((-1.1, -5.75, 2.9)), Vector((0.1, 0.0, 0.62)))
    bpy.context.scene.camera = made


def looking(place: Vector, target: Vector) -> Matrix:
    turn = (target - place).to_track_quat("-Z", "Y")
    return Matrix.Translation(place) @ turn.to_matrix().to_4x4()


def mesh_of(name: str, vertices: NDArray[Any], faces: list[list[int]]) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], faces)
    return mesh


def add(name: str, data: bpy.types.ID) -> bpy.types.Object:
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
