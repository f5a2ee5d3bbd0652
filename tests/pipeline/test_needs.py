"""What was left out is true of the scene, its savings are the scene's own numbers, and the picture keeps its bits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.pipeline import needs, preview
from addon.pipeline.camera import framing_view
from addon.pipeline.errors import UserError
from addon.pipeline.mesh import Mesh
from addon.pipeline.needs import Part, Plan, plan
from addon.pipeline.scene import LIGHT_DTYPE, SceneData
from addon.pipeline.settings import PARTS, PASSES, Settings
from benchmarks.needs import OF_THE_TREE, differing
from benchmarks.needs_scenes import SCENES, Case
from tests import meshes

MESH = Mesh("one", np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
MOVED = np.eye(4)
MOVED[0, 3] = 1.0


def scene(*matrices: np.ndarray, lights: int = 0, mesh: Mesh = MESH) -> SceneData:
    view = framing_view(np.array([[0.0] * 3, [1.0] * 3]), 30, 20)
    rows = np.zeros(lights, LIGHT_DTYPE)
    rows["colour"] = 1
    return SceneData([mesh], np.zeros(len(matrices), np.int32), np.array(matrices), camera=view, lights=rows)


def planned(
    of: SceneData, settings: Settings | None = None, wanted: Any = PASSES, *, shown: bool = True
) -> tuple[Plan, dict[str, Part]]:
    made = plan(of, settings or Settings(), wanted, tree_shown=shown)
    return made, {part.name: part for part in made.parts}


def test_every_part_has_one_row_in_the_order_of_the_settings() -> None:
    made, _ = planned(scene(MOVED, MOVED, lights=2))
    assert tuple(part.name for part in made.parts) == PARTS
    assert all(part.why for part in made.parts)
    assert not any(part.saves for part in made.parts if part.kept)


@pytest.mark.parametrize(
    ("name", "channels"),
    [("combined", 4), ("depth", 1), ("normal", 3), ("position", 3), ("triangle", 1), ("instance", 1), ("cost", 2)],
)
def test_a_pass_not_wanted_saves_four_bytes_a_channel_and_pixel(name: str, channels: int) -> None:
    made, parts = planned(scene(MOVED, MOVED, lights=1), wanted=[other for other in PASSES if other != name])
    assert [part for part in PASSES if not parts[f"{part} pass"].kept] == [name]
    assert f"{30 * 20 * channels * 4:,} bytes" in parts[f"{name} pass"].saves
    assert name not in made.render["passes"]


def test_shadow_rays_are_saved_by_no_light_no_power_no_shading_and_by_shadows_off() -> None:
    made, parts = planned(scene(MOVED, MOVED), Settings(samples=4))
    assert "no light" in parts["shadow rays"].why
    assert "up to 2,400 rays" in parts["shadow rays"].saves
    assert made.render["shadows"] is False
    lit = scene(MOVED, MOVED, lights=3)
    made, parts = planned(lit, Settings(samples=4, shadows=False, parts={"shadow rays": True}))
    assert "shadows are off" in parts["shadow rays"].why
    assert "up to 7,200 rays" in parts["shadow rays"].saves
    assert made.render["shadows"] is False
    assert "no pass is shaded" in planned(lit, wanted=("depth",))[1]["shadow rays"].why
    lit.lights["colour"] = 0
    assert "power" in planned(lit)[1]["shadow rays"].why
    lit.lights["colour"][1] = 1
    made, parts = planned(lit)
    assert parts["shadow rays"].kept
    assert len(made.render["lights"]) == 1
    assert "up to 1,200 shadow rays" in parts["lights without power"].saves


def test_normals_are_for_passes_that_show_or_use_them() -> None:
    for wanted, kept in (("combined", True), ("normal", True), ("depth", False), ("position", False), ("cost", False)):
        assert planned(scene(np.eye(4)), wanted=(wanted,))[1]["normals"].kept is kept


def test_vertices_that_are_not_moved_are_not_transformed() -> None:
    assert planned(scene(np.eye(4), MOVED, lights=1))[1]["world transform"].kept
    two = planned(scene(np.eye(4), np.eye(4), lights=1))[1]["world transform"].saves
    assert "6 vertices not transformed" in two
    assert "copied" not in two
    one = planned(scene(np.eye(4), lights=1))[1]["world transform"].saves
    assert "3 vertices not transformed and not copied" in one


def test_double_precision_is_for_vertices_that_need_it() -> None:
    wide = replace(MESH, vertices=MESH.vertices.astype(np.float64))
    for mesh, wanted, dtype in (
        (MESH, PASSES, np.float32),
        (wide, ("depth",), np.float32),
        (wide, ("cost",), np.float64),
    ):
        assert planned(scene(np.eye(4), mesh=mesh), wanted=wanted)[0].flatten["dtype"] == dtype
    assert planned(scene(MOVED, mesh=wide), wanted=("depth",))[0].flatten["dtype"] == np.float64
    third = replace(MESH, vertices=wide.vertices / 3)
    leave_out = Settings(parts={"double precision": False})
    made, parts = planned(scene(np.eye(4), mesh=third), leave_out, wanted=("depth",))
    assert made.flatten["dtype"] == np.float64
    assert "'one'" in parts["double precision"].why
    huge = replace(MESH, vertices=wide.vertices * 1e300)
    assert planned(scene(np.eye(4), mesh=huge), wanted=("depth",))[1]["double precision"].kept


def many(count: int) -> SceneData:
    return scene(np.eye(4), mesh=Mesh("many", MESH.vertices, np.zeros((count, 3), np.int32)))


def test_the_thresholds_decide_and_a_choice_overrules_them() -> None:
    for count, kept in ((needs.SORTED_TRIANGLES, False), (needs.SORTED_TRIANGLES + 1, True)):
        assert planned(many(count))[0].tree["presort"] is kept
        assert planned(many(count), Settings(parts={"bucket sort": not kept}))[0].tree["presort"] is not kept
    for count, leaf in ((8, 8), (9, None)):
        assert planned(many(count))[0].tree["leaf_size"] == leaf
        forced = planned(many(count), Settings(parts={"tree": True}))[0].tree["leaf_size"]
        assert forced == (1 if leaf else None)
    assert planned(many(3), Settings(leaf_size=2))[0].tree["leaf_size"] == 2
    assert planned(many(3))[0].tree["threads"] == 0
    assert planned(many(3), Settings(threads=5))[0].tree["threads"] == 5
    assert planned(many(3), Settings(parts={"threads": False}))[0].tree["threads"] == 1
    assert planned(many(3), Settings(threads=5, parts={"threads": False}))[0].tree["threads"] == 5


def test_on_demand_is_for_large_meshes_of_which_little_is_in_view() -> None:
    count = needs.ON_DEMAND_TRIANGLES
    away = np.eye(4)
    away[:3, 3] = 1e4
    hidden, seen = replace(many(count), instance_matrix=away[None]), many(count)
    assert planned(hidden)[0].tree["build"] == "on_demand"
    assert "build" not in planned(seen)[0].tree
    assert "build" not in planned(many(count - 1))[0].tree
    assert planned(seen, Settings(parts={"on demand": True}))[0].tree["build"] == "on_demand"
    assert "build" not in planned(hidden, Settings(parts={"on demand": False}))[0].tree


def test_rows_are_those_of_the_whole_scene() -> None:
    """Instances 0 and 2 of four are out of sight, with 1 and 3 triangles; 1 and 3 have 2 and 1."""
    sizes = [1, 2, 3, 1]
    made = [Mesh("m", MESH.vertices, np.repeat(MESH.triangles, size, axis=0)) for size in sizes]
    away = np.eye(4)
    away[:3, 3] = 1e6
    whole = SceneData(made, np.arange(4, dtype=np.int32), np.stack([away, np.eye(4)] * 2), camera=scene(MOVED).camera)
    got, parts = planned(whole, wanted=("triangle",), shown=False)
    assert got.reached.tolist() == [False, True, False, True]
    assert "4 triangles" in parts["objects out of reach"].saves
    assert got.rows_of_all(np.array([-1, 0, 1, 2], np.int32)).tolist() == [-1, 1, 2, 6]
    assert planned(whole, wanted=("triangle",), shown=True)[0].reached.all()
    assert planned(whole, wanted=("cost",), shown=False)[0].reached.all()


def test_an_unknown_part_is_refused() -> None:
    with pytest.raises(UserError, match="unknown part 'roof'"):
        Settings(parts={"roof": True})


@pytest.mark.parametrize("name", SCENES)
def test_each_part_kept_or_left_out_gives_the_same_bits(name: str) -> None:
    assert list(differing(SCENES[name](2_000))) == []


@pytest.mark.parametrize("name", ["stanford-bunny", "delft-city", "rod-assembly", "spider-degenerate", "soup"])
def test_so_it_does_on_meshes_of_others(name: str) -> None:
    vertices, triangles = meshes.shared_mesh(name)
    view = framing_view(np.stack([vertices.min(axis=0), vertices.max(axis=0)]), 48, 36)
    # In the double precision of some, and in one that single precision would hold.
    for passes, kept in ((PASSES, vertices), (("depth",), vertices), (PASSES, np.float64(np.float32(vertices)))):
        case = Case(SceneData.of_mesh(Mesh(name, kept, triangles), view), Settings(passes=passes))
        assert list(differing(case)) == []


def test_every_part_is_turned_by_some_scene() -> None:
    """Else the tests of its bits would say nothing. On demand is one of large meshes, or of versions that have it."""
    off = set()
    for make in SCENES.values():
        case = make(20_000)
        for parts in ({}, dict.fromkeys(PARTS, False)):
            report = preview.trace(case.scene, replace(case.settings, parts=parts), outputs=preview.Outputs()).report
            off |= {row["part"] for row in report["needs"] if not row["kept"]}
    assert off >= set(PARTS)
    assert OF_THE_TREE < set(PARTS)


def test_the_table_has_a_line_for_each_part() -> None:
    report = preview.trace(SCENES["cube"](0).scene, Settings()).report
    lines = needs.lines(report["needs"])
    assert len(lines) == len(report["needs"]) >= len(PARTS)
    assert all(("kept" in line) != ("left out" in line) or "asked" in line for line in lines)
    assert needs.lines([]) == []
