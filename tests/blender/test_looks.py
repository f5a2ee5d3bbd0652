"""Materials, normals, lights, flags and the world of a Blender scene as the export gives them."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from addon.blender.export import scene_data
from addon.blender.scene_file import rendered_scene
from addon.pipeline.looks import Reading
from addon.pipeline.scene import ELLIPSE, HIDDEN, HOLDOUT, NO_SHADOW, RECTANGLE, SceneData
from addon.pipeline.settings import Settings
from tests.blender.scenes import add, add_camera, add_light, add_mesh, depsgraph
from tests.meshes import icosphere


def exported(reading: Reading | None = None) -> SceneData:
    return scene_data(depsgraph(), 64, 48, reading=reading)


def material(name: str, shader: str | None = None, **inputs: object) -> bpy.types.Material:
    """Of one shader node, or of none."""
    made = bpy.data.materials.new(name)
    if shader:
        if not made.node_tree:
            made.use_nodes = True
        tree = made.node_tree
        tree.nodes.clear()
        node, output = tree.nodes.new(f"ShaderNode{shader}"), tree.nodes.new("ShaderNodeOutputMaterial")
        for label, value in inputs.items():
            node.inputs[label.replace("_", " ")].default_value = value
        tree.links.new(node.outputs[0], output.inputs["Surface"])
    return made


def link(made: bpy.types.Material, kind: str, label: str, value: tuple[float, ...] | None = None) -> None:
    """Drive an input by another node, through a reroute."""
    tree = made.node_tree
    source, reroute = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("NodeReroute")
    if value:
        source.outputs[0].default_value = value
    tree.links.new(source.outputs[0], reroute.inputs[0])
    shader = next(node for node in tree.nodes if label in node.inputs)
    tree.links.new(reroute.outputs[0], shader.inputs[label])


def surface_of(made: bpy.types.Material) -> tuple[list[float], list[float], SceneData]:
    owner = add_mesh("Cube")
    owner.data.materials.append(made)
    data = exported()
    (row,) = data.surfaces
    return row["base"].tolist(), row["emission"].tolist(), data


@pytest.mark.parametrize(
    ("shader", "inputs", "base", "emission"),
    [
        ("BsdfPrincipled", {"Base_Color": (0.5, 0.25, 0.125, 1)}, [0.5, 0.25, 0.125], [0, 0, 0]),
        (
            "BsdfPrincipled",
            {"Base_Color": (0, 0, 0, 1), "Emission_Color": (1, 0.5, 0, 1), "Emission_Strength": 4.0},
            [0, 0, 0],
            [4, 2, 0],
        ),
        ("BsdfDiffuse", {"Color": (0.5, 0.5, 1, 1)}, [0.5, 0.5, 1], [0, 0, 0]),
        ("Emission", {"Color": (0.5, 1, 0, 1), "Strength": 2.0}, [0, 0, 0], [1, 2, 0]),
    ],
)
def test_a_shader_of_constants(scene, shader, inputs, base, emission):
    found = surface_of(material("M", shader, **inputs))
    assert found[:2] == (base, emission) and found[2].skipped == ()


def test_a_texture_is_named_and_the_viewport_colour_stands_for_it(scene):
    made = material("Wood", "BsdfPrincipled")
    made.diffuse_color = 0.5, 0.25, 0.75, 1
    link(made, "TexNoise", "Base Color")
    base, _, data = surface_of(made)
    assert base == [0.5, 0.25, 0.75]
    assert [line for line in data.skipped if "'Wood'" in line] and len(data.skipped) == 1


def test_a_colour_node_is_a_constant(scene):
    made = material("Paint", "BsdfDiffuse")
    link(made, "RGB", "Color", (0.125, 0.5, 0.25, 1))
    base, _, data = surface_of(made)
    assert base == [0.125, 0.5, 0.25] and data.skipped == ()


def test_slots_faces_and_objects_with_materials_of_their_own(scene):
    red, green = (
        material("Red", "BsdfDiffuse", Color=(1, 0, 0, 1)),
        material("Green", "BsdfDiffuse", Color=(0, 1, 0, 1)),
    )
    red.pass_index, green.pass_index = 3, 4
    owner = add_mesh("Cube")
    owner.pass_index = 7
    for made in (red, green):
        owner.data.materials.append(made)
    for face, polygon in enumerate(owner.data.polygons):
        polygon.material_index = (0, 1, 9)[face % 3]
    other = add("Other", owner.data)
    other.material_slots[0].link = "OBJECT"
    other.material_slots[0].material = green
    data = exported()
    (mesh,) = data.meshes
    expected = [
        min(owner.data.polygons[triangle.polygon_index].material_index, 1) for triangle in owner.data.loop_triangles
    ]
    assert mesh.materials.tolist() == expected and mesh.materials.dtype == np.int32
    first = {int(row["index"]): int(row["first_surface"]) for row in data.objects}
    assert data.surfaces["index"][[first[7], first[7] + 1, first[0], first[0] + 1]].tolist() == [3, 4, 4, 4]
    assert exported(Reading(materials=False)).meshes[0].materials is None


@pytest.mark.parametrize("smooth", ["all", "some", "none"])
def test_corner_normals_are_blenders(scene, smooth):
    owner = add_mesh("Ball", icosphere(1))
    for face, polygon in enumerate(owner.data.polygons):
        polygon.use_smooth = smooth == "all" or (smooth == "some" and face % 2 == 0)
    (mesh,) = exported().meshes
    if smooth == "none":
        assert mesh.corner_normals is None
        return
    corners = [[owner.data.corner_normals[loop].vector[:] for loop in t.loops] for t in owner.data.loop_triangles]
    assert mesh.corner_normals.dtype == np.float32
    np.testing.assert_array_equal(mesh.corner_normals, np.array(corners, np.float32))
    assert exported(Reading(normals=False)).meshes[0].corner_normals is None


def test_only_what_the_passes_show_is_read():
    for passes, normals, materials in (
        (("combined",), True, True),
        (("normal", "depth"), True, False),
        (("material_index",), False, True),
        (("depth", "cost", "instance"), False, False),
    ):
        assert Reading.of(Settings(), passes) == Reading(normals, materials)
    assert Reading.of(Settings(smooth=False), ("combined",)) == Reading(normals=False)


def test_lights_have_their_size(scene):
    made = [add_light(kind) for kind in ("SUN", "POINT", "AREA", "AREA")]
    sun, point, square, disk = (light.data for light in made)
    sun.angle, point.shadow_soft_size, point.use_shadow = 0.25, 0.5, False
    square.shape, square.size = "SQUARE", 2
    disk.shape, disk.size, disk.size_y = "ELLIPSE", 2, 3
    made[3].scale = (2, 0.5, 7)
    rows = exported().lights
    assert rows["kind"].tolist()[2:] == [RECTANGLE, ELLIPSE]
    np.testing.assert_allclose(rows["size"], [(0.25, 0), (0.5, 0), (2, 2), (4, 1.5)], rtol=1e-6)
    assert rows["shadowless"].tolist() == [False, True, False, False]


def test_flags_of_objects_and_of_what_instances_them(scene):
    collection = bpy.data.collections.new("Inner")
    inner = add("Inner", add_mesh("Outside").data, collection)
    inner.visible_shadow = False
    instancer = add("Instancer", None)
    instancer.instance_type, instancer.instance_collection, instancer.visible_camera = "COLLECTION", collection, False
    bpy.data.objects["Outside"].is_holdout = True
    flags = sorted(exported().objects["flags"].tolist())
    assert flags == sorted([HOLDOUT, HIDDEN | NO_SHADOW])


def test_a_collection_that_is_held_out(scene):
    add_camera()
    collection = bpy.data.collections.new("Held out")
    scene.collection.children.link(collection)
    add("Cube", add_mesh("Other").data, collection)
    scene.view_layers[0].layer_collection.children["Held out"].holdout = True
    data, _ = rendered_scene(scene, 16, 16)
    assert sorted(data.objects["flags"].tolist()) == [0, HOLDOUT]


def test_the_world(scene):
    scene.world = None
    assert exported().world is None
    world = scene.world = bpy.data.worlds.new("Sky")
    if not world.node_tree:
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (0.5, 0.25, 1, 1), 2.0
    assert exported().world == (1, 0.5, 2) and exported().skipped == ()
    sky = world.node_tree.nodes.new("ShaderNodeTexGradient")
    world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])
    world.color = 0.125, 0.25, 0.5
    data = exported()
    assert data.world == (0.125, 0.25, 0.5) and [line for line in data.skipped if "'Sky'" in line]
    assert not data.film_transparent
    scene.render.film_transparent = True
    assert exported().film_transparent
