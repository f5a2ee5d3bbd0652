"""In a window: the panel's report runs while Blender goes on drawing, and Esc ends another one early.

Arguments: FOLDER REPORT. The report, in JSON, says how often a timer was called meanwhile, and is written last.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
import window_steps as w

PATIENCE = 1200
folder, report = map(Path, sys.argv[sys.argv.index("--") + 1 :])


def is_written(name: str) -> bool:
    return (folder / name / "index.html").exists()


def started(name: str, **options: object) -> None:
    with w.within(w.area("PROPERTIES")):
        done = bpy.ops.bih.report("INVOKE_DEFAULT", folder=str(folder / name), **options)
    assert done == {"RUNNING_MODAL"}


def steps() -> Iterator[None]:
    w.window().scene.render.engine = "BIH_PREVIEW"
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
    w.press("ESC", 200, 200)
    for number in range(PATIENCE):
        if is_written("ended"):
            ticks["ended"] = number
            break
        yield
    for _ in range(5):
        yield
    report.write_text(json.dumps(ticks))


w.run(steps())
