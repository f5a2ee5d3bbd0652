"""What panels show, wherever they are: in the Render properties and in the sidebar of the 3D viewport."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

import bpy

from ..pipeline import settings
from . import modules, properties
from .properties import BihSettings
from .trees import TREES

CHARACTER, MARGIN = 6.4, 8
"""Width of a letter of Blender's interface in pixels, on average, and the letters that a panel's margins take."""

CHOICES = {"layout": settings.LAYOUTS, "heuristic": settings.HEURISTICS}


def draw_missing(layout: bpy.types.UILayout) -> bool:
    """What is not installed, if anything; whether all is there."""
    missing = modules.why_missing("bihtree")
    for sentence in filter(None, missing.split(". ")):
        layout.label(text=sentence, icon="ERROR")
    return not missing


def draw_tree_settings(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """How the tree is built: only what goes together can be chosen, and a line says why where something cannot."""
    plain(layout)
    chosen = context.scene.bih
    layout.prop(chosen, "structure")
    for name, items in CHOICES.items():
        draw_own_choices(layout, chosen, name, items)
    for name, part in properties.PARTS_OF_CHOICES.items():
        row = layout.row()
        row.enabled = not properties.why_not(chosen, part)
        row.prop(chosen, name)
    layout.prop(chosen, "precision")
    for why in properties.notes(chosen):
        draw_wrapped(layout, why, context, icon="INFO")


def draw_own_choices(layout: bpy.types.UILayout, chosen: BihSettings, name: str, items: Sequence[str]) -> None:
    """All of them in a row; those that the structure does not have are grey."""
    known = settings.GOES_WITH[chosen.structure][name]
    whole = layout.split(factor=0.4)
    label = whole.column()
    label.alignment = "RIGHT"
    label.label(text=chosen.bl_rna.properties[name].name)
    row = whole.row(align=True)
    row.use_property_split = False
    for item in items:
        part = row.row(align=True)
        part.enabled = item in known
        part.prop_enum(chosen, name, item)


def draw_render_settings(layout: bpy.types.UILayout, chosen: BihSettings) -> None:
    plain(layout)
    for name in ("samples", "viewport_samples", *settings.SHADING, "overlay_depth"):
        layout.prop(chosen, name)
    layout.column().prop(chosen, "passes")


def draw_whole(layout: bpy.types.UILayout, context: bpy.types.Context, *, with_picture: bool) -> None:
    """The choices and the buttons, which are seen without scrolling, with or without the choices of the picture."""
    is_whole = draw_missing(layout)
    draw_tree_settings(layout.column(), context)
    buttons = layout.column()
    buttons.enabled = is_whole
    draw_buttons(buttons, context.scene)
    if with_picture:
        draw_render_settings(layout.column(), context.scene.bih)


def draw_buttons(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    column = layout.column(align=True)
    row = column.row(align=True)
    row.operator("render.render", text="Render", icon="RENDER_STILL")
    row.operator("bih.build", icon="MOD_BUILD")
    row.operator("bih.free", icon="TRASH")
    row = column.row(align=True)
    row.operator("bih.report", text="Report", icon="GRAPH")
    row.operator("bih.render_overlay", text="Save Overlay", icon="IMAGE_DATA")


def draw_build(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The last build as a small table: what it is, what it cost, what it did without."""
    made = TREES.of(context.scene).main
    if made is None:
        layout.label(text="No tree is built", icon="INFO")
        return
    from ..pipeline import built

    draw_table(layout, built.table(made))
    without = built.left_out(made)
    if without:
        box = layout.box().column(align=True)
        box.label(text="Left out")
        for name, why in without:
            draw_wrapped(box, f"{name}: {why}", context)
    for what in made.skipped:
        draw_wrapped(layout, what, context, icon="ERROR")


def draw_table(layout: bpy.types.UILayout, rows: Sequence[tuple[str, str]]) -> None:
    whole = layout.box().split(factor=0.5)
    names, values = whole.column(align=True), whole.column(align=True)
    for label, value in rows:
        names.label(text=label)
        values.label(text=value)


def draw_needs(layout: bpy.types.UILayout, parts: Sequence[Mapping[str, Any]], context: bpy.types.Context) -> None:
    """What the last render did without, as a table: part, kept or left out, why, what that saves."""
    if not parts:
        return
    layout.label(text="What the scene needs")
    table = layout.box().column(align=True)
    for part in parts:
        table.label(text=str(part["part"]).capitalize(), icon="CHECKBOX_HLT" if part["kept"] else "CHECKBOX_DEHLT")
        reason = str(part["why"])
        draw_wrapped(table, f"{reason}; {part['saves']}" if part["saves"] else reason, context, icon="BLANK1")


def draw_wrapped(layout: bpy.types.UILayout, text: str, context: bpy.types.Context, *, icon: str = "NONE") -> None:
    """As many lines as the region's width asks for: Blender cuts a label off where it ends."""
    characters = context.region.width / (CHARACTER * context.preferences.system.ui_scale) - MARGIN
    column = layout.column(align=True)
    column.scale_y = 0.8
    later = "NONE" if icon == "NONE" else "BLANK1"
    for number, line in enumerate(wrap(text, max(16, int(characters)))):
        column.label(text=line, icon=later if number else icon)


def note(layout: bpy.types.UILayout, text: str) -> None:
    layout.label(text=text, icon="INFO")


def plain(layout: bpy.types.UILayout) -> None:
    layout.use_property_split = True
    layout.use_property_decorate = False
