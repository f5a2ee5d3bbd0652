"""In a window: the panel's report runs while Blender goes on drawing, and Esc ends another one early.

Arguments: FOLDER REPORT. The report, in JSON, says how often a timer was called meanwhile, and is written last.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

PAUSE = 0.1
PATIENCE = 1200
folder, report = map(Path, sys.argv[sys.argv.index("--") + 1 :])


def is_written(name: str) -> bool:
    return (folder / name / "index.html").exists()


def started(name: str, **options: object) -> None:
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "PROPERTIES")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        done = bpy.ops.bih.report("INVOKE_DEFAULT", folder=str(folder / name), **options)
    assert done == {"RUNNING_MODAL"}


def steps() -> Iterator[None]:
    window = bpy.context.window_manager.windows[0]
    window.scene.render.engine = "BIH_PREVIEW"
    yield
    ticks = {}
    started("whole", only="left-out")
    for number in range(PATIENCE):
        if is_written("whole"):
            ticks["whole"] = number
            break
        yield
    started("ended", quick=False)
    for _ in range(5):
        yield
    window.event_simulate(type="ESC", value="PRESS", x=200, y=200)
    window.event_simulate(type="ESC", value="RELEASE", x=200, y=200)
    for number in range(PATIENCE):
        if is_written("ended"):
            ticks["ended"] = number
            break
        yield
    for _ in range(5):
        yield
    report.write_text(json.dumps(ticks))


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
