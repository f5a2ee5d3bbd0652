"""Pictures of scenes: those of the flattened mesh, in every pass; looks by instance and by tree."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.instances import anywhere, flattened, moved
from tests.native.views import clip_to_world, look_at, perspective

SHOWN = (meshes.icosphere(2), meshes.box())
ROWS = np.array([0, 1, 0, 0, 1])
PASSES = ("combined", "depth", "normal", "position", "triangle", "instance", "object_index", "material_index")


def above(mesh, width, height):
    """A camera above the middle of a mesh, a little aside, that sees all of it."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle, size = (low + high) / 2, np.linalg.norm(high - low)
    eye = middle + size * np.array([0.1, -0.2, 1.2])
    lens = perspective(0.05 * size * width / height, 0.05 * size, 0.1 * size, 4 * size)
    return bihtree.Camera(clip_to_world(look_at(eye, middle, (0, 1, 0)), lens), width, height)


@pytest.fixture(scope="module")
def pictured():
    matrices = anywhere(len(ROWS), np.random.default_rng(4), 1.5)
    shown = [SHOWN[row] for row in ROWS]
    world = flattened(shown, matrices)
    scene = bihtree.Scene([bihtree.Tree(*mesh) for mesh in SHOWN], ROWS, matrices)
    return scene, shown, world, above(world, 40, 30)


def test_every_pass_is_that_of_the_flattened_mesh(pictured):
    scene, shown, world, camera = pictured
    lights = np.zeros(1, [("kind", "u1"), ("position", "f8", 3), ("direction", "f8", 3), ("colour", "f4", 3)])
    lights["direction"], lights["colour"] = (0.3, 0.2, -1), 3
    counts = [len(mesh.triangles) for mesh in shown]
    starts = np.cumsum([0, *counts[:-1]])
    objects = np.zeros(len(ROWS), [("first_triangle", "i8"), ("index", "i4"), ("flags", "u1"), ("first_surface", "i4")])
    objects["first_triangle"], objects["index"], objects["first_surface"] = starts, np.arange(5) + 3, [0, 1, 1, 0, 0]
    surfaces = np.zeros(2, [("base", "f4", 3), ("index", "i4")])
    surfaces["base"], surfaces["index"] = [[1, 0, 0], [0, 1, 0]], [7, 8]
    given = {"passes": PASSES, "samples": 2, "lights": lights, "surfaces": surfaces, "ambient_occlusion": True}
    flat = bihtree.render(bihtree.Tree(*world), camera, objects=objects, **given)
    own = objects[["index", "flags", "first_surface"]]
    made = bihtree.render(scene, camera, objects=own, **given)
    rows = made["triangle"] + starts[np.maximum(made["instance"], 0)]
    made["triangle"] = np.where(made["triangle"] < 0, -1, rows).astype(np.int32)
    for name in PASSES:
        assert made[name].tobytes() == flat[name].tobytes(), name
    assert len(set(made["instance"].ravel().tolist())) > 3
    assert set(made["material_index"].ravel().tolist()) == {0, 7, 8}


def test_holdouts_and_objects_that_rays_pass_through(pictured):
    scene, _, _, camera = pictured
    seen = bihtree.render(scene, camera, passes=("instance",))["instance"]
    first = np.bincount(seen[seen >= 0]).argmax()
    objects = np.zeros(len(ROWS), [("flags", "u1")])
    objects["flags"][first] = 1
    passes = bihtree.render(scene, camera, passes=("instance", "combined"), objects=objects)
    assert first not in passes["instance"]
    objects["flags"][first] = 4
    passes = bihtree.render(scene, camera, passes=("instance", "combined"), objects=objects)
    assert np.array_equal(passes["instance"], seen)
    assert (passes["combined"][passes["instance"][..., 0] == first] == 0).all()


def test_corner_normals_are_turned_with_their_instance():
    """A plate whose corners all say +x: through a matrix its normals are those of the image."""
    plate = meshes.grid(1, 1)
    matrix = moved([[0, -1, 0], [1, 0, 0], [0, 0, 2]])
    scene = bihtree.Scene([bihtree.Tree(*plate)], [0], [matrix])
    camera = above(flattened([plate], matrix[None]), 9, 9)
    normals = np.tile(np.float32([0.6, 0, 0.8]), (2, 3, 1))
    found = bihtree.render(scene, camera, passes=("normal", "triangle"), corner_normals=[normals])
    hit = found["triangle"][..., 0] >= 0
    expected = np.array([0, 1.2, 0.8]) / np.hypot(1.2, 0.8)
    assert hit.any() and np.allclose(found["normal"][hit], expected, atol=1e-6)
    flat = bihtree.render(scene, camera, passes=("normal",), corner_normals=[None])["normal"]
    assert np.allclose(flat[hit], [0, 0, 1])


def test_materials_are_by_tree(pictured):
    scene, _, _, camera = pictured
    surfaces = np.zeros(3, [("base", "f4", 3), ("index", "i4")])
    surfaces["index"] = [1, 2, 3]
    slots = (np.arange(len(SHOWN[0].triangles)) % 3).astype(np.int32)
    given = {"surfaces": surfaces, "materials": [slots, None]}
    found = bihtree.render(scene, camera, passes=("material_index", "triangle", "instance"), **given)
    sphere = np.isin(found["instance"], np.flatnonzero(ROWS == 0))
    assert np.array_equal(found["material_index"][sphere], slots[found["triangle"][sphere]] + 1)
    assert (found["material_index"][~sphere & (found["instance"] >= 0)] == 1).all()
    with pytest.raises(bihtree.GeometryError, match="materials: triangle 1 of object 0 has slot 1"):
        bihtree.render(scene, camera, surfaces=surfaces[:1], materials=[slots, None])


@pytest.mark.parametrize(
    ("given", "error", "text"),
    [
        ({"objects": np.zeros(2, [("flags", "u1")])}, bihtree.GeometryError, "objects: 2 rows, but there are 5 inst"),
        ({"materials": [None]}, bihtree.GeometryError, "materials: 1 items; a scene of 2 trees has one for each"),
        ({"corner_normals": 3}, bihtree.GeometryError, "corner_normals: not a sequence"),
        ({"materials": [np.zeros(4, np.int32), None]}, bihtree.GeometryError, r"materials: expected \(320,\) int32"),
    ],
)
def test_what_does_not_fit_a_scene_is_named(pictured, given, error, text):
    scene, _, _, camera = pictured
    with pytest.raises(error, match=text):
        bihtree.render(scene, camera, **given)


def test_what_is_neither_a_tree_nor_a_scene():
    with pytest.raises(TypeError, match="scene: int is neither"):
        bihtree.render(3, bihtree.Camera(np.eye(4), 2, 2))


def test_the_same_bits_in_tiles_and_for_any_number_of_threads(pictured):
    scene, shown, _, camera = pictured
    whole = bihtree.render(scene, camera, passes=("combined", "depth", "cost"), samples=2)
    tile = bihtree.render(scene, camera, passes=("combined", "depth", "cost"), samples=2, tile=(8, 16, 20, 10))
    for name, part in tile.items():
        assert part.tobytes() == np.ascontiguousarray(whole[name][16:26, 8:28]).tobytes()
    assert whole["cost"].max() > 1 and len(shown) == 5
