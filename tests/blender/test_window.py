"""The installed extension in a window: what a person sees after the panel's Render button, and the report's."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np

from tests.blender.real import BUNNY, INSIDE, PROJECT, blender, install_into, lacking, read, run
from tools.real_blender import Unavailable

WIDTH, HEIGHT = 480, 360


def window_command(*arguments: object) -> list[str]:
    try:
        return blender().window_command(*arguments)
    except Unavailable as error:
        lacking(str(error))


def test_buttons_are_clicked_and_escape_ends_a_report(tmp_path: Path) -> None:
    profile, report = tmp_path / "profile", tmp_path / "report.json"
    script = ["--python", INSIDE / "report_window.py", "--", tmp_path, report]
    in_a_window = window_command("--enable-event-simulate", "--window-maximized", BUNNY, *script)
    install_into(profile)
    done = run(in_a_window, profile)
    assert report.exists(), done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    told = json.loads(report.read_text())
    assert told["built"] > 60_000 and told["rendered"] == ["complete"] and told["compared"] == "bvh"
    assert told["steps"] > 1, "Blender went on while it was written"
    assert "Incomplete" not in (tmp_path / "whole" / "index.html").read_text()
    assert "Incomplete: cancelled" in Path(told["ended"], "index.html").read_text()


def test_the_image_editor_shows_the_picture(tmp_path: Path) -> None:
    """Pixel by pixel, at scale 1, where the picture is opaque (elsewhere Blender draws its chequers). Another render is
    left by Esc."""
    profile, shot, report, image = (tmp_path / name for name in ("profile", "shot.png", "report.json", "bunny.png"))
    script = ["--python", INSIDE / "window.py", "--", shot, report, WIDTH, HEIGHT]
    in_a_window = window_command("--window-maximized", BUNNY, *script)
    install_into(profile)

    done = run(in_a_window, profile)
    assert report.exists(), done.stdout + done.stderr
    shutil.copy(shot, PROJECT / "build" / "window.png")  # for a person to look at

    arguments = ["--scene", str(BUNNY), "--size", str(WIDTH), str(HEIGHT), "--output", str(image)]
    assert run([sys.executable, "-m", "addon.blender.command_line", "render", *arguments]).returncode == 0
    picture, screen = read(image).astype(int), read(shot).astype(int)[..., :3]
    opaque = picture[..., 3] == 255
    assert np.ptp(picture[opaque]) > 128, "a picture of something"

    told = json.loads(report.read_text())
    assert told["long"] == ["cancelled"]
    place = told["place"]
    left = place["x"] + (place["width"] - WIDTH) // 2
    top = screen.shape[0] - place["y"] - (place["height"] + HEIGHT) // 2
    shown = screen[top : top + HEIGHT, left : left + WIDTH]
    assert np.abs(shown - picture[..., :3])[opaque].max() <= 1
