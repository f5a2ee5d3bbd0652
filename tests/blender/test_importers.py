"""Every mesh format that this Blender can also write comes back as the mesh it was written from."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.blender import importers
from addon.blender.scene_file import read_mesh_file
from addon.pipeline.errors import UserError
from tests.blender.scenes import add_mesh
from tests.meshes import icosphere

WRITERS: dict[str, Callable[[str], object]] = {
    ".obj": lambda path: bpy.ops.wm.obj_export(filepath=path),
    ".ply": lambda path: bpy.ops.wm.ply_export(filepath=path),
    ".stl": lambda path: bpy.ops.wm.stl_export(filepath=path),
    ".glb": lambda path: bpy.ops.export_scene.gltf(filepath=path, export_format="GLB"),
    ".gltf": lambda path: bpy.ops.export_scene.gltf(filepath=path, export_format="GLTF_SEPARATE"),
    ".fbx": lambda path: bpy.ops.export_scene.fbx(filepath=path),
    ".usd": lambda path: bpy.ops.wm.usd_export(filepath=path),
    ".usda": lambda path: bpy.ops.wm.usd_export(filepath=path),
    ".usdc": lambda path: bpy.ops.wm.usd_export(filepath=path),
    ".usdz": lambda path: bpy.ops.wm.usd_export(filepath=path),
    ".abc": lambda path: bpy.ops.wm.alembic_export(filepath=path, as_background_job=False),
}


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_mesh_comes_back(scene, tmp_path, suffix):
    mesh = icosphere(2)
    owner = add_mesh("Ball", mesh)
    owner.scale, owner.location = (1, 2, 3), (0.5, 0, 0)
    path = tmp_path / f"ball{suffix}"
    WRITERS[suffix](str(path))
    data, seconds = read_mesh_file(path, 64, 48)
    vertices, triangles = data.flatten()
    expected = mesh.vertices * (1, 2, 3) + (0.5, 0, 0)
    np.testing.assert_allclose(vertices.min(axis=0), expected.min(axis=0), atol=1e-4)
    np.testing.assert_allclose(vertices.max(axis=0), expected.max(axis=0), atol=1e-4)
    assert len(triangles) == len(mesh.triangles)
    np.testing.assert_allclose(volume(vertices[triangles]), volume(expected[mesh.triangles]), rtol=1e-4)
    shown = data.camera.project(vertices)
    assert (shown[:, :2] > 0).all() and (shown[:, :2] < (64, 48)).all()
    assert seconds > 0


def volume(corners: np.ndarray) -> float:
    return float(np.linalg.det(corners.astype(np.float64)).sum() / 6)


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".glb", ".fbx", ".usdc", ".abc", ".obj"])
def test_nonsense_is_named_in_one_line(scene, tmp_path, suffix, capfd):
    path = tmp_path / f"bad{suffix}"
    path.write_bytes(b"nonsense\n" * 40)
    with pytest.raises(UserError) as caught:
        read_mesh_file(path, 64, 48)
    assert path.name in str(caught.value) and "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""


def test_a_file_that_is_not_there(scene, tmp_path):
    with pytest.raises(UserError, match=r"no\.obj does not exist"):
        read_mesh_file(tmp_path / "no.obj", 64, 48)


def test_an_ending_that_nobody_reads(scene, tmp_path):
    path = tmp_path / "mesh.xyzzy"
    path.write_text("")
    with pytest.raises(UserError, match=r"\.xyzzy is no mesh format; known: \.npz, \.obj"):
        read_mesh_file(path, 64, 48)


def test_a_format_that_this_blender_lacks_is_said(scene, tmp_path, monkeypatch):
    monkeypatch.setitem(importers.IMPORTERS, ".obj", ("wm.no_such_import",))
    path = tmp_path / "mesh.obj"
    path.write_text("v 0 0 0\n")
    with pytest.raises(UserError, match=r"has no importer for \.obj"):
        read_mesh_file(Path(path), 64, 48)


def test_the_newest_operator_comes_first(scene, tmp_path, monkeypatch):
    monkeypatch.setitem(importers.IMPORTERS, ".obj", ("wm.no_such_import", "wm.obj_import"))
    path = tmp_path / "mesh.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert read_mesh_file(path, 64, 48)[0].triangle_count == 1


def test_add_ons_stay_as_they_were(registered, tmp_path):
    path = tmp_path / "mesh.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    before = [addon.module for addon in bpy.context.preferences.addons]
    read_mesh_file(path, 64, 48)
    assert [addon.module for addon in bpy.context.preferences.addons] == before
    assert bpy.context.scene.bih.samples == 1
