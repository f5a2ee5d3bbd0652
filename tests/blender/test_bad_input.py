"""What is broken in a scene is named by its object, and the rest is rendered."""

from __future__ import annotations

from pathlib import Path

import bihtree
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon.blender import export, final_render
from addon.blender.compat import modifier_errors
from addon.blender.export import contents
from addon.blender.final_render import Progress
from addon.pipeline.scene import SceneData
from tests.blender.scenes import add, add_camera, add_mesh, depsgraph, geometry_nodes
from tests.meshes import Triangles, icosphere


@pytest.fixture
def picture(registered: bpy.types.Scene) -> bpy.types.Scene:
    """A ball that is as it should be, before the camera; whatever is added must not keep it from being seen."""
    add_mesh("Good", icosphere(2))
    add_camera()
    registered.render.engine = "BIH_PREVIEW"
    registered.render.resolution_x, registered.render.resolution_y = 32, 24
    registered.bih.passes = {"combined"}
    return registered


def noted(name: str) -> str:
    """What is said of the object; the ball is exported all the same, and F12 ends well."""
    data = contents(depsgraph())
    assert "Good" in {mesh.name for mesh in data.meshes}
    assert bpy.ops.render.render() == {"FINISHED"}
    return "; ".join(note for note in data.skipped if f"'{name}'" in note)


def test_a_driver_that_fails(picture):
    curve = add_mesh("Driven").driver_add("location", 0)
    curve.driver.expression = "nonsense + 1"
    assert "driver of location fails" in noted("Driven")


def test_a_mesh_without_faces(picture):
    points = Triangles(np.zeros((3, 3), np.float32), np.zeros((0, 3), np.int32))
    add_mesh("Points", points)
    assert "has no faces" in noted("Points")


def test_a_modifier_that_leaves_nothing(picture):
    owner = add_mesh("Masked")
    owner.modifiers.new("Mask", "MASK").vertex_group = owner.vertex_groups.new(name="Empty").name
    assert "has no faces" in noted("Masked")


def test_a_modifier_that_says_why_it_fails():
    """Blender 5.0 was the first whose modifiers do."""

    class Warning:
        def __init__(self, kind: str, message: str) -> None:
            self.type, self.message = kind, message

    class Modifier:
        node_warnings = (Warning("ERROR", "no such file"), Warning("INFO", "nothing to do"))

    assert modifier_errors(Modifier()) == ["no such file"]
    assert modifier_errors(object()) == []


def test_a_transform_that_is_not_finite(picture):
    lost = add_mesh("Lost")
    lost.parent = add("Parent", None)
    lost.matrix_parent_inverse[0][3] = float("inf")
    assert "is left out: its location, rotation or scale is NaN or infinite" in noted("Lost")


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-2, -2, -2), (0, 1, 1), (0, 0, 0)])
def test_negative_and_zero_scales(picture, scale):
    add_mesh("Scaled").scale = scale
    assert noted("Scaled") == ""


def test_a_sheared_object(picture):
    owner = add_mesh("Sheared")
    owner.parent = add("Parent", None)
    owner.matrix_parent_inverse = Matrix.Shear("XY", 4, (1e3, -1e3))
    assert noted("Sheared") == ""


def test_a_library_that_is_gone(picture, tmp_path):
    """Saved beside a file that is then removed: what it held is empty, and named."""
    library, scene = tmp_path / "library.blend", tmp_path / "scene.blend"
    bpy.data.libraries.write(str(library), {add_mesh("Linked")})
    bpy.data.objects.remove(bpy.data.objects["Linked"])
    with bpy.data.libraries.load(str(library), link=True) as (_, into):
        into.objects = ["Linked"]
    picture.collection.objects.link(into.objects[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    library.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    assert "library.blend, which is missing" in noted("Linked")


def test_no_memory_for_one_mesh(picture, monkeypatch):
    real = export.read_mesh

    def read(mesh: bpy.types.Mesh, name: str, *options: object) -> object:
        if name == "Heavy":
            raise MemoryError
        return real(mesh, name, *options)

    add_mesh("Heavy")
    monkeypatch.setattr(export, "read_mesh", read)
    assert "is left out: there is no memory for its mesh" in noted("Heavy")


def test_no_memory_for_the_tree(picture, monkeypatch):
    def full(*_: object, **__: object) -> None:
        raise MemoryError("12 GB were asked for")

    monkeypatch.setattr(final_render.prepared, "prepare", full)
    with pytest.raises(RuntimeError, match=r"Error: out of memory \(12 GB were asked for\)\. Hide"):
        bpy.ops.render.render()


def many(count: int) -> bpy.types.Object:
    """An object that shows a cube at each of `count` points."""
    x = np.arange(count, dtype=np.float32)
    points = np.stack([x % 100, x // 100, 0 * x], axis=1)
    owner = add_mesh("Many", Triangles(points, np.zeros((0, 3), np.int32)))
    geometry_nodes(owner, keep=False)
    return owner


def test_many_instances_are_exported_with_progress(picture):
    many(20_000)
    told: list[float] = []

    def progress(stage: str, share: float) -> None:
        assert stage == "export"
        told.append(share)

    data = contents(depsgraph(), progress=progress)
    assert len(data.instance_mesh) == 20_001 and len(data.meshes) == 2
    assert told == sorted(told) and len(told) >= 4 and told[0] == 0 and told[-1] < 1
    places = data.instance_matrix[data.instance_mesh != [m.name for m in data.meshes].index("Good"), :3, 3]
    assert {tuple(place) for place in places.astype(int).tolist()} == {(i % 100, i // 100, 0) for i in range(20_000)}


def test_an_export_can_be_cancelled(picture):
    many(20_000)
    with pytest.raises(bihtree.Cancelled):
        contents(depsgraph(), progress=lambda stage, share: share < 0.3)


def test_escape_during_the_export_ends_the_render(picture, monkeypatch):
    many(10_000)
    built: list[object] = []
    monkeypatch.setattr(Progress, "__call__", lambda self, stage, share: stage != "export")
    monkeypatch.setattr(final_render.prepared, "prepare", lambda *_, **__: built.append(None))
    assert bpy.ops.render.render() == {"FINISHED"}
    assert not built


def test_an_empty_scene_has_its_matrices(scene):
    data = contents(depsgraph())
    assert isinstance(data, SceneData) and data.instance_matrix.shape == (0, 4, 4)


def test_a_file_that_was_open_is_closed(picture, tmp_path: Path):
    """What F12 keeps of a scene is nothing of Blender's: it outlives the file."""
    data = contents(depsgraph())
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert data.triangle_count == 320 and np.isfinite(data.flatten()[0]).all()


def test_a_mesh_whose_library_is_gone(picture, tmp_path):
    """The object is the file's own; only what it shows is linked."""
    library, scene = tmp_path / "library.blend", tmp_path / "scene.blend"
    bpy.data.libraries.write(str(library), {add_mesh("Linked").data})
    bpy.data.batch_remove([bpy.data.objects["Linked"], bpy.data.meshes["Linked"]])
    with bpy.data.libraries.load(str(library), link=True) as (_, into):
        into.meshes = ["Linked"]
    add("Shows it", into.meshes[0])
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    library.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    assert "library.blend, which is missing" in noted("Shows it")


def resident_pages() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1])


def test_fifty_renders_leave_no_memory_behind(picture):
    """The mesh is another one each time: after 50 renders at most 5 % more than after 5."""
    mesh, after = add_mesh("Heavy", icosphere(5)).data, []
    for number in range(50):
        mesh.vertices[0].co.z += 0.1
        mesh.update()
        assert bpy.ops.render.render() == {"FINISHED"}
        if number + 1 in (5, 50):
            after.append(resident_pages())
    assert after[1] <= 1.05 * after[0]
