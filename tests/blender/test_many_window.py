"""Many instances in a window: their boxes are seen while they are read, and while a tree is built of them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.pipeline import overlay_style
from addon.pipeline.overlay import Kind
from tests.blender.real import INSIDE, PROJECT, install_into, once, read, run
from tests.blender.test_window import window_command

SCREENSHOTS = PROJECT / "build" / "screenshots"
SHOTS = ("some", "boxes", "traced", "before", "built-boxes", "built")
MARGIN = 20
COUNT = 160 * 160


@pytest.fixture(scope="module")
def session() -> tuple[dict[str, Any], Path]:
    """What one session in a window leaves: its report, and the folder of its screenshots."""
    folder = once("many", in_a_window)
    return json.loads((folder / "report.json").read_text()), folder


def in_a_window(folder: Path) -> None:
    script = ["--python", INSIDE / "many_window.py", "--", folder]
    command = window_command("--enable-event-simulate", "--window-maximized", *script)
    install_into(folder / "profile")
    done = run(command, folder / "profile")
    said = done.stdout + done.stderr
    assert (folder / "report.json").exists(), said
    assert "Traceback" not in said, said
    assert "Not freed" not in said, "a walk over instances was given up"
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    for name in SHOTS:
        shutil.copy(folder / f"{name}.png", SCREENSHOTS / f"many {name}.png")
    shutil.copy(folder / "report.json", SCREENSHOTS / "many.json")


def viewport(session: tuple[dict[str, Any], Path], name: str) -> NDArray[np.int64]:
    """(H, W, 3) without its margin, and the strip at the top where Blender's words are."""
    report, folder = session
    x, y, width, height = report["place"]
    screen = read(folder / f"{name}.png")[..., :3].astype(int)
    top = screen.shape[0] - y - height
    return screen[top + height // 6 : top + height - MARGIN, x + MARGIN : x + width - MARGIN]


def changed(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.bool_]:
    return np.abs(a - b).max(axis=2) > 12


def test_redraws_read_the_scene_part_by_part(session):
    shares = session[0]["shares"]
    assert len(shares) > 5 and shares == sorted(set(shares)) and shares[-1] < 1
    assert session[0]["read_at_once"] > 0, "when the scene changes again its boxes are seen at the next redraw"


def test_boxes_are_seen_before_the_picture(session):
    """First of some, then of all, where the picture then has the cubes; grey, and not as they are shaded."""
    some, boxes, traced = (viewport(session, name) for name in ("some", "boxes", "traced"))
    ground = boxes[0, 0]
    covered = [changed(picture, ground).mean() for picture in (some, boxes)]
    assert 0.02 < 1.3 * covered[0] < covered[1] < 0.9
    assert not (changed(some, ground) & ~changed(boxes, ground)).mean() > 0.001
    assert (changed(traced, ground) & ~changed(boxes, ground)).mean() < 0.01, "a box holds its cube"
    inside = changed(boxes, ground)
    assert np.ptp(boxes[inside], axis=1).max() <= 2, "grey"
    assert changed(boxes, traced).mean() > 0.05


def test_a_build_is_read_part_by_part_and_shows_boxes(session):
    """The overlay's own, which go when the tree is there; Escape ends it before there is one."""
    report = session[0]
    assert 2 < len(report["escaped"]) < len(report["parts"]) and report["parts"] == sorted(set(report["parts"]))
    assert not report["bounds"] and report["triangles"] == 12 * (COUNT + 1)
    colour = np.array(overlay_style.VIEWPORT_COLOURS[Kind.BOX]) * 255
    before, boxes = viewport(session, "before"), viewport(session, "built-boxes")
    near = [(np.abs(picture - colour).max(axis=2) < 60).sum() for picture in (before, boxes)]
    assert near[1] > 10_000 > 10 * near[0]
    planes = np.array(overlay_style.VIEWPORT_COLOURS[Kind.LEFT]) * 255
    blue = [(np.abs(viewport(session, name) - planes).max(axis=2) < 45).sum() for name in ("built-boxes", "built")]
    assert blue[0] < 50 < 500 < blue[1]
