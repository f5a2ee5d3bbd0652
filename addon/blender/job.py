"""One command's work: a file in, pictures and a report out."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..pipeline import image, needs, preview
from ..pipeline.camera import framing_view
from ..pipeline.errors import UserError
from ..pipeline.mesh import bounds_of, read_npz
from ..pipeline.scene import SceneData
from ..pipeline.settings import PASSES, Settings
from . import modules

DEFAULT_SIZE = (1280, 720)


@dataclass(frozen=True)
class Source:
    """A .blend or a mesh file; `frame` and `size` (pixels) in place of the scene's own."""

    scene: Path | None
    mesh: Path | None
    frame: int | None = None
    size: tuple[int, int] | None = None


def run(source: Source, chosen: Mapping[str, Any], outputs: preview.Outputs) -> list[str]:
    """Trace `source` and write `outputs`; `chosen` replaces fields of the settings that the scene was saved with.

    Returns the lines to print. Raises UserError; then no file is written.
    """
    preview.check_outputs(outputs)
    scene, settings, seconds = read(source, chosen, outputs.passes)
    traced = preview.trace(scene, settings, outputs=outputs, export_seconds=seconds, progress=_go_on)
    preview.write(traced, scene, settings, outputs, display=_display(source), progress=_go_on)
    table = needs.lines(traced.report["needs"])
    return [*preview.summary(traced.report), "", *table, *(f"note: {what}" for what in scene.skipped)]


def read(
    source: Source, chosen: Mapping[str, Any] | None = None, passes: Collection[str] = PASSES
) -> tuple[SceneData, Settings, float]:
    """The scene, its settings with what is `chosen` in their place, and the seconds that its export took: of a .blend
    what these passes and those of the settings show. Raises UserError."""
    plain = Settings(**(chosen or {}))
    width, height = source.size or DEFAULT_SIZE
    if source.mesh and source.mesh.suffix.lower() == ".npz":
        return _read_npz(source.mesh, width, height), plain, 0.0
    modules.require("bpy")
    from . import classes, scene_file

    with classes.registered():
        if source.mesh:
            scene, seconds = scene_file.read_mesh_file(source.mesh, width, height)
            return scene, plain, seconds
        assert source.scene
        return scene_file.read_blend(source.scene, frame=source.frame, size=source.size, chosen=chosen, passes=passes)


def _display(source: Source) -> image.Display | None:
    """That of the file, which is open; meshes have none."""
    if not source.scene:
        return None
    import bpy

    from .display import Display

    return Display(bpy.context.scene)


def _read_npz(path: Path, width: int, height: int) -> SceneData:
    mesh = read_npz(path)
    mesh.check_finite()
    if not len(mesh.triangles):
        raise UserError(f"{path}: no triangles in it")
    used = mesh.vertices[mesh.triangles].reshape(-1, 3)
    view = framing_view(bounds_of(used), width, height)
    return SceneData.of_mesh(mesh, view)


def _go_on(stage: str, fraction: float) -> None:
    """Python runs in here while the native code works, and so Ctrl-C arrives."""
