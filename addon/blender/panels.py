"""The panel in the Render properties, and Blender's own panels that the engine needs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import bpy

from . import modules
from .engine import BihPreviewEngine


class RENDER_PT_bih(bpy.types.Panel):
    bl_label = "BIH Preview"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == BihPreviewEngine.bl_idname

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        missing = modules.why_missing("bihtree")
        for sentence in filter(None, missing.split(". ")):
            layout.label(text=sentence, icon="ERROR")
        chosen = context.scene.bih
        for name in ("structure", "layout", "precision", "leaf_size", "samples", "shadows", "overlay_depth"):
            layout.prop(chosen, name)
        layout.column().prop(chosen, "passes")
        row = layout.row()
        row.enabled = not missing
        row.operator("render.render", text="Render", icon="RENDER_STILL")
        row.operator("bih.report", icon="GRAPH")
        summary = layout.column(align=True)
        for line in BihPreviewEngine.last_summary:
            summary.label(text=" ".join(line.split()))
        draw_needs(layout, BihPreviewEngine.last_needs)


def draw_needs(layout: bpy.types.UILayout, parts: Sequence[Mapping[str, Any]]) -> None:
    """What the last render did without, as a table: part, kept or left out, why, what that saves."""
    if not parts:
        return
    layout.label(text="What the scene needs")
    table = layout.box().column(align=True)
    for part in parts:
        name, reason = table.split(factor=0.3), str(part["why"])
        name.label(text=str(part["part"]).capitalize(), icon="CHECKBOX_HLT" if part["kept"] else "CHECKBOX_DEHLT")
        name.label(text=f"{reason}; {part['saves']}" if part["saves"] else reason)


def panels_of_any_engine() -> Iterator[type[bpy.types.Panel]]:
    """Blender's panels for size, output, camera, lights and the like: those that its first, plain engine had."""
    for panel in bpy.types.Panel.__subclasses__():
        if "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ()):
            yield panel
