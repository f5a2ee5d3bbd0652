"""The engine, its settings, operators and panels, in Blender and out again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from . import overlay_draw, panels, sidebar, trees
from .build import BIH_OT_build, BIH_OT_free
from .compare import BIH_OT_compare, BIH_OT_cost_map
from .engine import BihPreviewEngine, forget_frames
from .export_tree import BIH_OT_export_tree
from .mesh_from_tree import BIH_OT_mesh_from_tree
from .operators import BIH_OT_report
from .overlay_file import BIH_OT_render_overlay
from .overlay_properties import BihOverlaySettings
from .panels import panels_of_blender
from .pick import BIH_OT_pick_ray, BIH_OT_select_node
from .play import BIH_OT_play_construction
from .properties import BihSettings

OPERATORS = (
    *(BIH_OT_report, BIH_OT_build, BIH_OT_free, BIH_OT_render_overlay, BIH_OT_export_tree),
    *(BIH_OT_pick_ray, BIH_OT_select_node, BIH_OT_play_construction),
    *(BIH_OT_compare, BIH_OT_cost_map, BIH_OT_mesh_from_tree),
)
CLASSES = (BihSettings, BihOverlaySettings, BihPreviewEngine, *OPERATORS, *panels.PANELS, *sidebar.PANELS)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    trees.register()
    bpy.types.Scene.bih = bpy.props.PointerProperty(type=BihSettings)
    bpy.types.Scene.bih_overlay = bpy.props.PointerProperty(type=BihOverlaySettings)
    overlay_draw.register()
    for panel in panels_of_blender():
        panel.COMPAT_ENGINES.add(BihPreviewEngine.bl_idname)
    for handlers in _ends_of_a_render():
        handlers.append(forget_frames)


def unregister() -> None:
    for handlers in _ends_of_a_render():
        handlers.remove(forget_frames)
    forget_frames()
    for panel in panels_of_blender():
        panel.COMPAT_ENGINES.discard(BihPreviewEngine.bl_idname)
    overlay_draw.unregister()
    del bpy.types.Scene.bih_overlay
    del bpy.types.Scene.bih
    trees.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)


def _ends_of_a_render() -> tuple[list, list]:
    return bpy.app.handlers.render_complete, bpy.app.handlers.render_cancel


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
