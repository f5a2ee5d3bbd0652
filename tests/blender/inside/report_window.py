"""In a window: buttons of the panel, clicked with the mouse; a report runs while Blender goes on drawing, and Esc ends
one early.

Arguments: FOLDER REPORT. The report, in JSON, says what came of each, and is written last.
"""

import json
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
import window_steps as w

PATIENCE = 1200
folder, report = map(Path, sys.argv[sys.argv.index("--") + 1 :])
rendered = []


def is_written(path: Path) -> bool:
    return (path / "index.html").exists()


def is_measuring() -> bool:
    return "BIH report" in [thread.name for thread in threading.enumerate()]


def steps() -> Iterator[None]:
    from bl_ext.user_default.bih.addon.blender.trees import TREES

    scene = w.window().scene
    scene.render.engine = "BIH_PREVIEW"
    scene.render.resolution_percentage = 10
    viewport = w.area("VIEW_3D")
    viewport.spaces.active.show_region_ui = True
    yield from w.drawn(6)
    w.region(viewport, "UI").active_panel_category = "BIH"
    yield from w.drawn()
    trees, told = TREES.of(scene), {}

    yield from w.click("bpy.ops.bih.build()", viewport)
    yield from w.until(lambda: trees.main is not None)
    told["built"] = trees.main.tree.stats.triangles
    yield from w.click("bpy.ops.render.render()", viewport, across=0.2)
    yield from w.until(lambda: rendered)
    told["rendered"] = rendered
    yield from w.click("bpy.ops.bih.compare()", viewport)
    yield from w.until(lambda: trees.other is not None)
    told["compared"] = trees.other.tree.stats.structure
    yield from w.click("bpy.ops.bih.free()", viewport, across=0.8)
    yield from w.until(lambda: trees.main is None)

    with w.within(w.area("PROPERTIES")):
        done = bpy.ops.bih.report("INVOKE_DEFAULT", folder=str(folder / "whole"), only="left-out")
    assert done == {"RUNNING_MODAL"}
    for number in range(PATIENCE):
        if is_written(folder / "whole"):
            told["steps"] = number
            break
        yield
    yield from w.click("bpy.ops.bih.report()", viewport, across=0.25)
    yield from w.until(is_measuring)
    w.press("ESC", 200, 200)
    yield from w.until(lambda: not is_measuring(), PATIENCE)
    told["ended"] = bpy.utils.extension_path_user("bl_ext.user_default.bih", path="report")
    for _ in range(5):
        yield
    report.write_text(json.dumps(told))


bpy.context.preferences.view.render_display_type = "NONE"
bpy.app.handlers.render_complete.append(lambda *_: rendered.append("complete"))
w.run(steps(), pause=0.05)
