"""Running the command, and reading what it wrote."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import OpenImageIO
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-m", "addon.blender.command_line"]


def run(*arguments: object, command: Sequence[str] = COMMAND) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*command, *map(str, arguments)],
        cwd=ROOT,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )


def environment() -> dict[str, str]:
    """That of a person: the module bpy names its own colours to all that this process starts, and Blender 5.2 prints
    a line where it is told of some."""
    return {name: value for name, value in os.environ.items() if name != "OCIO"}


def pixels(path: Path) -> NDArray[np.float32]:
    """(H, W, C) float32, the first row at the top."""
    file = OpenImageIO.ImageInput.open(str(path))
    try:
        return file.read_image(OpenImageIO.FLOAT).reshape(file.spec().height, file.spec().width, -1)
    finally:
        file.close()
