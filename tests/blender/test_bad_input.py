"""What is broken in a scene is named by its object, and the rest is rendered."""

from __future__ import annotations

import math
import os
from pathlib import Path

import bihtree
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon.blender import compat, final_render
from addon.blender import export as export_module
from addon.blender.compat import modifier_errors
from addon.blender.export import Export, contents
from addon.blender.final_render import Progress
from addon.blender.instance_matrices import Matrices
from addon.pipeline.errors import UserError
from addon.pipeline.scene import SceneData
from tests.blender.scenes import add, add_camera, add_light, add_mesh, depsgraph, geometry_nodes
from tests.meshes import Triangles, icosphere

COUNT = 1_000_000 if os.environ.get("BIHTREE_STRESS") else 20_000
"""Instances: more than a window reads at once."""


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
    real = export_module.read_mesh

    def read(mesh: bpy.types.Mesh, name: str, *options: object) -> object:
        if name == "Heavy":
            raise MemoryError
        return real(mesh, name, *options)

    add_mesh("Heavy")
    monkeypatch.setattr(export_module, "read_mesh", read)
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
    many(COUNT)
    told: list[float] = []

    def progress(stage: str, share: float) -> None:
        assert stage == "export"
        told.append(share)

    data = contents(depsgraph(), progress=progress)
    assert len(data.instance_mesh) == COUNT + 1 and len(data.meshes) == 2
    assert told == sorted(told) and len(told) >= 4 and told[0] == 0 and told[-1] < 1
    places = data.instance_matrix[data.instance_mesh != [m.name for m in data.meshes].index("Good"), :3, 3]
    assert {tuple(place) for place in places.astype(int).tolist()} == {(i % 100, i // 100, 0) for i in range(COUNT)}


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


def test_an_export_in_parts_is_the_export(picture):
    """As a window reads it between redraws, each time with what Blender gives it anew."""
    many(30_000)
    add_light("SUN")
    whole, export = contents(depsgraph()), Export()
    assert export.is_long(depsgraph())
    shares = []
    while not export.read(depsgraph(), None, seconds=0.0):
        shares.append(export.share)
        assert len(export.boxes(0)) == export.shown_count <= 30_001
    assert len(shares) >= 3 and shares == sorted(set(shares)) and 0 < shares[0] and shares[-1] < 1 == export.share
    parts = export.scene(depsgraph())
    for name in ("instance_mesh", "instance_matrix", "lights", "objects", "surfaces"):
        assert getattr(parts, name).tobytes() == getattr(whole, name).tobytes(), name
    assert len(parts.instance_mesh) == 30_001
    assert [m.vertices.tobytes() for m in parts.meshes] == [m.vertices.tobytes() for m in whole.meshes]
    assert (parts.skipped, parts.name) == (whole.skipped, whole.name)


@pytest.mark.parametrize("keep", [False, True])
def test_matrices_that_are_read_one_by_one_are_the_same(picture, monkeypatch, keep):
    """As before Blender 5.0, where the first object has instances: whether it is shown itself or not."""
    for found in list(picture.collection.objects):
        bpy.data.objects.remove(found)
    owner = add_mesh("Many")
    geometry_nodes(owner, keep=keep)
    lost = add_mesh("Lost")
    lost.parent = add("Parent", None)
    lost.matrix_parent_inverse[0][3] = float("inf")
    whole = contents(depsgraph())
    monkeypatch.setattr(compat, "keeps_memory_of_instances", lambda: True)
    assert Matrices(depsgraph()).is_by_one
    data = contents(depsgraph())
    assert len(data.instance_mesh) == 8 + keep and data.skipped == whole.skipped
    assert data.instance_matrix.tobytes() == whole.instance_matrix.tobytes()
    bpy.data.objects.remove(owner)
    assert not Matrices(depsgraph()).is_by_one


def test_boxes_are_those_of_the_instances_evenly_chosen(picture, monkeypatch):
    many(1000)
    export = Export()
    assert not export.is_long(depsgraph()) and export.read(depsgraph(), None, seconds=math.inf)
    data, boxes = export.scene(depsgraph()), export.boxes()
    for box, row, matrix in zip(boxes, data.instance_mesh, data.instance_matrix, strict=True):
        world = data.meshes[row].vertices @ matrix[:3, :3].T + matrix[:3, 3]
        np.testing.assert_allclose(box, [world.min(axis=0), world.max(axis=0)], atol=1e-5)
    monkeypatch.setattr(export_module, "MOST_BOXES", 101)
    assert export.boxes().tobytes() == boxes[::10].tobytes()
    assert export.boxes(25).tobytes() == boxes[30::10].tobytes()


def test_what_is_gone_in_the_middle_of_an_export_is_told(picture):
    owner = many(30_000)
    export = Export()
    assert not export.read(depsgraph(), None, seconds=0.0)
    bpy.data.objects.remove(owner)
    with pytest.raises(UserError, match="the scene changed while it was read"):
        export.read(depsgraph(), None, seconds=math.inf)


def test_the_boxes_of_many_instances_are_the_first_picture(picture, monkeypatch):
    """F12 shows more of them as they are read, then all, then what is traced."""
    many(1000)
    monkeypatch.setattr(export_module, "INSTANCES_A_TICK", 100)
    monkeypatch.setattr(final_render, "MANY", 200)
    shown: list[tuple[bool, np.ndarray]] = []
    real, prepare, is_prepared = final_render._show, final_render.prepared.prepare, []

    def show(engine: object, layer: str, passes: dict[str, np.ndarray], place: object) -> None:
        shown.append((bool(is_prepared), passes["combined"]))
        real(engine, layer, passes, place)

    monkeypatch.setattr(final_render, "_show", show)
    monkeypatch.setattr(final_render.prepared, "prepare", lambda *a, **k: (is_prepared.append(0), prepare(*a, **k))[1])
    assert bpy.ops.render.render() == {"FINISHED"}
    before = [pixels for is_traced, pixels in shown if not is_traced]
    assert len(before) == 3 < len(shown)
    assert [pixels.shape for pixels in before] == [(24, 32, 4)] * 3
    counts = [np.count_nonzero(pixels[..., 3]) for pixels in before]
    assert 0 < counts[0] <= counts[1] <= counts[2] and counts[0] < counts[2]


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
