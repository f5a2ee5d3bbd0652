"""Every test here starts from an empty scene, and leaves the add-on unregistered."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest

from addon.blender import classes


@pytest.fixture
def scene() -> bpy.types.Scene:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy.context.scene


@pytest.fixture
def registered(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """The scene, with the add-on registered while the test runs."""
    with classes.registered():
        yield scene


@pytest.fixture
def out(tmp_path: Path) -> Path:
    folder = tmp_path / "out"
    folder.mkdir()
    return folder
