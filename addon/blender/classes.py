"""The engine, its settings and its panel, in Blender and out again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from .engine import BihPreviewEngine
from .operators import BIH_OT_report
from .panels import RENDER_PT_bih, panels_of_any_engine
from .properties import BihSettings

CLASSES = (BihSettings, BihPreviewEngine, BIH_OT_report, RENDER_PT_bih)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.bih = bpy.props.PointerProperty(type=BihSettings)
    for panel in panels_of_any_engine():
        panel.COMPAT_ENGINES.add(BihPreviewEngine.bl_idname)


def unregister() -> None:
    for panel in panels_of_any_engine():
        panel.COMPAT_ENGINES.discard(BihPreviewEngine.bl_idname)
    del bpy.types.Scene.bih
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)


@contextmanager
def registered() -> Iterator[None]:
    """Registered while a command runs, whether the host has the add-on enabled or not.

    What was not registered before is not left behind: the 4.2 wheel crashes at exit on an engine that is.
    """
    if hasattr(bpy.types.Scene, "bih"):
        yield
        return
    register()
    try:
        yield
    finally:
        unregister()
