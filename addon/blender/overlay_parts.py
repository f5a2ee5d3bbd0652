"""What panels show of the overlay: what is drawn, what is picked, the numbers of a node."""

from __future__ import annotations

import bpy

from ..pipeline.overlay_boxes import SHOWN
from .panel_parts import draw_named, draw_or_automatic, draw_table, note, plain
from .trees import TREES


def draw_overlay(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    plain(layout)
    scene = context.scene
    chosen, trees = scene.bih_overlay, TREES.of(scene)
    if trees.main is None:
        note(layout, "Build a tree to see it")
    column = layout.column()
    column.prop(chosen, "shown")
    if chosen.shown in SHOWN:
        depths = column.column(align=True)
        depths.prop(chosen, "first_depth")
        depths.prop(chosen, "last_depth")
        column.operator("bih.play_construction", icon="PLAY")
        if trees.main is not None and trees.main.has_more:
            note(column, f"Of {trees.main.tree.stats.nodes:,} nodes the upper {len(trees.main.nodes):,}")
    row = layout.column(heading="Draw")
    row.prop(chosen, "in_front")
    row.prop(chosen, "filled")
    row.prop(chosen, "legend")
    row.prop(chosen, "cost")
    draw_or_automatic(layout, chosen, "most_lines")
    column = layout.column(align=True)
    pair = column.row(align=True)
    pair.operator("bih.pick_ray", icon="EYEDROPPER")
    pair.operator("bih.cost_map", icon="COLOR")
    pair = column.row(align=True)
    pair.operator("bih.mesh_from_tree", text="Make Mesh", icon="MESH_CUBE")
    pair.operator("bih.export_tree", icon="EXPORT")
    column = layout.column(align=True)
    draw_named(column, context, chosen, "other_structure")
    column.operator("bih.compare", icon="MOD_MIRROR")


def draw_node(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Where to go, and the numbers of the selected node."""
    trees = TREES.of(scene)
    row = layout.row(align=True)
    for to, text in (("root", "Root"), ("parent", "Parent"), ("left", "Left"), ("right", "Right"), ("none", "None")):
        row.operator("bih.select_node", text=text).to = to
    if trees.main is None or not 0 <= trees.selected < len(trees.main.nodes):
        note(layout, "Pick a ray, or start at the root")
        return
    from ..pipeline import ray_path

    draw_table(layout, ray_path.numbers(trees.main.nodes, trees.selected))
