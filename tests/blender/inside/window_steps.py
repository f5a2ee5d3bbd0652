"""For scripts in a window: steps between which Blender draws, clicks and keys, and screenshots of the screen."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import bpy

ROW = 12
"""Pixels: less than a button is high."""
SCROLLS = 8


def run(steps: Iterator[None], *, pause: float = 0.1, persistent: bool = False) -> None:
    """Each step in a call of a timer; after the last one, or an error, Blender quits. `persistent`: also when another
    file is opened meanwhile."""

    def next_step() -> float | None:
        more = False
        try:
            more = next(steps, "the end") is None
        finally:  # an error ends the timer, and Blender would stay open
            if not more:
                bpy.ops.wm.quit_blender()
        return pause if more else None

    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(next_step, first_interval=1.0, persistent=persistent)


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def area(kind: str) -> bpy.types.Area:
    """The largest of its kind."""
    return max((a for a in window().screen.areas if a.type == kind), key=lambda a: a.width * a.height)


def region(of: bpy.types.Area, kind: str = "WINDOW") -> bpy.types.Region:
    return next(part for part in of.regions if part.type == kind)


def within(of: bpy.types.Area) -> object:
    """The context of that area, for operators."""
    return bpy.context.temp_override(window=window(), area=of, region=region(of))


def press(kind: str, x: int = 400, y: int = 400) -> None:
    """A key or a button of the mouse, down and up, at a place of the window."""
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    window().event_simulate(type=kind, value="PRESS", x=x, y=y)
    window().event_simulate(type=kind, value="RELEASE", x=x, y=y)


def click(command: str, of: bpy.types.Area, kind: str = "UI", across: float = 0.5) -> Iterator[None]:
    """With the mouse, the button that calls this operator: it is looked for from the top of the region downwards, at a
    share of its width."""
    place = region(of, kind)
    x = place.x + int(across * place.width)
    scroll("WHEELUPMOUSE", 10 * SCROLLS, place)
    yield from drawn()
    for _ in range(SCROLLS):
        for y in range(place.y + place.height - ROW, place.y + ROW, -ROW):
            window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
            # The button that was under the mouse before is left one step late.
            yield
            yield
            if command_under_the_mouse(of, place) == command:
                press("LEFTMOUSE", x, y)
                yield
                return
        scroll("WHEELDOWNMOUSE", 10, place)
        yield from drawn()
    raise AssertionError(f"no button calls {command}")


def scroll(wheel: str, times: int, place: bpy.types.Region) -> None:
    for _ in range(times):
        press(wheel, place.x + place.width // 3, place.y + place.height // 2)


def command_under_the_mouse(of: bpy.types.Area, within_region: bpy.types.Region) -> str:
    """As Blender's own "Copy Python Command" has it; empty where there is no button of an operator."""
    with bpy.context.temp_override(window=window(), area=of, region=within_region):
        if not bpy.ops.ui.copy_python_command_button.poll():
            return ""
        bpy.ops.ui.copy_python_command_button()
    return str(bpy.context.window_manager.clipboard)


def drawn(times: int = 3) -> Iterator[None]:
    """Everything once more, and time for it."""
    for a in window().screen.areas:
        a.tag_redraw()
    for _ in range(times):
        yield


def shot(path: Path) -> None:
    subprocess.run(["import", "-window", "root", str(path)], check=True)


def until(is_so: object, times: int = 600) -> Iterator[None]:
    """Steps until `is_so()`; an error if it never comes."""
    for _ in range(times):
        if is_so():  # type: ignore[operator]
            return
        yield
    raise AssertionError("it never came")
