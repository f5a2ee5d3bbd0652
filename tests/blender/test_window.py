"""The installed extension in a window: what a person sees after the panel's Render button."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np

from tests.blender.real import BUNNY, INSIDE, PROJECT, blender, extension, lacking, read, run
from tools.real_blender import Unavailable

WIDTH, HEIGHT = 480, 360


def test_the_image_editor_shows_the_picture(tmp_path: Path) -> None:
    """Pixel by pixel, at scale 1, where the picture is opaque (elsewhere Blender draws its chequers)."""
    profile, shot, report, image = (tmp_path / name for name in ("profile", "shot.png", "report.json", "bunny.png"))
    profile.mkdir()
    script = ["--python", INSIDE / "window.py", "--", shot, report, WIDTH, HEIGHT]
    try:
        in_a_window = blender().window_command("--window-maximized", BUNNY, *script)
    except Unavailable as error:
        lacking(str(error))
    install = ["--command", "extension", "install-file", "-r", "user_default", "--enable", extension()]
    assert run(blender().command(*install), profile).returncode == 0

    done = run(in_a_window, profile)
    assert report.exists(), done.stdout + done.stderr
    shutil.copy(shot, PROJECT / "build" / "window.png")  # for a person to look at

    arguments = ["--scene", str(BUNNY), "--size", str(WIDTH), str(HEIGHT), "--output", str(image)]
    assert run([sys.executable, "-m", "addon.blender.command_line", "render", *arguments]).returncode == 0
    picture, screen = read(image).astype(int), read(shot).astype(int)[..., :3]
    opaque = picture[..., 3] == 255
    assert np.ptp(picture[opaque]) > 128, "a picture of something"

    place = json.loads(report.read_text())
    left = place["x"] + (place["width"] - WIDTH) // 2
    top = screen.shape[0] - place["y"] - (place["height"] + HEIGHT) // 2
    shown = screen[top : top + HEIGHT, left : left + WIDTH]
    assert np.abs(shown - picture[..., :3])[opaque].max() <= 1
