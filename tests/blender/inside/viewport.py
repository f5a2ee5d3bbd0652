"""In a window: the 3D viewport in Rendered mode, orbited, with an object moved; then disturbed in every way, often.

Arguments: FOLDER ROUNDS. A screenshot of each step lies there. report.json says what they show, and how much memory
Blender had after 5 rounds and at the end; it is written last.
"""

import gc
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import addon_utils
import bpy
import window_steps as w
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Quaternion

MODULE = "bl_ext.user_default.bih"
PAUSES_BETWEEN_LOOKS = 6
PATIENCE = 400
BORDER = (0.3, 0.52), (0.35, 0.58)
folder, rounds = sys.argv[sys.argv.index("--") + 1 :]
report: dict[str, object] = {"shots": {}, "pages": []}
last_shot: list[bytes] = []


def region() -> bpy.types.Region:
    return w.region(w.area("VIEW_3D"))


def scene() -> bpy.types.Scene:
    return w.window().scene


def owner() -> bpy.types.Object:
    return scene().objects["Bunny"]


def show(kind: str) -> None:
    w.area("VIEW_3D").spaces[0].shading.type = kind


def screen(name: str) -> bytes:
    path = Path(folder, name)
    w.shot(path)
    return path.read_bytes()


def viewports() -> list:
    """Those of the engine that trace now: nobody else knows whether the last sample is there."""
    return [found for found in gc.get_objects() if type(found).__name__ == "Viewport" and hasattr(found, "_is_behind")]


def shot(name: str) -> Iterator[None]:
    """Wait until the screen is another one than at the last shot, and stays as it is: then it is what is meant."""
    before = last_shot[-1] if last_shot else b""
    earlier = now = b""
    for _ in range(PATIENCE):
        for _ in range(PAUSES_BETWEEN_LOOKS):
            yield
        if any(viewport._is_behind() for viewport in viewports()):
            continue
        now = screen("now.ppm")
        if now == earlier != before:
            break
        earlier = now
    last_shot.append(now)
    screen(f"{name}.png")
    seen = w.area("VIEW_3D").spaces[0].region_3d
    report["shots"][name] = {
        "view": [list(row) for row in seen.view_matrix],
        "window": [list(row) for row in seen.window_matrix],
        "object": [list(row) for row in owner().matrix_world] if "Bunny" in scene().objects else [],
        "place": {name: getattr(region(), name) for name in ("x", "y", "width", "height")},
    }


def set_up() -> None:
    scene().render.engine = "BIH_PREVIEW"
    scene().render.dither_intensity = 0.0  # dither would change the last bit on purpose
    scene().bih.viewport_samples = 3
    space = w.area("VIEW_3D").spaces[0]
    space.overlay.show_overlays = False
    space.show_gizmo = False


def look_through_the_camera() -> None:
    """Of the scene, whose own border counts there."""
    w.area("VIEW_3D").spaces[0].region_3d.view_perspective = "CAMERA"
    render = scene().render
    render.border_min_x, render.border_max_x = BORDER[0]
    render.border_min_y, render.border_max_y = BORDER[1]
    render.use_border, render.preview_pixel_size = True, "1"


def frame() -> list[list[float]]:
    """Corners of the scene's picture, in pixels of the region."""
    camera, seen = scene().camera, w.area("VIEW_3D").spaces[0].region_3d
    corners = (camera.matrix_world.normalized() @ corner for corner in camera.data.view_frame(scene=scene()))
    return [list(location_3d_to_region_2d(region(), seen, corner)) for corner in corners]


def move() -> None:
    owner().location.z += 0.1


def undo() -> None:
    with w.within(w.area("VIEW_3D")):
        bpy.ops.ed.undo_push(message="Before")
        move()
        bpy.ops.ed.undo_push(message="Moved")
        assert bpy.ops.ed.undo() == {"FINISHED"}


def delete() -> None:
    bpy.data.objects.remove(owner())


def edit() -> None:
    for vertex in owner().data.vertices[:100]:
        vertex.co.z += 0.1
    owner().data.update()


def reload_scripts() -> None:
    addon_utils.disable(MODULE)
    addon_utils.enable(MODULE)


def other_engine() -> None:
    scene().render.engine = "BLENDER_WORKBENCH"


def open_again() -> None:
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)


DISTURBED_BY = (
    move,
    edit,
    undo,
    reload_scripts,
    other_engine,
    delete,
    open_again,
)


def pages() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1])


def steps() -> Iterator[None]:
    set_up()
    show("SOLID")
    yield from shot("solid")
    show("RENDERED")
    yield from shot("rendered")
    seen = w.area("VIEW_3D").spaces[0].region_3d
    seen.view_rotation = Quaternion((0.0, 0.0, 1.0), 0.6) @ seen.view_rotation
    yield from shot("orbited")
    owner().location.z += 0.3 * max(owner().dimensions)
    yield from shot("moved")
    space = w.area("VIEW_3D").spaces[0]
    space.render_border_min_x, space.render_border_max_x = BORDER[0]
    space.render_border_min_y, space.render_border_max_y = BORDER[1]
    space.use_render_border = True
    yield from shot("border")
    space.use_render_border = False
    scene().render.preview_pixel_size = "4"
    yield from shot("large pixels")
    look_through_the_camera()
    yield from shot("camera border")
    report["frame"] = frame()
    for mesh in [found for found in scene().objects if found.type == "MESH"]:
        bpy.data.objects.remove(mesh)
    yield from shot("all deleted")
    open_again()
    yield
    for number in range(int(rounds)):
        set_up()
        show("RENDERED")
        yield
        DISTURBED_BY[number % len(DISTURBED_BY)]()
        yield
        show("SOLID")
        open_again()
        yield
        if number + 1 in (5, int(rounds)):
            report["pages"].append(pages())
    set_up()
    show("SOLID")
    yield from shot("solid again")
    show("RENDERED")
    yield from shot("rendered again")
    report["pid"] = os.getpid()
    Path(folder, "report.json").write_text(json.dumps(report))


w.run(steps(), pause=0.05, persistent=True)
