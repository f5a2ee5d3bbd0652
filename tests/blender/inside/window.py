"""In a window: the Render properties beside an Image Editor, render as the panel's button does, take a screenshot.

Arguments: SCREENSHOT REPORT WIDTH HEIGHT. The report, in JSON, says where in the window the Image Editor shows the
picture, and is written last. Blender draws between the calls of a timer, so every step is one call; the last quits.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

PAUSE = 0.5
PATIENCE = 240
screenshot, report, width, height = sys.argv[sys.argv.index("--") + 1 :]
rendered = []


def steps() -> Iterator[None]:
    window = bpy.context.window_manager.windows[0]
    scene = window.scene
    scene.render.engine = "BIH_PREVIEW"
    scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
    scene.render.resolution_percentage = 100
    areas = window.screen.areas
    properties = next(area for area in areas if area.type == "PROPERTIES")
    properties.spaces[0].context = "RENDER"
    editor = max(areas, key=lambda area: area.width * area.height)
    editor.type = "IMAGE_EDITOR"
    yield
    region = next(region for region in properties.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=properties, region=region):
        assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    for _ in range(PATIENCE):
        if rendered:
            break
        yield
    assert rendered == ["complete"]
    editor.spaces[0].image = bpy.data.images["Render Result"]
    yield
    region = next(region for region in editor.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=editor, region=region):
        bpy.ops.image.view_zoom_ratio(ratio=1.0)
    for _ in range(4):
        yield
    subprocess.run(["import", "-window", "root", screenshot], check=True)
    place = {name: getattr(region, name) for name in ("x", "y", "width", "height")}
    Path(report).write_text(json.dumps(place))


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
bpy.context.preferences.view.render_display_type = "NONE"
bpy.app.handlers.render_complete.append(lambda *_: rendered.append("complete"))
bpy.app.handlers.render_cancel.append(lambda *_: rendered.append("cancelled"))
bpy.app.timers.register(next_step, first_interval=2 * PAUSE)
