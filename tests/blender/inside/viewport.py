"""In a window: the 3D viewport in Rendered mode, orbited, with an object moved and edited; screenshots of each.

Arguments: FOLDER. report.json there says where the viewport's region is in the window, and is written last.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
from mathutils import Quaternion

PAUSE = 0.1
PAUSES_BETWEEN_LOOKS = 8
PATIENCE = 60
last_shot: list[bytes] = []
(folder,) = map(Path, sys.argv[sys.argv.index("--") + 1 :])


def viewport() -> bpy.types.Area:
    areas = bpy.context.window_manager.windows[0].screen.areas
    return max((area for area in areas if area.type == "VIEW_3D"), key=lambda area: area.width * area.height)


def region() -> bpy.types.Region:
    return next(region for region in viewport().regions if region.type == "WINDOW")


def screen(name: str) -> bytes:
    subprocess.run(["import", "-window", "root", folder / name], check=True)
    return (folder / name).read_bytes()


def shot(name: str) -> Iterator[None]:
    """Wait until the screen is another one than at the last shot, and stays as it is: then it is what is meant."""
    before = last_shot[-1] if last_shot else b""
    earlier = b""
    for _ in range(PATIENCE):
        for _ in range(PAUSES_BETWEEN_LOOKS):
            yield
        now = screen("now.ppm")
        if now == earlier != before:
            break
        earlier = now
    last_shot.append(now)
    screen(f"{name}.png")


def steps() -> Iterator[None]:
    window = bpy.context.window_manager.windows[0]
    scene = window.scene
    scene.render.engine = "BIH_PREVIEW"
    scene.bih.viewport_samples = 4
    space = viewport().spaces[0]
    space.overlay.show_overlays = False
    space.show_gizmo = False
    space.shading.type = "SOLID"
    yield from shot("solid")
    space.shading.type = "RENDERED"
    yield from shot("rendered")
    space.region_3d.view_perspective = "PERSP"
    space.region_3d.view_rotation = Quaternion((0.0, 0.0, 1.0), 0.6) @ space.region_3d.view_rotation
    yield from shot("orbited")
    owner = next(owner for owner in scene.objects if owner.type == "MESH")
    owner.location.z += 0.5 * max(owner.dimensions)
    yield from shot("moved")
    where = {name: getattr(region(), name) for name in ("x", "y", "width", "height")}
    (folder / "report.json").write_text(json.dumps(where))


def next_step() -> float | None:
    more = False
    try:
        more = next(script, "the end") is None
    finally:  # an error ends the timer, and Blender would stay open
        if not more:
            bpy.ops.wm.quit_blender()
    return PAUSE if more else None


script = steps()
bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(next_step, first_interval=1.0)
