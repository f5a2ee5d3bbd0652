"""The packaged extension in a real Blender, installed as a person installs it, against the bpy wheel."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.blender.real import BUNNY, INSIDE, blender, blender_that_writes_files, install_into, read, run

WIDTH, HEIGHT = 160, 120


@pytest.fixture(scope="module")
def profile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of settings that was empty before the extension was installed into it, and enabled."""
    folder = tmp_path_factory.mktemp("settings") / "profile"
    install_into(folder)
    return folder


@pytest.fixture(scope="module")
def from_the_wheel(tmp_path_factory: pytest.TempPathFactory) -> NDArray[np.uint8]:
    """The same scene by the command line under the bpy wheel."""
    image = tmp_path_factory.mktemp("wheel") / "bunny.png"
    done = run([sys.executable, "-m", "addon.blender.command_line", *render_arguments(image)])
    assert done.returncode == 0, done.stderr
    picture = read(image)
    assert picture.shape[:2] == (HEIGHT, WIDTH)
    assert np.ptp(picture[..., :3]) > 128, "a picture of something"
    return picture


def render_arguments(image: Path, scene: Path = BUNNY) -> list[str]:
    return ["render", "--scene", str(scene), "--size", str(WIDTH), str(HEIGHT), "--output", str(image)]


def assert_same_but_for_rounding(found: NDArray[np.uint8], expected: NDArray[np.uint8]) -> None:
    """Equal within the last bit of eight: each of two libraries rounds its own sRGB curve."""
    assert found.shape == expected.shape
    difference = np.abs(found.astype(int) - expected.astype(int))
    assert difference.max() <= 1, f"{np.count_nonzero(difference > 1)} values differ, by up to {difference.max()}"


def test_the_command_line(profile: Path, from_the_wheel: NDArray[np.uint8], tmp_path: Path) -> None:
    image = tmp_path / "bunny.png"
    done = run(blender_that_writes_files().command("--command", "bih", *render_arguments(image)), profile)
    assert done.returncode == 0, done.stderr
    assert_same_but_for_rounding(read(image), from_the_wheel)


@pytest.mark.parametrize("again", [[], ["again"]], ids=["registered once", "registered three times"])
def test_f12(again: list[str], profile: Path, from_the_wheel: NDArray[np.uint8], tmp_path: Path) -> None:
    image = tmp_path / "bunny.png"
    script = ["--python-exit-code", "1", "--python", INSIDE / "render.py", "--", image, WIDTH, HEIGHT, *again]
    done = run(blender().command("--background", BUNNY, *script), profile)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert_same_but_for_rounding(read(image), from_the_wheel)


def test_an_error_is_one_line_and_exit_status_1(profile: Path, tmp_path: Path) -> None:
    arguments = render_arguments(tmp_path / "never.png", tmp_path / "nowhere.blend")
    done = run(blender().command("--command", "bih", *arguments), profile)
    assert done.returncode == 1
    assert len(lines := done.stderr.splitlines()) == 1, done.stderr
    assert "nowhere.blend" in lines[0]
    assert not list(tmp_path.iterdir())


def test_wrong_usage_is_exit_status_2(profile: Path, tmp_path: Path) -> None:
    done = run(
        blender().command("--command", "bih", *render_arguments(tmp_path / "never.png"), "--size", "0", "9"), profile
    )
    assert done.returncode == 2, done.stdout + done.stderr
    assert not list(tmp_path.iterdir())


def test_the_report_needs_nothing_but_the_extension(profile: Path, tmp_path: Path) -> None:
    """Its plots come from the wheels in the zip, which Blender itself does not have."""
    folder = tmp_path / "report"
    arguments = ["report", "--scene", BUNNY, "--only", "hits,left-out", "--quick", "--rays", 200, "--rounds", 1]
    bars = ["--max-wrong", 0, "--max-leaks", 0]
    done = run(blender().command("--command", "bih", *arguments, *bars, "--output", folder), profile)
    assert done.returncode == 0, done.stdout + done.stderr
    page = (folder / "index.html").read_text()
    assert "<svg" in page and "What was left out" in page
    assert not re.findall(r"""<script|(?:src|href)\s*=\s*["'](?!data:|#)""", page)
    results = json.loads((folder / "results.json").read_text())
    assert results["machine"]["pygal"] == "3.1.3"
    rows = {row["name"]: row for row in results["hits"]["rows"]}
    for name in ("BIH watertight", "Blender's BVHTree"):
        assert rows[name]["rays"] > 150 and not rows[name]["missing"]
    assert rows["BIH watertight"]["missed"] == rows["BIH watertight"]["leaks"] == 0
    absent = [row for row in rows.values() if row["missing"]]
    assert all(f"{row['name']}: left out, {row['missing']}" in page for row in absent)
