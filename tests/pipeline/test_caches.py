"""What is kept between pictures: meshes as long as their bits stay, trees as long as their meshes stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.pipeline import prepared
from addon.pipeline.camera import framing_view
from addon.pipeline.content import have_same_content
from addon.pipeline.mesh import Mesh
from addon.pipeline.mesh_cache import MeshCache
from addon.pipeline.scene import SceneData
from addon.pipeline.settings import Settings
from addon.pipeline.tree_cache import TreeCache
from tests import meshes


def box(name: str = "Box") -> Mesh:
    return Mesh(name, *meshes.box())


def changed(mesh: Mesh) -> Mesh:
    vertices = mesh.vertices.copy()
    vertices[3, 1] = np.nextafter(vertices[3, 1], np.float32(9))
    return replace(mesh, vertices=vertices)


def test_a_mesh_that_is_read_again_with_the_same_bits_is_the_same_object():
    cache = MeshCache()
    first = cache.mesh("a", box)
    assert cache.mesh("a", box) is first
    assert cache.read == 2
    assert cache.mesh("b", box) is not first


def test_one_bit_makes_another_mesh():
    cache = MeshCache()
    first = cache.mesh("a", box)
    second = cache.mesh("a", lambda: changed(first))
    assert second is not first and cache.mesh("a", lambda: changed(first)) is second
    assert cache.mesh("a", lambda: replace(second, triangles=second.triangles[:-1])) is not second
    assert cache.mesh("a", lambda: box("Renamed")).name == "Renamed"


def test_not_a_number_is_no_change_and_minus_zero_is_one():
    cache = MeshCache()
    broken = box()
    broken.vertices[0] = np.nan
    first = cache.mesh("a", lambda: broken)
    assert cache.mesh("a", lambda: replace(broken, vertices=broken.vertices.copy())) is first
    minus = replace(box(), vertices=np.where(box().vertices == 0, np.float32(-0.0), box().vertices))
    zero = cache.mesh("b", box)
    assert cache.mesh("b", lambda: minus) is not zero


def test_what_was_not_evaluated_again_is_not_read():
    cache = MeshCache()
    first = cache.mesh("a", box, evaluation=7)
    assert cache.mesh("a", lambda: pytest.fail("read"), evaluation=7) is first
    assert cache.mesh("a", box, evaluation=8) is first and cache.read == 2
    assert cache.mesh("a", lambda: pytest.fail("read"), evaluation=8) is first
    assert cache.mesh("b", box, evaluation=8) is not first, "nothing is kept of it yet"
    assert cache.mesh("a", lambda: changed(first)) is not first, "no evaluation is known: it is read"


def test_what_is_gone_is_forgotten():
    cache = MeshCache()
    first = [cache.mesh(name, box) for name in "ab"]
    cache.forget_unused()
    assert cache.mesh("a", box) is first[0]
    cache.forget_unused()
    assert cache.mesh("a", box) is first[0]
    assert cache.mesh("b", box) is not first[1]


def test_the_same_scene_is_known_by_every_field():
    scene = scene_of(box())
    again = scene_of(box())
    assert scene is not again and have_same_content(scene, again)
    assert not have_same_content(scene, replace(scene, meshes=[changed(scene.meshes[0])]))
    assert not have_same_content(scene, replace(scene, skipped=("one",)))
    assert not have_same_content(scene, replace(scene, instance_matrix=2 * scene.instance_matrix))
    assert not have_same_content(scene, replace(scene, lights=np.zeros(1, scene.lights.dtype)))
    assert not have_same_content(scene, replace(scene, camera=None))
    assert not have_same_content(scene, None)
    assert not have_same_content([1, 2], (1, 2)) and not have_same_content([1, 2], [1])


def scene_of(mesh: Mesh, matrix: np.ndarray | None = None) -> SceneData:
    view = framing_view(np.array([[-1.0] * 3, [2.0] * 3]), 32, 24)
    return replace(SceneData.of_mesh(mesh, view), instance_matrix=(np.eye(4) if matrix is None else matrix)[None])


def pictures(trees: TreeCache | None, scene: SceneData, settings: Settings) -> dict[str, np.ndarray]:
    return prepared.prepare(scene, settings, settings.passes, tree_shown=True, trees=trees).picture()


def test_a_kept_tree_gives_the_picture_of_a_new_one():
    settings = Settings(passes=("combined", "depth", "triangle"))
    cache, mesh = TreeCache(), box()
    moved = np.diag([1.5, -1.0, 0.5, 1.0])
    for count, scene in [(1, scene_of(mesh)), (1, scene_of(mesh)), (2, scene_of(changed(mesh)))]:
        kept, fresh = pictures(cache, scene, settings), pictures(None, scene, settings)
        assert cache.built == count
        for name in settings.passes:
            np.testing.assert_array_equal(kept[name], fresh[name])
    before, after = pictures(cache, scene_of(mesh), settings), pictures(cache, scene_of(mesh, moved), settings)
    assert (before["depth"] != after["depth"]).any()
    np.testing.assert_array_equal(after["depth"], pictures(None, scene_of(mesh, moved), settings)["depth"])


def test_other_settings_are_another_tree():
    cache, mesh = TreeCache(), box()
    for layout in ("wide", "classic", "wide"):
        pictures(cache, scene_of(mesh), Settings(layout=layout, passes=("depth",)))
    assert cache.built == 3
