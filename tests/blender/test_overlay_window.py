"""The panels and the overlay of the installed extension in a window: each screenshot shows what only its feature draws,
and is another one than before its slider or click. They stay in build/screenshots, for a person and for the guide."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import pytest

from addon.pipeline import overlay_style
from addon.pipeline.overlay import Kind
from tests.blender.real import INSIDE, PROJECT, install_into, once, read, run
from tests.blender.test_window import window_command

SCREENSHOTS = PROJECT / "build" / "screenshots"
SWATCH = 1_000
"""Pixels that the legend has of a colour, at most; whatever is drawn of the tree has more."""


class Screen:
    """What one run of Blender left."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.report: dict[str, Any] = json.loads((folder / "report.json").read_text())

    def part(self, name: str, of: str = "viewport") -> np.ndarray:
        """(H, W, 3) of a screenshot: a region by its name in the report. The viewport's ends where the sidebar is."""
        x, y, width, height = self.report[of]
        if of == "viewport":
            width = self.report["sidebar"][0] - x
        screen = read(self.folder / f"{name}.png")[..., :3]
        top = screen.shape[0] - y - height
        return screen[top : top + height, x : x + width].astype(int)

    def count(self, name: str, colour: tuple[float, float, float], within: int = 45) -> int:
        """Pixels of about this colour in the viewport."""
        return int((np.abs(self.part(name) - np.array(colour) * 255).max(axis=2) <= within).sum())

    def kind(self, name: str, kind: Kind) -> int:
        return self.count(name, overlay_style.VIEWPORT_COLOURS[kind])

    def changed(self, name: str, other: str, of: str = "viewport") -> int:
        """Pixels that differ."""
        return int((np.abs(self.part(name, of) - self.part(other, of)).max(axis=2) > 20).sum())


@pytest.fixture(scope="module")
def screen() -> Screen:
    """One Blender for all of this file."""
    return Screen(once("overlay", in_a_window))


def in_a_window(folder: Path) -> None:
    script = ["--python", INSIDE / "overlay_window.py", "--", folder]
    command = window_command("--enable-event-simulate", "--window-maximized", *script)
    install_into(folder / "profile")
    done = run(command, folder / "profile")
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    for path in filter(Path.is_file, folder.iterdir()):
        shutil.copy(path, SCREENSHOTS)
    said = done.stdout + done.stderr
    assert (folder / "report.json").exists(), said
    assert "Traceback" not in said, said


def test_nothing_is_drawn_before_a_tree_is_built(screen: Screen) -> None:
    of_the_tree = (Kind.LEFT, Kind.RIGHT, Kind.OVERLAP, Kind.LEAF_BOX, Kind.UNBUILT_BOX)
    assert sum(screen.kind("before", kind) for kind in of_the_tree) < 100, "icons"
    assert screen.changed("before", "planes", "sidebar") > 1000, "the table of the build"


def test_both_clip_planes_have_their_colours(screen: Screen) -> None:
    assert screen.kind("planes", Kind.LEFT) > SWATCH
    assert screen.kind("planes", Kind.RIGHT) > SWATCH
    assert screen.kind("planes", Kind.UNBUILT_BOX) == 0
    blended = screen.part("planes")
    purple = (blended[..., 2] > blended[..., 1] + 30) & (blended[..., 0] > blended[..., 1] + 20)
    assert purple.sum() > 10 * SWATCH, "planes and overlaps are filled"


def test_the_slider_draws_more_levels(screen: Screen) -> None:
    assert screen.changed("planes", "planes-deeper") > 10 * SWATCH
    assert screen.kind("planes-deeper", Kind.LEAF_BOX) > screen.kind("planes", Kind.LEAF_BOX)


def test_boxes_are_boxes_alone(screen: Screen) -> None:
    assert screen.changed("before", "boxes") > SWATCH
    assert screen.kind("boxes", Kind.LEFT) == screen.kind("boxes", Kind.RIGHT) == 0


def test_leaves_are_leaves_alone(screen: Screen) -> None:
    assert screen.kind("leaves", Kind.LEAF_BOX) > 20 * SWATCH
    assert screen.kind("leaves", Kind.LEFT) == screen.kind("leaves", Kind.RIGHT) == 0


def test_a_click_picks_a_ray(screen: Screen) -> None:
    shown, visited, triangle = screen.report["ray"]
    assert shown == "ray" and visited > 5 and triangle >= 0
    assert screen.count("ray", overlay_style.RAY_COLOUR) > SWATCH, "the ray itself"
    assert screen.count("leaves", overlay_style.RAY_COLOUR) == 0
    assert screen.kind("ray", Kind.LEFT) > SWATCH


def test_a_selected_node_shows_its_numbers(screen: Screen) -> None:
    assert screen.report["node"] > 0
    assert screen.changed("node", "ray", "sidebar") > SWATCH
    assert screen.count("node", overlay_style.SELECTED_COLOUR, within=10) > 200
    assert 20 < screen.kind("node", Kind.LEFT) < SWATCH, "only the planes of this node"


def test_construction_plays_until_escape(screen: Screen) -> None:
    assert screen.report["played"] >= 3
    assert screen.report["stopped"] == screen.report["stays"] < 21
    assert screen.kind("play", Kind.LEFT) > SWATCH


def test_the_cost_map_has_its_ramp(screen: Screen) -> None:
    """From violet to yellow, and most of it not yellow."""
    from addon.pipeline.cost_map import RAMP

    counts = [screen.count("cost", tuple(stop), within=30) for stop in RAMP]
    assert min(counts) > 150
    assert counts[1] > 10 * counts[4]
    assert sum(screen.count("before", tuple(stop), within=30) for stop in RAMP) < 100, "icons"


def test_what_is_not_yet_subdivided_is_green(screen: Screen) -> None:
    assert screen.kind("on-demand", Kind.UNBUILT_BOX) > SWATCH
    assert screen.kind("on-demand", Kind.LEAF_BOX) > SWATCH
    assert screen.kind("leaves", Kind.UNBUILT_BOX) == 0


def test_two_structures_stand_side_by_side(screen: Screen) -> None:
    """Planes on the left, the boxes of a bvh on the right."""
    blue = np.abs(screen.part("compare") - np.array(overlay_style.VIEWPORT_COLOURS[Kind.LEFT]) * 255).max(axis=2) <= 45
    columns = np.flatnonzero(blue[: blue.shape[0] * 3 // 4].sum(axis=0))
    assert len(columns) > 50 and columns.max() < blue.shape[1] * 0.7
    right = screen.part("compare")[:, int(0.75 * blue.shape[1]) :]
    assert (np.abs(right - screen.part("before")[:, int(0.75 * blue.shape[1]) :]).max(axis=2) > 40).sum() > SWATCH


def test_the_panel_says_what_cannot_be_chosen(screen: Screen) -> None:
    assert screen.changed("kd-tree", "before", "sidebar") > SWATCH


def test_a_mesh_of_the_tree_can_be_undone(screen: Screen) -> None:
    assert screen.changed("mesh", "mesh-before") > 50 * SWATCH
    before, after = (
        OpenImageIO.ImageBuf(str(screen.folder / f"{name}.png")) for name in ("mesh-before", "mesh-undone")
    )
    x, y, width, height = screen.report["viewport"]
    top = before.spec().height - y - height
    area = OpenImageIO.ROI(x, screen.report["sidebar"][0], top, top + height * 3 // 4, 0, 1, 0, 3)
    result = OpenImageIO.ImageBufAlgo.compare(before, after, 0.02, 0.02, roi=area)
    assert result.nfail <= 0.001 * width * height
    assert screen.report["trees"], "undo leaves the built tree"


def test_escape_ends_a_build(screen: Screen) -> None:
    assert screen.report["builds"] == 1, "it runs in a thread of its own while the window goes on"
    assert screen.report["escaped"], "and leaves the tree that was there"


def test_the_tree_of_what_is_deleted_is_not_drawn(screen: Screen) -> None:
    assert screen.kind("not-deleted", Kind.LEFT) > SWATCH < screen.kind("undeleted", Kind.LEFT)
    assert screen.kind("deleted", Kind.LEFT) < 20 and screen.kind("deleted", Kind.LEAF_BOX) < 20
    assert screen.changed("deleted", "not-deleted", "sidebar") > 200, "the panel says so"


def test_the_render_properties_have_the_same_choices(screen: Screen) -> None:
    assert screen.changed("properties", "undeleted", "properties") > 10 * SWATCH
