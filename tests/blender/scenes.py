"""Objects for tests, each linked to the context's scene."""

from __future__ import annotations

import bpy
from mathutils import Matrix, Vector

from tests.meshes import Triangles, box


def add(name: str, data: bpy.types.ID | None, collection: bpy.types.Collection | None = None) -> bpy.types.Object:
    made = bpy.data.objects.new(name, data)
    (collection or bpy.context.scene.collection).objects.link(made)
    return made


def add_mesh(name: str, mesh: Triangles | None = None) -> bpy.types.Object:
    """An object with the given triangles, or with a unit cube."""
    vertices, triangles = mesh or box()
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices.tolist(), [], triangles.tolist())
    return add(name, data)


def add_camera(place: tuple[float, float, float] = (4.0, -5.0, 3.0)) -> bpy.types.Object:
    """The scene's camera, looking at the origin."""
    camera = add("Camera", bpy.data.cameras.new("Camera"))
    turn = (-Vector(place)).to_track_quat("-Z", "Y")
    camera.matrix_world = Matrix.Translation(place) @ turn.to_matrix().to_4x4()
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()
    return camera


def add_light(kind: str, place: tuple[float, float, float] = (0.0, 0.0, 5.0), energy: float = 3.0) -> bpy.types.Object:
    light = bpy.data.lights.new(kind.title(), kind)
    light.energy = energy
    made = add(kind.title(), light)
    made.location = place
    return made


def depsgraph() -> bpy.types.Depsgraph:
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def geometry_nodes(owner: bpy.types.Object, *, keep: bool) -> None:
    """A modifier that puts a cube of size 0.5 at each point of the object; `keep` its own geometry too."""
    group = bpy.data.node_groups.new("Cubes", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes = group.nodes
    source, sink = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    cube, points = nodes.new("GeometryNodeMeshCube"), nodes.new("GeometryNodeInstanceOnPoints")
    join = nodes.new("GeometryNodeJoinGeometry")
    cube.inputs["Size"].default_value = (0.5, 0.5, 0.5)
    group.links.new(source.outputs[0], points.inputs["Points"])
    group.links.new(cube.outputs[0], points.inputs["Instance"])
    group.links.new(points.outputs[0], join.inputs[0])
    if keep:
        group.links.new(source.outputs[0], join.inputs[0])
    group.links.new(join.outputs[0], sink.inputs[0])
    owner.modifiers.new("Cubes", "NODES").node_group = group
