"""Mesh files that Blender itself can read."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..pipeline.errors import UserError
from .quiet import quiet

IMPORTERS: dict[str, tuple[str, ...]] = {
    ".obj": ("wm.obj_import",),
    ".ply": ("wm.ply_import",),
    ".stl": ("wm.stl_import",),
    ".gltf": ("import_scene.gltf",),
    ".glb": ("import_scene.gltf",),
    ".fbx": ("wm.fbx_import", "import_scene.fbx"),
    ".usd": ("wm.usd_import",),
    ".usda": ("wm.usd_import",),
    ".usdc": ("wm.usd_import",),
    ".usdz": ("wm.usd_import",),
    ".abc": ("wm.alembic_import",),
    ".dae": ("wm.collada_import",),
    ".x3d": ("import_scene.x3d",),
    ".wrl": ("import_scene.x3d",),
}
"""File name ending to import operators, newest first: Blenders differ in which they have."""

OPTIONS = {"wm.alembic_import": {"as_background_job": False}}


def import_mesh(path: Path) -> None:
    """Read `path` into an empty scene, which becomes the context's. Raises UserError."""
    operator = _operator(path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    category, name = operator.split(".")
    try:
        with quiet():
            outcome = getattr(getattr(bpy.ops, category), name)(
                filepath=str(path.absolute()), **OPTIONS.get(operator, {})
            )
    except RuntimeError as error:
        raise UserError(f"{path}: Blender cannot read it ({reason(error)})") from None
    if "FINISHED" not in outcome:
        raise UserError(f"{path}: Blender cannot read it as a {path.suffix.lower()} file")


def reason(error: RuntimeError) -> str:
    """What Blender reported, in one line; of a traceback from one of its own scripts, the exception."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if any(line.startswith("Traceback") for line in lines):
        lines = [line for line in lines if not line.startswith(("Location:", "Error: Python:"))][-1:]
    return lines[0].removeprefix("Error: ") if lines else type(error).__name__


def _operator(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in IMPORTERS:
        known = ", ".join([".npz", *IMPORTERS])
        raise UserError(f"{path}: {suffix or 'a file without an ending'} is no mesh format; known: {known}")
    for operator in IMPORTERS[suffix]:
        if _exists(operator):
            return operator
    raise UserError(f"{path}: this Blender ({bpy.app.version_string}) has no importer for {suffix} files")


def _exists(operator: str) -> bool:
    category, name = operator.split(".")
    return name in dir(getattr(bpy.ops, category))
