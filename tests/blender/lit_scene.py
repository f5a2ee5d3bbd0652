"""Coloured balls and a box on a floor, under one light of each kind and a world: all that evenly scatters light."""

from __future__ import annotations

import bpy
from mathutils import Matrix, Vector

from tests.blender.scenes import add, add_mesh
from tests.meshes import Triangles, box, icosphere

BALLS = ((-1.6, 0.3, (0.8, 0.1, 0.08)), (0.2, -0.4, (0.1, 0.5, 0.12)), (1.9, 0.5, (0.08, 0.16, 0.75)))


def diffuse(name: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    made = bpy.data.materials.new(name)
    if not made.node_tree:
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    node.inputs["Color"].default_value = (*colour, 1.0)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return made


def painted(name: str, mesh: Triangles, colour: tuple[float, float, float], place: Matrix) -> bpy.types.Object:
    made = add_mesh(name, mesh)
    made.matrix_world = place
    made.data.materials.append(diffuse(name, colour))
    return made


def looking(place: tuple[float, float, float], target: tuple[float, float, float]) -> Matrix:
    turn = (Vector(target) - Vector(place)).to_track_quat("-Z", "Y")
    return Matrix.Translation(place) @ turn.to_matrix().to_4x4()


def lamp(kind: str, place: tuple[float, float, float], target: tuple[float, float, float], **options: object) -> None:
    light = bpy.data.lights.new(kind.title(), kind)
    for name, value in options.items():
        setattr(light, name, value)
    add(kind.title(), light).matrix_world = looking(place, target)


def add_lit_scene(scene: bpy.types.Scene) -> None:
    painted("Floor", box((-6, -6, -1), (6, 6, 0)), (0.6, 0.6, 0.55), Matrix())
    for row, (x, y, colour) in enumerate(BALLS):
        ball = painted(f"Ball {row}", icosphere(3, 0.8), colour, Matrix.Translation((x, y, 0.8)))
        ball.data.shade_smooth()
    turned = Matrix.Translation((-0.2, 2.6, 0.7)) @ Matrix.Rotation(0.5, 4, "Z")
    painted("Box", box((-0.7,) * 3, (0.7,) * 3), (0.8, 0.75, 0.3), turned)
    lamp("AREA", (-3, -3, 5), (0, 0, 0.5), energy=220, shape="RECTANGLE", size=1.6, size_y=0.8, color=(1, 0.9, 0.8))
    lamp("SUN", (0, 0, 5), (-1.5, 2.0, 3.2), energy=1.0, angle=0.08)
    lamp("POINT", (3.5, -1.5, 2.2), (0, 0, 0), energy=60, shadow_soft_size=0.25, color=(0.7, 0.8, 1))
    lamp("SPOT", (1.5, 4, 4), (0.2, 1, 0), energy=300, spot_size=0.9, spot_blend=0.4, shadow_soft_size=0.15)
    world = scene.world = bpy.data.worlds.new("World")
    if not world.node_tree:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.08, 0.09, 0.1, 1)
    camera = add("Camera", bpy.data.cameras.new("Camera"))
    camera.matrix_world = looking((1.2, -8.5, 4.2), (0.1, 0.2, 0.5))
    scene.camera = camera
