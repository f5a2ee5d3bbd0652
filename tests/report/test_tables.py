"""The tables: every row is there, what cannot be measured says so, and figures are those of the trees."""

from __future__ import annotations

import itertools
from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

import bihtree
import numpy as np
import pytest

from addon.pipeline.errors import UserError
from addon.report import published, table_arguments
from addon.report.room import room
from addon.report.rounds import Rounds, measure
from addon.report.structures import NOT_IN_THIS_VERSION, Embreex, Ours
from addon.report.tables import bucket_sort, command, made, nodes, structures
from addon.report.tables.options import QUICK, Named, Options, scanned
from addon.report.view import camera_of


def parsed(*words: str, output: Path | None = None) -> Namespace:
    parser = ArgumentParser()
    table_arguments.add(parser)
    parser.set_defaults(output=output)
    return parser.parse_args(words)


@pytest.fixture(scope="module")
def text() -> str:
    return made(QUICK, lambda what: None, lambda scene, name: (2.0, 1.0, 0.94))


def rows_of(text: str, first: str) -> list[list[str]]:
    """Cells of each row whose first cell this is."""
    cells = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("|")]
    return [row for row in cells if row[0] == first]


def test_every_published_figure_stands_in_it(text: str) -> None:
    for row in published.BUCKET_SORT:
        assert f"{row.mesh}, {row.triangles:,}: {row.plain_ms:,}; {row.sorted_ms:,}; {row.frame_rate} %" in text
    for row in (*published.SHIRLEY, *published.DRAGON):
        assert f"{row.triangle_bytes:,}; {row.tree_bytes:,}; " in text
    for row in published.BOEING:
        assert f"{row.view}: {row.tree_bytes:,}; {row.frames}; {row.total_seconds} s" in text
    assert "349,569,456" in text


def test_every_table_is_one(text: str) -> None:
    assert text.count("### ") == 5
    for line, following in itertools.pairwise(text.splitlines()):
        if line.startswith("|") and following.startswith("|"):
            assert line.count("|") == following.count("|")
    assert "nan" not in text
    assert max(len(line) for line in text.splitlines() if not line.startswith("|")) <= 120


def test_the_bucket_sort_has_a_row_for_each_layout_thread_count_and_mesh(text: str) -> None:
    rows = rows_of(text, "scan by formula, 3,000")
    assert [row[1:3] for row in rows[:5]] == [
        ["ours, classic", "1"],
        ["ours, classic", "all"],
        ["ours, wide", "1"],
        ["ours, wide", "all"],
        ["as published, another tree", "1"],
    ]
    assert rows[4][3:7] == ["2,000", "1,000", "0.500", "94 %"]
    alone = bucket_sort.rows(QUICK, print, Named("room", room()), published.BUCKET_SORT[0], None)
    assert len(list(alone)) == 4


def test_a_structure_that_is_missing_says_so_and_one_that_is_there_has_figures(text: str) -> None:
    for tree in (tree for tree, _ in structures.STRUCTURES):
        rows = rows_of(text, tree.name)
        assert len(rows) == 2
        for row in rows:
            assert row[1] == (tree.missing() or row[1])
            assert bool(tree.missing()) == (row[4] == "–")
    assert Ours("none", {"structure": "octree"}).missing() == NOT_IN_THIS_VERSION
    assert Ours("one").missing() == Embreex().missing() == ""


def test_bytes_and_counts_are_those_of_the_tree() -> None:
    mesh = Named("room", room())
    rows = {row[1]: row for row in nodes.rows(QUICK, print, mesh)}
    tree = bihtree.Tree(mesh.scene.mesh.vertices, mesh.scene.mesh.triangles, layout="classic", leaf_size=1)
    row = rows["BIH, classic, one object a leaf"]
    inner = int((tree.nodes()["kind"] == 0).sum())
    assert float(row[4]) == inner * 1000 // 804 / 1000 < 1
    assert float(row[5]) == pytest.approx(tree.stats.tree_bytes / 804, rel=0.01)
    view = camera_of(mesh.scene, *QUICK.picture())
    visited, tested = tree.traversal_cost(*bihtree.Camera(view.clip_to_world, view.width, view.height).rays())
    assert float(row[2]) == pytest.approx(visited.mean(), rel=0.01)
    assert float(row[3]) == pytest.approx(tested.mean(), rel=0.01)


def test_sides_take_turns_and_those_that_are_missing_none() -> None:
    scene = room()
    sides = [Ours("a"), Ours("b", {"layout": "wide"}), Ours("c", {"structure": "octree"})]
    found = measure(sides, scene.mesh, camera_of(scene, 16, 16), Rounds(3, 60.0))
    assert list(found) == ["a", "b"]
    for measured in found.values():
        assert 0 < measured.build <= measured.image
        assert measured.frames == 1 / measured.frame
        assert measured.facts["tree_bytes"] > 0


def test_the_room_has_as_many_triangles_as_the_slides() -> None:
    assert len(room().mesh.triangles) == published.SHIRLEY[1].triangles == 804


def test_a_mesh_file_takes_the_place_of_a_formula(tmp_path: Path) -> None:
    ply = tmp_path / "a.ply"
    lines = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz")]
    lines += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    ply.write_text("\n".join([*lines, "0 0 0", "1 0 0", "0 1 0", "3 0 1 2", ""]))
    assert str(scanned("Dragon", ply, 5)) == "Dragon, 1"
    np.savez(tmp_path / "a.npz", vertices=np.eye(3), triangles=np.array([[0, 1, 2]]))
    assert str(scanned("Dragon", tmp_path / "a.npz", 5)) == "Dragon, 1"
    assert str(scanned("Dragon", None, 1_000)) == "scan by formula, 1,000"
    for name, said in (("a.obj", "tables read"), ("none.ply", "does not exist")):
        with pytest.raises(UserError, match=said):
            scanned("Dragon", tmp_path / name, 5)


def test_options_of_the_command_line(tmp_path: Path) -> None:
    assert command.chosen(parsed()) == Options()
    assert command.chosen(parsed("--quick")) == QUICK
    asked = command.chosen(parsed("--quick", "--airframe-triangles", "5000", "--rounds", "2", "--dragon", "a.ply"))
    assert asked == replace(QUICK, airframe_triangles=5_000, rounds=Rounds(2, 0.0), dragon=Path("a.ply"))
    for wrong in (("--thai-triangles", "999"), ("--rounds", "0")):
        with pytest.raises(UserError, match="at least"):
            command.chosen(parsed(*wrong))
    with pytest.raises(UserError, match="no folder"):
        command.run(parsed("--quick", output=tmp_path / "none"), print)


def test_the_camera_has_the_whole_mesh_before_its_far_plane() -> None:
    scene = room()
    for size in ((64, 48), (48, 64)):
        camera = camera_of(scene, *size)
        assert (camera.project(scene.mesh.vertices)[:, 2] < 1).all()
        # The view's angle is the vertical one.
        distance = np.linalg.norm(np.subtract(scene.view.target, scene.view.eye))
        top = np.array(scene.view.target)
        forward = (top - scene.view.eye) / distance
        up = np.cross(np.cross(forward, scene.view.up), forward)
        top = top + up / np.linalg.norm(up) * distance * np.tan(np.radians(scene.view.angle) / 2)
        assert camera.project(top[None])[0, 1] == pytest.approx(size[1])
