"""What panels show, wherever they are: in the Render properties and in the sidebar of the 3D viewport."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import bpy

from ..pipeline import settings
from . import modules, properties
from .properties import BihSettings
from .trees import TREES

CHOICES = {"layout": settings.LAYOUTS, "heuristic": settings.HEURISTICS}


def draw_missing(layout: bpy.types.UILayout) -> bool:
    """What is not installed, if anything; whether all is there."""
    missing = modules.why_missing("bihtree")
    for sentence in filter(None, missing.split(". ")):
        layout.label(text=sentence, icon="ERROR")
    return not missing


def draw_tree_settings(layout: bpy.types.UILayout, chosen: BihSettings) -> None:
    """How the tree is built: only what goes together can be chosen, and one line says why where something cannot."""
    plain(layout)
    layout.prop(chosen, "structure")
    for name, items in CHOICES.items():
        draw_own_choices(layout, chosen, name, items)
    for name, part in (("build", "on demand"), ("presort", "bucket sort"), ("leaf_size", "leaf size")):
        why = properties.why_not(chosen, part)
        row = layout.row()
        row.enabled = not why
        row.prop(chosen, name)
        if why:
            note(layout, why)
    layout.prop(chosen, "precision")


def draw_own_choices(layout: bpy.types.UILayout, chosen: BihSettings, name: str, items: Sequence[str]) -> None:
    """All of them in a row; those that the structure does not have are grey."""
    known = settings.GOES_WITH[chosen.structure][name]
    column = layout.column(heading=chosen.bl_rna.properties[name].name)
    row = column.row(align=True)
    for item in items:
        part = row.row(align=True)
        part.enabled = item in known
        part.prop_enum(chosen, name, item)
    if getattr(chosen, name) not in known:
        one, other = properties.STRUCTURE_TEXT[chosen.structure][0], getattr(chosen, name)
        note(layout, f"A {one} has no {name} {other}: {known[0]} is used")


def draw_render_settings(layout: bpy.types.UILayout, chosen: BihSettings) -> None:
    plain(layout)
    for name in ("samples", "viewport_samples", "shadows", "overlay_depth"):
        layout.prop(chosen, name)
    layout.column().prop(chosen, "passes")


def draw_buttons(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    column = layout.column(align=True)
    row = column.row(align=True)
    row.operator("render.render", text="Render", icon="RENDER_STILL")
    row.operator("bih.build", icon="MOD_BUILD")
    row.operator("bih.free", icon="TRASH")
    row = column.row(align=True)
    row.operator("bih.report", text="Report", icon="GRAPH")
    row.operator("bih.render_overlay", text="Save Overlay", icon="IMAGE_DATA")


def draw_build(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """The last build as a small table: what it is, what it cost, what it did without."""
    made = TREES.of(scene).main
    if made is None:
        layout.label(text="No tree is built", icon="INFO")
        return
    from ..pipeline import built

    draw_table(layout, built.table(made))
    without = built.left_out(made)
    if without:
        layout.label(text="Left out")
        draw_table(layout, without)
    for what in made.skipped:
        layout.label(text=what, icon="ERROR")


def draw_table(layout: bpy.types.UILayout, rows: Sequence[tuple[str, str]]) -> None:
    table = layout.box().column(align=True)
    for label, value in rows:
        name, text = split(table)
        name.label(text=label)
        text.label(text=value)


def draw_needs(layout: bpy.types.UILayout, parts: Sequence[Mapping[str, Any]]) -> None:
    """What the last render did without, as a table: part, kept or left out, why, what that saves."""
    if not parts:
        return
    layout.label(text="What the scene needs")
    table = layout.box().column(align=True)
    for part in parts:
        name, text = split(table)
        reason = str(part["why"])
        name.label(text=str(part["part"]).capitalize(), icon="CHECKBOX_HLT" if part["kept"] else "CHECKBOX_DEHLT")
        text.label(text=f"{reason}; {part['saves']}" if part["saves"] else reason)


def split(layout: bpy.types.UILayout) -> tuple[bpy.types.UILayout, bpy.types.UILayout]:
    name = layout.split(factor=0.32)
    return name, name.column(align=True)


def note(layout: bpy.types.UILayout, text: str) -> None:
    layout.label(text=text, icon="INFO")


def plain(layout: bpy.types.UILayout) -> None:
    layout.use_property_split = True
    layout.use_property_decorate = False
