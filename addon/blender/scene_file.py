"""A file as SceneData: what a render of it would show, without rendering it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import bpy

from ..pipeline.camera import framing_view
from ..pipeline.errors import UserError
from ..pipeline.looks import Reading
from ..pipeline.mesh import bounds_of
from ..pipeline.scene import SceneData
from ..pipeline.settings import Settings
from .camera import picture_size
from .export import scene_data
from .importers import import_mesh, reason
from .properties import settings_of
from .quiet import quiet

BLEND_MAGIC = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")
"""Plain, compressed by Zstandard (Blender 3.0 and later), compressed by gzip (before)."""


def read_blend(
    path: Path,
    *,
    frame: int | None = None,
    size: tuple[int, int] | None = None,
    chosen: Mapping[str, Any] | None = None,
    passes: Collection[str] = (),
) -> tuple[SceneData, Settings, float]:
    """The active scene of a .blend as F12 sees it, the settings saved in it with what is `chosen` in their place, and
    the seconds its export took. What neither the settings' passes nor `passes` show is not read.

    No script of the file is run. `size` in pixels; None: the scene's own. Raises UserError.
    """
    _check_header(path)
    try:
        with quiet():
            bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        raise UserError(f"{path}: Blender cannot open it ({reason(error)})") from None
    scene = bpy.context.scene
    if frame is not None:
        scene.frame_set(frame)
    if scene.camera is None:
        raise UserError(f"{path}: scene {scene.name!r} has no camera. Add one (Add > Camera) and save the file again.")
    settings = replace(settings_of(scene), **(chosen or {}))
    width, height = size or _size_of(scene)
    reading = Reading.of(settings, {*settings.passes, *passes})
    exported, seconds = rendered_scene(scene, width, height, reading)
    return replace(exported, skipped=(*_missing_libraries(), *exported.skipped)), settings, seconds


def read_mesh_file(path: Path, width: int, height: int) -> tuple[SceneData, float]:
    """What Blender's importer makes of a mesh file, framed by a camera of ours, and the seconds its export took."""
    if not path.is_file():
        raise UserError(f"mesh file {path} does not exist")
    import_mesh(path)
    scene = bpy.context.scene
    # a render needs some camera; the one that takes the picture follows from what was imported
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    exported, seconds = rendered_scene(scene, width, height)
    if not exported.triangle_count:
        raise UserError(f"{path}: no triangles in it")
    for mesh in exported.meshes:
        mesh.check_finite()
    vertices, _ = exported.flatten()
    view = framing_view(bounds_of(vertices), width, height)
    # A mesh file says nothing of a world: what Blender starts with is not shown behind it.
    return replace(exported, name=path.stem, camera=view, world=None), seconds


def rendered_scene(
    scene: bpy.types.Scene, width: int, height: int, reading: Reading | None = None
) -> tuple[SceneData, float]:
    """The scene with the objects, modifiers and levels of a final render, and the seconds its export took; of their
    looks what `reading` says.

    Only a render has such a depsgraph, so an engine that does nothing but export stands in for one.
    """
    caught: list[tuple[SceneData, float]] = []
    failed: list[BaseException] = []

    class ExportEngine(bpy.types.RenderEngine):
        bl_idname = "BIH_EXPORT"
        bl_label = "BIH Export"

        def render(self, depsgraph: bpy.types.Depsgraph) -> None:
            try:
                started = perf_counter()
                exported = scene_data(depsgraph, width, height, reading=reading)
                caught.append((exported, perf_counter() - started))
            except BaseException as error:  # noqa: BLE001 - raised below: Blender would print it and go on
                failed.append(error)

    layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    others = [other for other in scene.view_layers if other.use and other != layer]
    layer.use = True
    render = scene.render
    # scene_data goes by the size it is given; Blender refuses to render anything smaller, for some file formats
    render.resolution_x, render.resolution_y, render.resolution_percentage = max(width, 16), max(height, 16), 100
    render.use_border = render.use_compositing = render.use_sequencer = render.use_multiview = False
    bpy.utils.register_class(ExportEngine)
    try:
        render.engine = ExportEngine.bl_idname
        with quiet():
            bpy.ops.render.render(scene=scene.name, layer=layer.name)
    except RuntimeError as error:
        raise UserError(f"scene {scene.name!r}: Blender cannot render it ({reason(error)})") from None
    finally:
        bpy.utils.unregister_class(ExportEngine)
    if failed:
        raise failed[0]
    exported, seconds = caught[0]
    notes = [f"view layer {other.name!r}: only {layer.name!r} is traced" for other in others]
    return replace(exported, skipped=(*exported.skipped, *notes)), seconds


def _check_header(path: Path) -> None:
    try:
        with path.open("rb") as file:
            start = file.read(7)
    except FileNotFoundError:
        raise UserError(f"scene file {path} does not exist") from None
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from None
    if not start.startswith(BLEND_MAGIC):
        raise UserError(f"{path}: not a .blend file")


def _size_of(scene: bpy.types.Scene) -> tuple[int, int]:
    width, height = picture_size(scene, least=0)
    if width < 1 or height < 1:
        raise UserError(
            f"scene {scene.name!r} has a picture of {width} x {height} pixels. Give --size, or save a larger one."
        )
    return width, height


def _missing_libraries() -> list[str]:
    return [
        f"linked file {library.filepath} is missing"
        for library in bpy.data.libraries
        if not Path(bpy.path.abspath(library.filepath)).exists()
    ]
