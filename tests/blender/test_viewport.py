"""Rendered mode in a window: what is on the screen is what the pipeline traces of that view, and nothing ends it."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import pytest
from numpy.typing import NDArray

from addon.blender.job import Source
from addon.blender.job import read as read_source
from addon.pipeline.camera import CameraView
from addon.pipeline.image import to_srgb8
from addon.pipeline.session import Session
from addon.pipeline.settings import Settings
from tests.blender.real import BUNNY, INSIDE, PROJECT, SECONDS, install_into, once, read, run
from tests.blender.test_window import window_command

ROUNDS = 50 if os.environ.get("BIHTREE_STRESS") else 16
"""Each of the eight disturbances twice; memory after 50 renders and 50 sessions is asserted elsewhere."""
SAMPLES = 3
MARGIN = (100, 80)
"""Pixels left out at each side, and at the top and bottom: Blender's buttons lie over the picture there."""

STEPS = (
    *("solid", "rendered", "orbited", "moved", "border", "large pixels", "camera border", "all deleted"),
    *("solid again", "rendered again"),
)
BORDER = np.array([(0.3, 0.35), (0.52, 0.58)])
"""That of inside/viewport.py: lower left and upper right, as shares of the whole."""


@pytest.fixture(scope="module")
def session() -> tuple[dict[str, Any], Path]:
    """What one session in a window leaves: its report, and the folder of its screenshots."""
    folder = once("viewport", in_a_window)
    return json.loads((folder / "report.json").read_text()), folder


def in_a_window(folder: Path) -> None:
    command = window_command("--window-maximized", BUNNY, "--python", INSIDE / "viewport.py", "--", folder, ROUNDS)
    install_into(folder / "profile")
    done = run(command, folder / "profile")
    assert (folder / "report.json").exists(), done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    kept = PROJECT / "build" / "screenshots"  # for a person to look at
    kept.mkdir(parents=True, exist_ok=True)
    for name in STEPS:
        shutil.copy(folder / f"{name}.png", kept / f"viewport {name}.png")
    shutil.copy(folder / "report.json", kept / "viewport.json")


def middle(session: tuple[dict[str, Any], Path], name: str) -> NDArray[np.uint8]:
    """(H, W, 3) the viewport of a screenshot, without its margin; first row at the top."""
    report, folder = session
    place = report["shots"][name]["place"]
    screen = read(folder / f"{name}.png")[..., :3]
    top = screen.shape[0] - place["y"] - place["height"]
    rows = slice(top + MARGIN[1], top + place["height"] - MARGIN[1])
    return screen[rows, place["x"] + MARGIN[0] : place["x"] + place["width"] - MARGIN[0]]


def traced(session: tuple[dict[str, Any], Path], name: str, *, pixel_size: int = 1) -> NDArray[np.uint8]:
    """(H, W, 4) the same part as the pipeline makes it, from the wheel's export and the matrices of the window."""
    shot = session[0]["shots"][name]
    scene, _, _ = read_source(Source(BUNNY, None))
    matrices = scene.instance_matrix.copy()
    row = [scene.meshes[mesh].name for mesh in scene.instance_mesh].index("Bunny")
    matrices[row] = shot["object"]
    to_clip = np.array(shot["window"]) @ np.array(shot["view"])
    size = shot["place"]["width"], shot["place"]["height"]
    view = CameraView(np.linalg.inv(to_clip), *size, near=0.1, perspective=True)
    running = Session()
    running.show(replace(scene, instance_matrix=matrices), Settings(), view, samples=SAMPLES, pixel_size=pixel_size)
    assert running.wait(SECONDS, until_last=True) and running.shown, running.problem
    picture = to_srgb8(enlarged(running.shown.pixels, *size))[::-1]
    running.stop()
    return picture[MARGIN[1] : -MARGIN[1], MARGIN[0] : -MARGIN[0]]


def enlarged(pixels: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """As a texture is drawn over so many pixels: in between its own it is linear."""
    for axis, side in enumerate((height, width)):
        count = pixels.shape[axis]
        places = np.clip((np.arange(side) + 0.5) * count / side - 0.5, 0, count - 1)
        lower = places.astype(int)
        share = (places - lower).reshape([-1 if a == axis else 1 for a in range(3)]).astype(np.float32)
        upper = np.minimum(lower + 1, count - 1)
        pixels = np.take(pixels, lower, axis) * (1 - share) + np.take(pixels, upper, axis) * share
    return pixels


@pytest.mark.parametrize("name", ["rendered", "orbited", "moved", "rendered again"])
def test_the_screen_shows_what_is_traced(session, name):
    """Where there is light; half floats and two conversions to sRGB are apart by a step or two of 255, and at an edge a
    ray may go by on the other side, because the matrices are multiplied in another order."""
    shown, picture = middle(session, name), traced(session, name)
    lit = (picture[..., 3] == 255) & (picture[..., :3] > 0).any(axis=2)
    assert lit.sum() > 5000 and np.ptp(picture[lit]) > 128, "a picture of something"
    difference = np.abs(shown.astype(int) - picture[..., :3])[lit]
    assert np.quantile(difference, 0.99) <= 2 and difference.mean() < 0.5


@pytest.mark.parametrize("name", ["border", "camera border"])
def test_a_border_leaves_the_rest_out(session, name):
    """Through a camera it is the scene's own, else the viewport's."""
    place = session[0]["shots"][name]["place"]
    corners = np.array([(0, 0), (place["width"], place["height"])], float)
    if name == "camera border":
        frame = np.array(session[0]["frame"])
        corners = np.array([frame.min(axis=0), frame.max(axis=0)])
    (left, bottom), (right, top) = np.round(corners[0] + (corners[1] - corners[0]) * BORDER).astype(int) - MARGIN
    shown, picture = middle(session, name)[::-1], traced(session, name)[::-1]
    lit = (picture[..., 3] == 255) & (picture[..., :3] > 0).any(axis=2)
    is_inside = np.zeros(lit.shape, bool)
    is_inside[bottom:top, left:right] = True
    assert (lit & is_inside).sum() > 2000 and (lit & ~is_inside).sum() > 2000
    difference = np.abs(shown.astype(int) - picture[..., :3]).max(axis=2)
    assert np.quantile(difference[lit & is_inside], 0.98) <= 2
    rest = shown[~is_inside]
    assert (np.ptp(rest[:, :3], axis=1) == 0).mean() > 0.9, "Blender's own grey"
    assert np.median(difference[lit & ~is_inside]) > 5


def test_large_pixels_are_one_ray_each(session):
    """As the pipeline shows them, drawn larger, with what lies between them."""
    shown, picture = middle(session, "large pixels"), traced(session, "large pixels", pixel_size=4)
    lit = (picture[..., 3] == 255) & (picture[..., :3] > 0).any(axis=2)
    assert lit.sum() > 5000
    assert np.quantile(np.abs(shown.astype(int) - picture[..., :3])[lit], 0.95) <= 2


@pytest.mark.parametrize(("name", "other"), [("rendered", "solid"), ("orbited", "rendered"), ("moved", "orbited")])
def test_each_step_changes_the_picture(session, name, other):
    a, b = (OpenImageIO.ImageBuf(np.ascontiguousarray(middle(session, step))) for step in (name, other))
    compared = OpenImageIO.ImageBufAlgo.compare(a, b, 0.1, 0.05)
    assert compared.nfail > 2000


def test_what_is_deleted_is_not_seen(session):
    """Nor is anything else, where no mesh is left: Blender's own greys, within the camera's frame and around it."""
    shares = [np.bincount(middle(session, name)[..., 0].ravel()) for name in ("large pixels", "all deleted")]
    before, after = (np.sort(counts)[-2:].sum() / counts.sum() for counts in shares)
    assert after > 0.999 > 0.99 > before


def test_after_all_that_the_picture_is_the_first_one(session):
    """Files opened again, objects moved, edited and deleted, undo, engines switched and the add-on reloaded while the
    view is traced: in the same view the same picture comes as at first."""
    a, b = (
        OpenImageIO.ImageBuf(np.ascontiguousarray(middle(session, step))) for step in ("rendered", "rendered again")
    )
    compared = OpenImageIO.ImageBufAlgo.compare(a, b, 1 / 255, 1 / 255)
    assert compared.nfail == 0


def test_no_memory_is_left_behind(session):
    after_5, at_the_end = session[0]["pages"]
    assert at_the_end <= 1.05 * after_5
