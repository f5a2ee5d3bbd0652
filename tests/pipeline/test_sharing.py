"""Meshes that are shown several times: found once, built once, and the picture is the flattened scene's."""

from __future__ import annotations

import resource
from dataclasses import replace

import bihtree
import numpy as np
import pytest

from addon.pipeline import needs, preview
from addon.pipeline.camera import framing_view
from addon.pipeline.mesh import Mesh, bounds_of
from addon.pipeline.scene import OBJECT_DTYPE, SURFACE_DTYPE, SceneData
from addon.pipeline.settings import PASSES, Settings
from addon.pipeline.sharing import shared
from addon.pipeline.tree_cache import TreeCache
from tests import meshes
from tests.instances import anywhere

SPHERE, BOX = (Mesh(name, *mesh) for name, mesh in (("ball", meshes.icosphere(2)), ("box", meshes.box())))
ASKED = Settings(passes=PASSES, parts={"instances": True})
FLAT = replace(ASKED, parts={"instances": False})


def scene_of(*shown: Mesh, spread: float = 2.0, seed: int = 1) -> SceneData:
    """Each mesh at a place of its own, seen by a camera that frames them."""
    matrices = anywhere(len(shown), np.random.default_rng(seed), spread)
    scene = SceneData(shown, np.arange(len(shown), dtype=np.int32), matrices)
    return replace(scene, camera=framing_view(bounds_of(scene.flatten()[0]), 60, 45))


def copy_of(mesh: Mesh) -> Mesh:
    return replace(mesh, name="copy", vertices=mesh.vertices.copy(), triangles=mesh.triangles.copy())


def test_equal_meshes_are_found_once_and_no_others() -> None:
    other = copy_of(SPHERE)
    other.vertices[3, 1] += 1
    zero, minus = copy_of(BOX), copy_of(BOX)
    minus.vertices[minus.vertices == 0] = -0.0
    slots = replace(copy_of(BOX), materials=np.zeros(12, np.int32))
    scene = scene_of(SPHERE, BOX, copy_of(SPHERE), other, zero, minus, slots)
    found = shared(scene)
    assert found.instance_mesh.tolist() == [0, 1, 0, 2, 1, 3, 4]
    assert [mesh.name for mesh in found.meshes] == ["ball", "box", "copy", "copy", "copy"]
    assert found.instance_matrix is scene.instance_matrix
    only = shared(scene.only(np.array([False, True, False, False, True, False, False])))
    assert only.instance_mesh.tolist() == [0, 0] and len(only.meshes) == 1


def part(scene: SceneData, settings: Settings, *, shown: bool = False) -> needs.Part:
    made = needs.plan(scene, settings, settings.passes, tree_shown=shown)
    [row] = [row for row in made.parts if row.name == "instances"]
    assert row.kept == made.is_instanced
    return row


def test_when_instances_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    many = scene_of(SPHERE, copy_of(SPHERE), SPHERE, BOX)
    assert "1,000 triangles" not in part(many, Settings()).why
    assert "972 triangles, fewer than 65,536" in part(many, Settings()).why
    monkeypatch.setattr(needs, "INSTANCED_TRIANGLES", 600)
    assert "fewer than 2,700: flattened, 2,700 rays" in part(many, Settings()).why
    assert many.camera is not None
    small = replace(many, camera=replace(many.camera, width=20, height=32))
    assert part(small, Settings()).kept and not part(small, Settings(samples=2)).kept
    monkeypatch.setattr(needs, "FLATTENED_TRIANGLES", 640)
    kept = part(many, Settings())
    assert kept.kept and kept.why == "972 triangles are images of 332, equal meshes found: 2"
    assert "as asked" in part(many, FLAT).why
    assert "one object" in part(scene_of(SPHERE), Settings()).why
    assert "there once" in part(scene_of(SPHERE, BOX, Mesh("c", *meshes.icosphere(2, 2.0))), Settings()).why
    assert "whole tree" in part(many, ASKED, shown=True).why


@pytest.mark.parametrize("precision", ["watertight", "exact", "fast"])
def test_the_picture_is_that_of_the_flattened_scene(precision: str) -> None:
    """Flattened, moved vertices are rounded to float32: by so much hits may differ, and rarely what is hit."""
    scene = scene_of(SPHERE, BOX, copy_of(SPHERE), BOX, SPHERE)
    surfaces = np.zeros(2, SURFACE_DTYPE)
    surfaces["base"], surfaces["index"] = [[1, 0.5, 0], [0, 0.5, 1]], [4, 5]
    objects = np.zeros(5, OBJECT_DTYPE)
    objects["index"], objects["first_surface"] = np.arange(5) + 10, [0, 1, 0, 1, 1]
    scene = replace(scene, surfaces=surfaces, objects=objects)
    flat, made = (
        preview.trace(scene, replace(settings, precision=precision), outputs=preview.Outputs())
        for settings in (FLAT, ASKED)
    )
    assert isinstance(made.tree, bihtree.Scene) and isinstance(flat.tree, bihtree.Tree)
    assert list(made.passes) == list(flat.passes) == list(PASSES)
    same = (made.passes["triangle"] == flat.passes["triangle"])[..., 0]
    assert same.mean() > 0.99 and (flat.passes["triangle"] >= 0).mean() > 0.05
    for name in ("instance", "object_index", "material_index"):
        assert np.array_equal(made.passes[name][same], flat.passes[name][same]), name
    for name, close in (("depth", 1e-5), ("position", 1e-5), ("normal", 1e-4), ("combined", 1e-3)):
        assert np.allclose(made.passes[name][same], flat.passes[name][same], rtol=close, atol=close), name
    for name in ("triangles", "instances", "vertices", "rejected", "structure", "layout", "precision"):
        assert made.report[name] == flat.report[name], name
    assert 0 < made.report["tree_bytes"] <= made.report["bound_bytes"]


def test_objects_that_are_not_moved_give_the_same_bits() -> None:
    scene = scene_of(SPHERE, Mesh("far", BOX.vertices + np.float32(2), BOX.triangles))
    scene = replace(scene, instance_matrix=np.tile(np.eye(4), (2, 1, 1)))
    scene = replace(scene, camera=framing_view(bounds_of(scene.flatten()[0]), 60, 45))
    flat, made = (preview.trace(scene, settings, outputs=preview.Outputs()).passes for settings in (FLAT, ASKED))
    for name in PASSES:
        assert name == "cost" or made[name].tobytes() == flat[name].tobytes(), name


def test_only_what_changed_is_built_again() -> None:
    cache, scene, options = TreeCache(), shared(scene_of(SPHERE, BOX, SPHERE)), {"threads": 0, "layout": "wide"}
    first = cache.scene(scene, options)
    trees = list(first.trees)
    assert cache.built == 2 and cache.scene(scene, options) is first
    moved = replace(scene, instance_matrix=scene.instance_matrix[::-1].copy())
    assert cache.scene(moved, options) is first and cache.built == 2
    fresh = bihtree.Scene(trees, scene.instance_mesh, moved.instance_matrix)
    assert first.bounds.tolist() == fresh.bounds.tolist()
    edited = replace(moved, meshes=[scene.meshes[0], copy_of(BOX)])
    second = cache.scene(edited, options)
    assert cache.built == 3 and second.trees[0] is trees[0] and second.trees[1] is not trees[1]
    cache.scene(edited, {**options, "layout": "compact"})
    assert cache.built == 5
    vertices = edited.flatten()[0]
    assert len(cache.tree(edited, {}, options)[0].order()) == edited.triangle_count and len(vertices)


def test_memory_does_not_grow_with_instances() -> None:
    """A thousand bunnies: 69 million triangles, which flattened take 2.5 GB before a tree is built."""
    bunny = Mesh("bunny", *meshes.shared_mesh("stanford-bunny"))
    rows = np.zeros(1000, np.int32)
    matrices = np.tile(np.eye(4), (1000, 1, 1))
    size = np.ptp(bunny.vertices, axis=0).max()
    matrices[:, :2, 3] = 1.2 * size * np.stack(np.divmod(np.arange(1000), 32), axis=1)
    low, high = bounds_of(bunny.vertices)
    view = framing_view(np.stack([low, high + np.float32(1.2 * size * 31) * np.float32([1, 1, 0])]), 48, 36)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    made = preview.trace(SceneData([bunny], rows, matrices, camera=view), Settings(), outputs=preview.Outputs())
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert isinstance(made.tree, bihtree.Scene)
    alone = made.tree.trees[0].stats
    assert made.report["triangles"] == 1000 * alone.triangles
    assert made.report["tree_bytes"] < alone.tree_bytes + 1000 * 400
    # In KiB; on a Mac in bytes, which is a looser bound.
    assert grown < 300_000 or grown > 10_000_000_000
    assert (made.passes["combined"][..., 3] > 0).mean() > 0.05
