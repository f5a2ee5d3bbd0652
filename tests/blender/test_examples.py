"""Every .blend here opens in the oldest Blender that we support."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import bpy
import numpy as np
import pytest
import zstandard

from addon.blender.scene_file import read_blend
from addon.blender.trees import TREES
from addon.pipeline import built
from tests.meshes import shared_mesh

ROOT = Path(__file__).resolve().parents[2]
BLENDS = sorted(
    path for path in ROOT.rglob("*.blend") if not {"build", "target", ".git"} & set(path.relative_to(ROOT).parts)
)
OLDEST = 402


def blend_version(path: Path) -> int:
    """402 for a file of Blender 4.2, from its header: BLENDER-v402, or from 5.0 on BLENDER17-01v0500."""
    raw = path.read_bytes()
    if raw.startswith(b"\x28\xb5\x2f\xfd"):
        with zstandard.ZstdDecompressor().stream_reader(raw) as reader:
            header = reader.read(32)
    else:
        header = gzip.decompress(raw)[:32] if raw.startswith(b"\x1f\x8b") else raw[:32]
    match = re.match(rb"BLENDER(?:[-_][vV](\d{3})|\d\d-\d\dv(\d{4}))", header)
    assert match, f"{path} is not a .blend"
    return int(match[1] or match[2])


@pytest.mark.parametrize("path", BLENDS, ids=lambda path: path.name)
def test_saved_by_the_oldest_blender(path):
    assert blend_version(path) <= OLDEST


def test_the_check_sees_this_blender(scene, tmp_path):
    """Without this, a header that is read wrongly would pass."""
    for compress in (False, True):
        path = tmp_path / f"{compress}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=compress, copy=True)
        assert blend_version(path) == bpy.app.version[0] * 100 + bpy.app.version[1]


def test_there_is_an_example():
    assert ROOT / "examples" / "bunny.blend" in BLENDS


def test_the_bunny_is_the_whole_bunny(registered):
    scene, _, _ = read_blend(ROOT / "examples" / "bunny.blend")
    meshes = {mesh.name: mesh for mesh in scene.meshes}
    assert set(meshes) == {"Bunny", "Floor"} and scene.skipped == ()
    assert len(scene.lights) == 2
    source = shared_mesh("stanford-bunny")
    np.testing.assert_array_equal(meshes["Bunny"].triangles, source.triangles)
    # a turn, a scale and a move keep the ratios of all distances
    first, second = (
        np.linalg.norm(points.astype(np.float64) - points.astype(np.float64).mean(axis=0), axis=1)
        for points in (meshes["Bunny"].vertices, source.vertices)
    )
    np.testing.assert_allclose(first / first.max(), second / second.max(), atol=1e-5)
    vertices, _ = scene.flatten()
    shown = scene.camera.project(vertices)
    assert (shown[:, 3] > 0).all()
    assert (shown[:, :2] > 0).all() and (shown[:, :2] < (scene.camera.width, scene.camera.height)).all()


def test_source_and_licence_are_stated():
    text = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    for words in ("Stanford Computer Graphics\nLaboratory", "Stanford 3D Scanning Repository", "commercial"):
        assert words in text
    for path in BLENDS:
        if path.parent.name == "examples":
            assert path.name in text


OVERLAYS = [path for path in BLENDS if path.name.startswith("overlay-")]


def test_there_is_one_for_each_way_to_look_at_a_tree():
    names = {path.stem.removeprefix("overlay-") for path in OVERLAYS}
    assert names == {"planes", "boxes", "leaves", "construction", "ray", "on-demand", "cost", "compare", "mesh"}
    assert all(path.stat().st_size < 300_000 for path in OVERLAYS)


@pytest.mark.parametrize("path", OVERLAYS, ids=lambda path: path.name)
def test_its_tree_can_be_built_and_looked_at(registered, path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    assert "sidebar" in bpy.data.texts["Read Me"].as_string()
    assert bpy.ops.bih.build() == {"FINISHED"}
    made, chosen = TREES.of(scene).main, scene.bih_overlay
    assert made.rays > 0, "its camera sees it"
    if path.stem == "overlay-mesh":
        assert len(bpy.data.collections["Tree of Scene"].objects) > 4 and not chosen.is_shown
    if path.stem == "overlay-on-demand":
        assert 0.1 < built.unbuilt_share(made) < 0.9
    if path.stem == "overlay-compare":
        bpy.ops.bih.compare()
        assert TREES.of(scene).other.tree.stats.structure == "kd_tree"
