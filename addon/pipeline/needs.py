"""What this scene does not need: the part left out, and what that saved."""

from __future__ import annotations

from collections.abc import Collection

from .image import CHANNELS
from .scene import SceneData
from .settings import PASSES, Settings


def left_out(scene: SceneData, settings: Settings, traced: Collection[str]) -> dict[str, str]:
    """Part -> why, with what it saved; `traced` names the passes made. The scene has a camera and triangles."""
    assert scene.camera is not None
    pixels = scene.camera.width * scene.camera.height
    reasons = {
        f"{name} pass": f"not asked for: {4 * len(CHANNELS[name]) * pixels:,} bytes not made"
        for name in PASSES
        if name not in traced
    }
    if not len(scene.lights):
        reasons["shadow rays"] = (
            "no light in the scene: the headlight shines from the camera, so nothing that it sees is in shadow; "
            f"up to {pixels * settings.samples:,} rays not traced"
        )
    elif not settings.shadows:
        saved = pixels * settings.samples * len(scene.lights)
        reasons["shadow rays"] = f"shadows are off: up to {saved:,} rays not traced"
    if not scene.moves:
        vertices = sum(len(scene.meshes[m].vertices) for m in scene.instance_mesh)
        copied = len(scene.instance_mesh) > 1
        reasons["world transform"] = f"no object is moved, turned or scaled: {vertices:,} vertices not transformed" + (
            "" if copied else " and not copied"
        )
    if len(scene.instance_mesh) == 1:
        reasons["instance tree"] = "one mesh, shown once: rays are not moved to a mesh's own space and back"
    return reasons
