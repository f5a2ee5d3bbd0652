"""The real Blender and the packaged extension, for the tests that need them."""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NoReturn
from uuid import uuid4

import numpy as np
import OpenImageIO
import pytest
from numpy.typing import NDArray

from tools import real_blender
from tools.real_blender import RealBlender

PROJECT = Path(__file__).resolve().parents[2]
INSIDE = Path(__file__).parent / "inside"
BUNNY = PROJECT / "examples" / "bunny.blend"
RUN = os.environ.get("PYTEST_XDIST_TESTRUNUID") or str(uuid4())
"""The same for all processes that share one run of the tests."""
SECONDS = 300
"""Longer than anything here takes; a Blender that hangs is a failure, not a wait."""


def blender() -> RealBlender:
    """The real Blender; the test is skipped where there is none, or fails where continuous integration needs it."""
    try:
        return real_blender.find()
    except real_blender.Unavailable as error:
        lacking(str(error))


def blender_that_writes_files() -> RealBlender:
    """The same, with OpenImageIO: Blender's own builds have it from 4.5 on, Debian's package where it is installed."""
    found = blender()
    if run(found.command("--background", "--python-exit-code", 1, "--python-expr", "import OpenImageIO")).returncode:
        lacking("the Python module OpenImageIO in Blender: Blender 4.5 or later has it, Debian's python3-openimageio")
    return found


def lacking(what: str) -> NoReturn:
    if os.environ.get("CI"):
        pytest.fail(f"CI is set, and this is missing: {what}")
    pytest.skip(f"missing: {what}")


def once(name: str, fill: Callable[[Path], None]) -> Path:
    """A folder in build/tests that `fill` fills, once for all processes of a test run."""
    folder = PROJECT / "build" / "tests" / name
    folder.parent.mkdir(parents=True, exist_ok=True)
    with folder.with_suffix(".run").open("a+") as made:
        fcntl.flock(made, fcntl.LOCK_EX)
        made.seek(0)
        if made.read() != RUN:
            made.truncate(0)
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            fill(folder)
            made.write(RUN)
    return folder


@cache
def extension() -> Path:
    """The zip that `make package` makes, of the sources as they are now."""
    return Path((once("extension", _package) / "path.txt").read_text())


def install_into(profile: Path) -> None:
    """The extension, enabled in settings that were empty before."""
    shutil.copytree(once("installed", _install), profile)


def _package(folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, PROJECT / "tools" / "package.py"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (folder / "path.txt").write_text(done.stdout.strip())


def _install(profile: Path) -> None:
    done = run(
        blender().command("--command", "extension", "install-file", "-r", "user_default", "--enable", extension()),
        profile,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def run(command: list[str], profile: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The command in the project's folder, with Blender's settings in `profile`; its output is text."""
    settings = {"BLENDER_USER_RESOURCES": str(profile)} if profile else {}
    return subprocess.run(
        command, cwd=PROJECT, env=os.environ | settings, capture_output=True, text=True, check=False, timeout=SECONDS
    )


def read(path: Path) -> NDArray[np.uint8]:
    """(height, width, channels) as the file holds them, first row at the top."""
    image = OpenImageIO.ImageBuf(str(path))
    assert not image.has_error, image.geterror()
    assert image.spec().format == OpenImageIO.UINT8
    return np.asarray(image.get_pixels(OpenImageIO.UINT8))
