"""The panels in the Render properties, one in the Object properties, and Blender's own panels that the engine needs."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from . import compat, panel_parts
from .engine import BihPreviewEngine
from .trees import WITHOUT_TRIANGLES


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
            panel_parts.draw_wrapped(summary, line, context)
        panel_parts.draw_needs(self.layout, BihPreviewEngine.last_needs, context)


class OBJECT_PT_bih_rays(bpy.types.Panel):
    """Blender's panel shows these for its own engines alone."""

    bl_label = "Ray Visibility"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        is_ours = context.engine == BihPreviewEngine.bl_idname
        return is_ours and context.object is not None and context.object.type not in WITHOUT_TRIANGLES

    def draw(self, context: bpy.types.Context) -> None:
        panel_parts.plain(self.layout)
        for name, text in (("visible_camera", "Camera"), ("visible_shadow", "Shadow"), ("is_holdout", "Holdout")):
            self.layout.prop(context.object, name, text=text)


PANELS = (RENDER_PT_bih, RENDER_PT_bih_build, RENDER_PT_bih_render, OBJECT_PT_bih_rays)

EEVEES = (
    *("EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface"),
    *("DATA_PT_EEVEE_light", "DATA_PT_EEVEE_light_shadow"),
)
"""Those of Eevee's panels that hold what is traced: material slots and colours, the world's colour, lights."""
POORER = ("DATA_PT_light", "NODE_DATA_PT_light")
"""What the plain engine had for lights, in the properties and beside nodes: their kind alone."""


def panels_of_blender() -> Iterator[type[bpy.types.Panel]]:
    """Blender's panels that the engine needs: those for size, output, camera and the like that its first, plain engine
    had, and EEVEES."""
    chosen = {*EEVEES, compat.material_index_panel()}
    for panel in bpy.types.Panel.__subclasses__():
        is_plain = "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ()) and panel.__name__ not in POORER
        if is_plain or panel.__name__ in chosen:
            yield panel
