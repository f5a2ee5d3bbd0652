"""The tab "BIH" in the sidebar of the 3D viewport, for any render engine."""

from __future__ import annotations

import bpy

from . import overlay_parts, panel_parts
from .trees import TREES


class SidebarPanel:
    """What panels of the tab have beside bpy.types.Panel."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "BIH"


class VIEW3D_PT_bih(SidebarPanel, bpy.types.Panel):
    bl_label = "Tree"

    def draw(self, context: bpy.types.Context) -> None:
        panel_parts.draw_whole(self.layout, context, with_picture=False)


class VIEW3D_PT_bih_build(SidebarPanel, bpy.types.Panel):
    bl_label = "Last Build"
    bl_parent_id = "VIEW3D_PT_bih"

    def draw(self, context: bpy.types.Context) -> None:
        panel_parts.draw_build(self.layout, context)


class VIEW3D_PT_bih_overlay(SidebarPanel, bpy.types.Panel):
    bl_label = "Overlay"

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.bih_overlay, "is_shown", text="")

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.active = context.scene.bih_overlay.is_shown
        overlay_parts.draw_overlay(self.layout, context)


class VIEW3D_PT_bih_node(SidebarPanel, bpy.types.Panel):
    bl_label = "Node"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return TREES.of(context.scene).main is not None

    def draw(self, context: bpy.types.Context) -> None:
        overlay_parts.draw_node(self.layout, context.scene)


class VIEW3D_PT_bih_picture(SidebarPanel, bpy.types.Panel):
    bl_label = "Picture"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        panel_parts.draw_render_settings(self.layout, context)


PANELS = (
    VIEW3D_PT_bih,
    VIEW3D_PT_bih_build,
    VIEW3D_PT_bih_overlay,
    VIEW3D_PT_bih_node,
    VIEW3D_PT_bih_picture,
)
