"""What panels show, wherever they are: in the Render properties and in the sidebar of the 3D viewport."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import Any

import bpy

from ..pipeline import settings
from . import modules, properties
from .trees import TREES

CHARACTER, MARGIN = 6.4, 8
"""Width of a letter of Blender's interface in pixels, on average, and the letters that a panel's margins take."""

PADDING = 16
"""Pixels of a button beside its word."""
NAMES = 0.4
"""The share of a row that names take, as in Blender's own panels."""

SHORT_NAMES = {
    "viewport_samples": "Viewport",
    "soft_shadows": "Soft",
    "ambient_occlusion": "Occlusion",
    "smooth": "Smooth",
    "overlay_depth": "Overlay",
    "other_structure": "Other",
}
"""Where there is no room for the whole name."""

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
        draw_own_choices(layout, context, name, items)
    for name, part in properties.PARTS_OF_CHOICES.items():
        row = layout.row()
        row.enabled = not properties.why_not(chosen, part)
        if name == "leaf_size":
            draw_or_automatic(row, chosen, name)
        else:
            row.prop(chosen, name)
    layout.prop(chosen, "precision")
    for why in properties.notes(chosen):
        draw_wrapped(layout, why, context, icon="INFO")


def draw_own_choices(layout: bpy.types.UILayout, context: bpy.types.Context, name: str, items: Sequence[str]) -> None:
    """All of them, beside their name or below it, as there is room for; those that the structure does not have are
    grey."""
    chosen = context.scene.bih
    known, shown = settings.GOES_WITH[chosen.structure][name], chosen.bl_rna.properties[name]
    place = place_of_choices([shown.enum_items[item].name for item in items], panel_width(context))
    if place == "beside":
        buttons = named(layout, shown.name).row(align=True)
    else:
        column = layout.column(align=True)
        column.label(text=shown.name)
        buttons = column.row(align=True) if place == "below" else column.column(align=True)
    buttons.use_property_split = False
    for item in items:
        part = buttons.row(align=True)
        part.enabled = item in known
        part.prop_enum(chosen, name, item)


def place_of_choices(words: Sequence[str], width: float) -> str:
    """Where buttons of equal width with these words are not cut off, in so many pixels: beside their name, below it, or
    one below the other."""
    needed = len(words) * (max(map(len, words)) * CHARACTER + PADDING)
    if needed <= (1 - NAMES) * width:
        return "beside"
    return "below" if needed <= width else "stacked"


def draw_or_automatic(layout: bpy.types.UILayout, chosen: bpy.types.PropertyGroup, name: str) -> None:
    """A number that is chosen for you where it is 0: then a word beside it says so."""
    row = named(layout, chosen.bl_rna.properties[name].name).row()
    row.use_property_split = False
    row.prop(chosen, name, text="")
    if not getattr(chosen, name):
        row.label(text="automatic")


def named(layout: bpy.types.UILayout, name: str) -> bpy.types.UILayout:
    """What stands beside a name, where Blender would put it."""
    whole = layout.split(factor=NAMES)
    label = whole.column()
    label.alignment = "RIGHT"
    label.label(text=name)
    return whole.column()


def draw_named(
    layout: bpy.types.UILayout, context: bpy.types.Context, chosen: bpy.types.PropertyGroup, name: str
) -> None:
    """With a name that is not cut off: that of a tick stands behind it, others before what is chosen."""
    shown = chosen.bl_rna.properties[name]
    share = (1 - NAMES) if shown.type == "BOOLEAN" else NAMES
    layout.prop(chosen, name, text=name_that_fits(shown.name, SHORT_NAMES.get(name), share * panel_width(context)))


def name_that_fits(name: str, short: str | None, width: float) -> str:
    """The short one, if there is one, where the name takes more than so many pixels."""
    return short if short and len(name) * CHARACTER + PADDING > width else name


def draw_render_settings(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    plain(layout)
    chosen = context.scene.bih
    samples = layout.column(align=True)
    for name in ("samples", "viewport_samples"):
        draw_named(samples, context, chosen, name)
    samples.prop(context.scene.render, "preview_pixel_size", text="Pixel Size")
    for name in (*settings.SHADING, "overlay_depth"):
        draw_named(layout, context, chosen, name)
    layout.prop(context.scene.render, "film_transparent", text="Transparent Film")
    layout.column().prop(chosen, "passes")


def draw_whole(layout: bpy.types.UILayout, context: bpy.types.Context, *, with_picture: bool) -> None:
    """The choices and the buttons, which are seen without scrolling, with or without the choices of the picture."""
    is_whole = draw_missing(layout)
    draw_tree_settings(layout.column(), context)
    buttons = layout.column()
    buttons.enabled = is_whole
    draw_buttons(buttons, context.scene)
    if with_picture:
        draw_render_settings(layout.column(), context)


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
    trees = TREES.of(context.scene)
    made = trees.main
    if made is None:
        layout.label(text="No tree is built", icon="INFO")
        return
    if trees.gone:
        what = f"Gone since it was built: {trees.gone:,} of {len(trees.sources):,} objects. Build again"
        draw_wrapped(layout, what, context, icon="ERROR")
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
    from ..pipeline import needs

    layout.label(text="What the scene needs")
    table = layout.box().column(align=True)
    for part in parts:
        table.label(text=str(part["part"]).capitalize(), icon="CHECKBOX_HLT" if part["kept"] else "CHECKBOX_DEHLT")
        draw_wrapped(table, needs.sentence(part), context, icon="BLANK1")


def draw_wrapped(layout: bpy.types.UILayout, text: str, context: bpy.types.Context, *, icon: str = "NONE") -> None:
    """As many lines as the region's width asks for: Blender cuts a label off where it ends."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    later = "NONE" if icon == "NONE" else "BLANK1"
    for number, line in enumerate(wrap(text, max(16, int(letters(context))))):
        column.label(text=line, icon=later if number else icon)


def letters(context: bpy.types.Context) -> float:
    """How many stand beside each other in a panel of this region, on average."""
    return context.region.width / (CHARACTER * context.preferences.system.ui_scale) - MARGIN


def panel_width(context: bpy.types.Context) -> float:
    """The same in pixels of an interface of scale 1."""
    return letters(context) * CHARACTER


def note(layout: bpy.types.UILayout, text: str) -> None:
    layout.label(text=text, icon="INFO")


def plain(layout: bpy.types.UILayout) -> None:
    layout.use_property_split = True
    layout.use_property_decorate = False
