"""Make examples/overlay-*.blend, one for each way to look at a tree: python -m tools.make_overlay_examples

Run it with the bpy 4.2 wheel and bihtree: a .blend of Blender 5 does not open in Blender 4.2. All scenes are made by
formula, or of Blender's own primitives.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from addon.blender import classes
from addon.report import databases, scenes
from addon.report.shapes import Shape, part_of
from addon.report.view import Scene
from tools.make_examples import EXAMPLES, add, looking, mesh_of


@dataclass(frozen=True)
class Example:
    """`tree` and `overlay` are what is chosen in the scene, `text` what a person reads in its text Read Me."""

    make: Callable[[], Scene | None]
    text: str
    tree: Mapping[str, Any] = field(default_factory=dict)
    overlay: Mapping[str, Any] = field(default_factory=dict)
    finish: Callable[[], None] = lambda: None


def monkey() -> None:
    """Blender's own, smooth."""
    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.object.modifiers.new("Smooth", "SUBSURF").levels = 2


def real_geometry() -> None:
    bpy.ops.bih.build()
    bpy.ops.bih.mesh_from_tree(shown="planes", last_depth=3)
    bpy.ops.bih.free()


EXAMPLES_OF_THE_OVERLAY = {
    "planes": Example(
        monkey,
        "Build. Blue planes end left children, red ones start right children; purple is where both are. Drag To Depth.",
        overlay={"shown": "planes", "last_depth": 4},
    ),
    "boxes": Example(
        lambda: databases.sponge(2),
        "Build. Boxes of two levels are drawn: move From Depth and To Depth. Root, Left and Right select a node.",
        overlay={"shown": "boxes", "first_depth": 5, "last_depth": 6},
    ),
    "leaves": Example(
        lambda: databases.balls(2, 1),
        "Build. Only leaves are drawn. Choose another Heuristic or Leaf Size, and build again.",
        overlay={"shown": "leaves", "last_depth": 32},
    ),
    "construction": Example(
        lambda: databases.gears(2),
        "Build, then Play Construction: the tree level by level. Esc stops.",
        overlay={"shown": "planes", "last_depth": 0},
    ),
    "ray": Example(
        lambda: databases.rings(2, 8, 16),
        "Build, Pick Ray, and click on the rings: the nodes that the ray visits. Then turn the view.",
        overlay={"shown": "ray"},
    ),
    "on-demand": Example(
        lambda: scenes.terrain(8_000),
        "Build: the camera's rays build what they come to. Green is not yet subdivided. Move the camera, build again.",
        tree={"build": "on_demand", "leaf_size": 1},
        overlay={"shown": "leaves", "last_depth": 32},
    ),
    "cost": Example(
        lambda: databases.tree(5),
        "Build, then Cost from View: yellow is where a ray has much to do. Compare the heuristics.",
        overlay={"shown": "nothing"},
    ),
    "compare": Example(
        lambda: scenes.city(6_000),
        "Build, then Compare: a bounding interval hierarchy and a kd-tree over the same houses.",
        overlay={"shown": "planes", "last_depth": 6, "other_structure": "kd_tree"},
    ),
    "mesh": Example(
        monkey,
        "The clip planes of the upper levels as real geometry, made by Make Mesh: render it with any engine.",
        overlay={"is_shown": False},
        finish=real_geometry,
    ),
}


def main() -> int:
    if bpy.app.version[:2] != (4, 2):
        print(__doc__, file=sys.stderr)
        return 2
    for name, example in EXAMPLES_OF_THE_OVERLAY.items():
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        with classes.registered():
            save(name, example)
            bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    return 0


def save(name: str, example: Example) -> None:
    scene = bpy.context.scene
    made = example.make()
    if made is not None:
        made = made._replace(mesh=without_ground(made.mesh))
        add(name.capitalize(), mesh_of(name.capitalize(), upright(made), made.mesh.triangles.tolist()))
    for group, chosen in ((scene.bih, example.tree), (scene.bih_overlay, example.overlay)):
        for choice, value in chosen.items():
            setattr(group, choice, value)
    frame(near=name == "on-demand")
    example.finish()
    bpy.data.texts.new("Read Me").write(f"{example.text}\nThe tab BIH is in the 3D viewport's sidebar (N).\n")
    scene.render.engine = "BIH_PREVIEW"
    scene.render.resolution_x, scene.render.resolution_y = 960, 720
    path = EXAMPLES / f"overlay-{name}.blend"
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    print(f"{path}: {path.stat().st_size:,} bytes, saved by Blender {bpy.app.version_string}")


def without_ground(mesh: Shape) -> Shape:
    """The mesh without the few large triangles that some of these scenes stand on: all else would be small."""
    corners = mesh.vertices[mesh.triangles].astype(np.float64)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return part_of(mesh, longest < 0.4 * np.ptp(corners.reshape(-1, 3), axis=0).max())


def upright(scene: Scene) -> NDArray[np.float64]:
    """Z up, two metres large, around the origin."""
    up = int(np.argmax(np.abs(scene.view.up)))
    points = scene.mesh.vertices.astype(np.float64)
    used = np.unique(scene.mesh.triangles)
    if up == 1:
        points = np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)
    points -= (points[used].min(axis=0) + points[used].max(axis=0)) / 2
    scaled: NDArray[np.float64] = points * (2.0 / np.ptp(points[used], axis=0).max())
    return scaled


def frame(*, near: bool) -> None:
    """A camera that sees all of it, or a part, and a sun."""
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 250.0 if near else 40.0
    made = add("Camera", camera)
    made.matrix_world = looking(Vector((1.6, -4.2, 2.1)), Vector((0.0, 0.0, 0.0)))
    bpy.context.scene.camera = made
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy = 3.0
    add("Sun", sun).matrix_world = looking(Vector((-2.0, -1.5, 3.0)), Vector((0.0, 0.0, 0.0)))


if __name__ == "__main__":
    sys.exit(main())
