"""The export against slow ways to learn the same thing: Python loops over Blender's own objects."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from addon.blender.camera import camera_view
from addon.blender.export import scene_data
from addon.blender.scene_file import rendered_scene
from addon.pipeline.errors import UserError
from addon.pipeline.scene import POINT, SPOT, SUN, SceneData
from tests.blender.scenes import add, add_camera, add_light, add_mesh, depsgraph, geometry_nodes
from tests.meshes import icosphere


def exported() -> SceneData:
    return scene_data(depsgraph(), 64, 48)


def corners_of(data: SceneData) -> NDArray[np.floating]:
    vertices, triangles = data.flatten()
    return vertices[triangles]


def slow_corners(owner: bpy.types.Object, matrix: Matrix | None = None) -> NDArray[np.float64]:
    """World-space triangles (T, 3, 3) of one object, a vertex at a time."""
    evaluated = owner.evaluated_get(depsgraph())
    mesh = evaluated.to_mesh()
    world = matrix or evaluated.matrix_world
    corners = [[world @ mesh.vertices[row].co for row in triangle.vertices] for triangle in mesh.loop_triangles]
    evaluated.to_mesh_clear()
    return np.array(corners, np.float64).reshape(-1, 3, 3)


def same_triangles(left: NDArray[np.floating], right: NDArray[np.floating]) -> None:
    """The same triangles in any order."""
    assert left.shape == right.shape
    a, b = (side.reshape(-1, 9) for side in (left, right))
    # rounding must not change the order of rows, so order by rounded sums of irrational weights
    weights = np.sqrt([2, 3, 5, 7, 11, 13, 17, 19, 23])
    a, b = (side[np.argsort(side @ weights)] for side in (a, b))
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-5)


def add_curve() -> bpy.types.Object:
    data = bpy.data.curves.new("Curve", "CURVE")
    data.dimensions, data.bevel_depth = "3D", 0.1
    spline = data.splines.new("NURBS")
    spline.points.add(3)
    for row, point in enumerate(spline.points):
        point.co = (row, row * row, 0.5 * row, 1)
    return add("Curve", data)


def add_text() -> bpy.types.Object:
    data = bpy.data.curves.new("Text", "FONT")
    data.body, data.extrude = "Bih", 0.1
    return add("Text", data)


def add_surface() -> bpy.types.Object:
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    return bpy.context.object


def add_metaball() -> bpy.types.Object:
    data = bpy.data.metaballs.new("Meta")
    data.elements.new()
    data.elements.new().co = (1.5, 0, 0)
    return add("Meta", data)


def add_array() -> bpy.types.Object:
    made = add_mesh("Array", icosphere(1))
    made.modifiers.new("Array", "ARRAY").count = 3
    return made


def add_mirrored() -> bpy.types.Object:
    made = add_mesh("Mirrored", icosphere(1))
    made.scale = (-1, 2, 0.5)
    return made


def add_child() -> bpy.types.Object:
    parent = add("Parent", None)
    parent.location, parent.rotation_euler, parent.scale = (1, 2, 3), (0.1, 0.2, 0.3), (1, 3, 1)
    made = add_mesh("Child")
    made.parent, made.rotation_euler = parent, (0.5, 0, 0)
    return made


def add_quads_and_ngons() -> bpy.types.Object:
    data = bpy.data.meshes.new("Polygons")
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (3, 1, 0), (2, 0.4, 0), (1.5, 2, 0)]
    data.from_pydata(vertices, [], [(0, 1, 2, 3), (1, 4, 5, 6, 7)])
    return add("Polygons", data)


MAKERS = [
    add_array, add_mirrored, add_child, add_quads_and_ngons, add_curve, add_text, add_surface, add_metaball,
]  # fmt: skip


@pytest.mark.parametrize("make", MAKERS)
def test_world_triangles_of_every_kind_of_object(scene, make):
    expected = slow_corners(make())
    assert len(expected) > 2
    same_triangles(corners_of(exported()), expected)


def test_a_scene_is_the_sum_of_its_objects(scene):
    owners = [make() for make in MAKERS]
    same_triangles(corners_of(exported()), np.concatenate([slow_corners(owner) for owner in owners]))


def test_arrays_are_blenders_own(scene):
    owner = add_mesh("Ball", icosphere(2))
    data = exported()
    (mesh,) = data.meshes
    assert mesh.name == "Ball"
    assert mesh.vertices.dtype == np.float32 and mesh.triangles.dtype == np.int32
    assert mesh.vertices.tolist() == [list(vertex.co) for vertex in owner.data.vertices]
    assert mesh.triangles.tolist() == [list(triangle.vertices) for triangle in owner.data.loop_triangles]


def test_nested_collection_instances(scene):
    inner, outer = bpy.data.collections.new("Inner"), bpy.data.collections.new("Outer")
    inner.instance_offset = (0.5, 0, 0)
    data = add_mesh("Cube").data
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    cube = add("Cube", data, inner)
    cube.location, cube.scale = (0, 1, 0), (1, 1, -2)
    middle = add("Middle", None, outer)
    middle.instance_type, middle.instance_collection, middle.rotation_euler = "COLLECTION", inner, (0, 0, 0.7)
    expected = []
    for row in range(3):
        instancer = add(f"Instancer {row}", None)
        instancer.instance_type, instancer.instance_collection = "COLLECTION", outer
        instancer.location, instancer.scale = (3 * row, 0, 0), (1, 1 + row, 1)
        place = (
            Matrix.Translation((3 * row, 0, 0)) @ Matrix.Diagonal((1, 1 + row, 1, 1))
            @ Matrix.Rotation(0.7, 4, "Z") @ Matrix.Translation((-0.5, 0, 0))
            @ Matrix.Translation((0, 1, 0)) @ Matrix.Diagonal((1, 1, -2, 1))
        )  # fmt: skip
        expected += [[place @ data.vertices[v].co for v in triangle.vertices] for triangle in data.loop_triangles]
    shown = exported()
    assert len(shown.meshes) == 1 and shown.instance_mesh.tolist() == [0, 0, 0]
    same_triangles(corners_of(shown), np.array(expected, np.float64))


@pytest.mark.parametrize("keep", [False, True])
def test_geometry_nodes_instances(scene, keep):
    owner = add_mesh("Points", icosphere(0))
    owner.scale = (2, 2, 2)
    geometry_nodes(owner, keep=keep)
    data = exported()
    assert len(data.meshes) == 1 + keep
    lower, upper = corners_of(data).min(axis=(0, 1)), corners_of(data).max(axis=(0, 1))
    centres = 2 * icosphere(0).vertices.astype(np.float64)
    np.testing.assert_allclose([lower, upper], [centres.min(axis=0) - 0.5, centres.max(axis=0) + 0.5], atol=1e-5)
    cubes = [row for row, mesh in enumerate(data.instance_mesh) if len(data.meshes[mesh].triangles) == 12]
    middles = np.array([data.instance_matrix[row][:3, 3] for row in cubes])
    distance = np.linalg.norm(middles[:, None] - centres[None], axis=2)
    assert len(cubes) == len(centres)
    assert sorted(distance.argmin(axis=1)) == list(range(len(centres)))
    assert distance.min(axis=1).max() < 1e-5


def test_geometry_nodes_on_a_curve_are_not_counted_twice(scene):
    owner = add_curve()
    owner.data.bevel_depth = 0
    geometry_nodes(owner, keep=False)
    assert {len(mesh.triangles) for mesh in exported().meshes} == {12}


def test_objects_of_one_mesh_share_it_unless_a_modifier_parts_them(scene):
    first = add_mesh("First")
    for name in ("Second", "Third"):
        add(name, first.data).location = (3, 0, 0)
    assert (len(exported().meshes), len(exported().instance_mesh)) == (1, 3)
    bpy.data.objects["Second"].modifiers.new("Triangulate", "SUBSURF").levels = 1
    assert (len(exported().meshes), len(exported().instance_mesh)) == (2, 3)
    expected = np.concatenate([slow_corners(owner) for owner in scene.objects])
    same_triangles(corners_of(exported()), expected)


def test_a_render_decides_what_is_shown(scene):
    """Renders and the viewport have each their own visibility, modifiers and levels; the file is read as a render."""
    add_camera()
    add_mesh("Not in renders").hide_render = True
    add_mesh("Not in the viewport").hide_viewport = True
    smooth = add_mesh("Smooth", icosphere(0))
    modifier = smooth.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 2
    other = add_mesh("Modifier only in the viewport")
    other.modifiers.new("Array", "ARRAY").show_render = False
    excluded = bpy.data.collections.new("Excluded")
    scene.collection.children.link(excluded)
    add("Child", other.data, excluded)
    excluded.hide_render = True
    data, seconds = rendered_scene(scene, 64, 48)
    counts = {mesh.name: len(mesh.triangles) for mesh in data.meshes}
    # a triangle becomes 3 quads, then each 4, two triangles each
    assert counts == {"Not in the viewport": 12, "Smooth": 20 * 3 * 4 * 2, "Modifier only in the viewport": 12}
    assert len(data.instance_mesh) == 3
    assert seconds > 0


def test_only_the_first_view_layer_is_read_and_that_is_said(scene):
    add_camera()
    add_mesh("Cube")
    scene.view_layers.new("Second")
    data, _ = rendered_scene(scene, 64, 48)
    assert data.triangle_count == 12 and [line for line in data.skipped if "'Second'" in line]
    for layer in scene.view_layers:
        layer.use = False
    data, _ = rendered_scene(scene, 64, 48)
    assert data.triangle_count == 12 and data.skipped == ()


def test_a_scene_that_makes_tiny_films(scene):
    add_camera()
    add_mesh("Cube")
    output = scene.render.image_settings
    if hasattr(output, "media_type"):
        output.media_type = "VIDEO"
    output.file_format = "FFMPEG"
    scene.render.resolution_x = scene.render.resolution_y = 8
    assert rendered_scene(scene, 1, 1)[0].camera.width == 1


def test_an_instancer_that_hides_itself(scene):
    add_camera()
    parent, child = add_mesh("Parent", icosphere(0)), add_mesh("Child")
    child.parent, parent.instance_type = parent, "VERTS"
    parent.show_instancer_for_render = False
    data, _ = rendered_scene(scene, 64, 48)
    assert [mesh.name for mesh in data.meshes] == ["Child"]
    assert len(data.instance_mesh) == len(parent.data.vertices)
    parent.show_instancer_for_render = True
    data, _ = rendered_scene(scene, 64, 48)
    assert sorted(mesh.name for mesh in data.meshes) == ["Child", "Parent"]


def test_what_has_no_triangles_is_named(scene):
    grease = getattr(bpy.data, "grease_pencils_v3", bpy.data.grease_pencils)
    for name, data in {
        "Smoke": bpy.data.volumes.new("v"),
        "Hair": bpy.data.hair_curves.new("h"),
        "Points": bpy.data.pointclouds.new("p"),
        "Pencil": grease.new("g"),
        "Wire": bpy.data.meshes.new("w"),
    }.items():
        add(name, data)
    bpy.data.meshes["w"].from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    add("Empty", None)
    furry = add_mesh("Furry")
    furry.modifiers.new("Fur", "PARTICLE_SYSTEM")
    furry.particle_systems[0].settings.type = "HAIR"
    data = exported()
    assert len(data.instance_mesh) == 1
    assert {line.split("'")[1] for line in data.skipped} == {"Smoke", "Hair", "Points", "Pencil", "Wire", "Furry"}


def test_lights(scene):
    sun, point, _ = (add_light(kind, energy=energy) for kind, energy in (("SUN", 3), ("POINT", 80), ("SPOT", 20)))
    sun.rotation_euler, sun.data.color = (np.pi / 2, 0, 0), (1, 0.5, 0.25)
    point.location = (1, 2, 3)
    point.scale = (2, 2, 2)
    data = exported()
    rows = {("sun", "point", "spot")[row]: light for row, light in enumerate(data.lights)}
    assert [rows[name]["kind"] for name in ("sun", "point", "spot")] == [SUN, POINT, SPOT]
    # a sun shines along its -Z, which a quarter turn about X takes to +Y
    np.testing.assert_allclose(rows["sun"]["direction"], (0, 1, 0), atol=1e-6)
    np.testing.assert_allclose(rows["sun"]["colour"], (3, 1.5, 0.75))
    np.testing.assert_allclose(rows["point"]["position"], (1, 2, 3))
    np.testing.assert_allclose(rows["point"]["colour"], (80, 80, 80))
    np.testing.assert_allclose(rows["spot"]["spot"], (np.pi / 4, 0.15), rtol=1e-6)
    assert data.skipped == ()


def test_a_vertex_that_is_not_finite_is_named(scene):
    owner = add_mesh("Broken")
    owner.data.vertices[5].co.y = float("nan")
    with pytest.raises(UserError, match="'Broken': vertex 5"):
        exported().meshes[0].check_finite()


def test_a_transform_that_is_not_finite_is_named(scene):
    """And the rest is there all the same."""
    parent = add("Parent", None)
    lost, lamp = add_mesh("Lost"), add_light("POINT")
    add_mesh("There")
    for owner in (lost, lamp):
        owner.parent = parent
        owner.matrix_parent_inverse[0][3] = float("nan")
    data = exported()
    assert [mesh.name for mesh in data.meshes] == ["There"] and len(data.lights) == 0
    assert sorted(note.split("'")[1] for note in data.skipped) == ["Lost", "Point"]


CAMERAS = {
    "plain": {},
    "long lens": {"lens": 135.0},
    "shift": {"shift_x": 0.3, "shift_y": -0.2},
    "vertical fit": {"sensor_fit": "VERTICAL", "sensor_height": 20.0},
    "horizontal fit": {"sensor_fit": "HORIZONTAL", "sensor_width": 20.0},
    "orthographic": {"type": "ORTHO", "ortho_scale": 7.0, "shift_x": 0.1},
    "clip": {"clip_start": 2.0, "clip_end": 20.0},
}


@pytest.mark.parametrize("size", [(64, 48), (30, 90)])
@pytest.mark.parametrize("aspect", [(1.0, 1.0), (2.0, 1.0), (1.0, 1.5)])
@pytest.mark.parametrize("options", CAMERAS.values(), ids=CAMERAS)
def test_pixels_are_where_blender_sees_them(scene, options, aspect, size):
    """world_to_camera_view goes by the camera's frame, not by its matrix."""
    camera = add_camera()
    camera.scale = (1.0, -2.0, 0.5)
    for name, value in options.items():
        setattr(camera.data, name, value)
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    graph = depsgraph()
    view = camera_view(graph.scene_eval.camera, graph, *size)
    points = np.random.default_rng(1).uniform(-1, 1, (20, 3))
    seen = np.array([world_to_camera_view(scene, camera, Vector(point)) for point in points])
    np.testing.assert_allclose(view.project(points)[:, :2], seen[:, :2] * size, atol=2e-3)
    assert view.near == pytest.approx(camera.data.clip_start, rel=1e-3, abs=1e-4)
    assert view.perspective == (camera.data.type == "PERSP")


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_rays_hit_what_blender_hits(scene, kind):
    """A ray through a pixel's middle, cast by Blender, meets the surface at a point that Blender sees in that pixel."""
    camera = add_camera()
    camera.data.type = kind
    add_mesh("Ball", icosphere(3))
    width, height = scene.render.resolution_x, scene.render.resolution_y = 32, 24
    graph = depsgraph()
    view = camera_view(graph.scene_eval.camera, graph, width, height)
    hits = 0
    for x in range(width):
        for y in range(height):
            ndc = (np.array([x, y]) + 0.5) / (width, height) * 2 - 1
            near, far = (view.clip_to_world @ (*ndc, z, 1.0) for z in (-1.0, 1.0))
            near, far = near[:3] / near[3], far[:3] / far[3]
            hit, place, *_ = scene.ray_cast(graph, near, far - near)
            if hit:
                hits += 1
                seen = world_to_camera_view(scene, camera, place)
                np.testing.assert_allclose([seen.x * width, seen.y * height], [x + 0.5, y + 0.5], atol=1e-3)
    assert 50 < hits < width * height


def test_a_panoramic_camera_is_refused(scene):
    add_camera().data.type = "PANO"
    with pytest.raises(UserError, match="panoramic"):
        exported()


def test_a_camera_without_size_is_refused(scene):
    add_camera().scale = (1, 0, 1)
    with pytest.raises(UserError, match="'Camera'"):
        exported()
