"""The panels in the Render properties, and Blender's own panels that the engine needs."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from . import panel_parts
from .engine import BihPreviewEngine


class RenderPanel:
    """What panels of the Render properties have beside bpy.types.Panel."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == BihPreviewEngine.bl_idname


class RENDER_PT_bih(RenderPanel, bpy.types.Panel):
    bl_label = "BIH Preview"

    def draw(self, context: bpy.types.Context) -> None:
        panel_parts.draw_whole(self.layout, context, with_picture=True)


class RENDER_PT_bih_build(RenderPanel, bpy.types.Panel):
    bl_label = "Last Build"
    bl_parent_id = "RENDER_PT_bih"

    def draw(self, context: bpy.types.Context) -> None:
        panel_parts.draw_build(self.layout, context)


class RENDER_PT_bih_render(RenderPanel, bpy.types.Panel):
    bl_label = "Last Render"
    bl_parent_id = "RENDER_PT_bih"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and bool(BihPreviewEngine.last_summary)

    def draw(self, context: bpy.types.Context) -> None:
        summary = self.layout.column(align=True)
        for line in BihPreviewEngine.last_summary:
            summary.label(text=" ".join(line.split()))
        panel_parts.draw_needs(self.layout, BihPreviewEngine.last_needs, context)


PANELS = (RENDER_PT_bih, RENDER_PT_bih_build, RENDER_PT_bih_render)


def panels_of_any_engine() -> Iterator[type[bpy.types.Panel]]:
    """Blender's panels for size, output, camera, lights and the like: those that its first, plain engine had."""
    for panel in bpy.types.Panel.__subclasses__():
        if "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ()):
            yield panel
