"""In a window: the Render properties beside an Image Editor, render as the panel's button does, take a screenshot; then
render for long, and press Esc.

Arguments: SCREENSHOT REPORT WIDTH HEIGHT. The report, in JSON, says where in the window the Image Editor shows the
picture, and how the second render ended; it is written last. Blender draws between the calls of a timer, so every step
is one call; the last quits.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
import real_keys
import window_steps as w

PATIENCE = 240
screenshot, report, width, height = sys.argv[sys.argv.index("--") + 1 :]
rendered = []


def steps() -> Iterator[None]:
    scene = w.window().scene
    scene.render.engine = "BIH_PREVIEW"
    scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
    scene.render.resolution_percentage = 100
    properties = w.area("PROPERTIES")
    properties.spaces[0].context = "RENDER"
    editor = max(w.window().screen.areas, key=lambda area: area.width * area.height)
    editor.type = "IMAGE_EDITOR"
    yield
    yield from render(properties)
    yield from w.until(lambda: rendered, PATIENCE)
    assert rendered == ["complete"]
    editor.spaces[0].image = bpy.data.images["Render Result"]
    yield
    with w.within(editor):
        bpy.ops.image.view_zoom_ratio(ratio=1.0)
    for _ in range(4):
        yield
    w.shot(Path(screenshot))
    region = w.region(editor)
    place = {name: getattr(region, name) for name in ("x", "y", "width", "height")}
    rendered.clear()
    scene.render.resolution_x, scene.bih.samples = 8192, 256
    yield from render(properties)
    for _ in range(4):
        yield
    assert bpy.app.is_job_running("RENDER") and not rendered
    real_keys.press(real_keys.ESCAPE)
    yield from w.until(lambda: rendered, PATIENCE)
    Path(report).write_text(json.dumps({"place": place, "long": rendered}))


def render(properties: bpy.types.Area) -> Iterator[None]:
    with w.within(properties):
        assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield


bpy.context.preferences.view.render_display_type = "NONE"
bpy.app.handlers.render_complete.append(lambda *_: rendered.append("complete"))
bpy.app.handlers.render_cancel.append(lambda *_: rendered.append("cancelled"))
w.run(steps(), pause=0.5)
