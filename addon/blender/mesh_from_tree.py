"""The tree as real geometry: a collection of meshes, for renders and for taking apart.

Blender reads the annotations as values, so they are not postponed here.
"""

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty
from mathutils import Color

from ..pipeline.errors import UserError
from ..pipeline.overlay_boxes import SHOWN
from . import compat
from .build import built_tree
from .trees import OfBuiltTree

BAR = 0.005
"""Thickness of a box's edges, in sizes of the tree."""


class BIH_OT_mesh_from_tree(OfBuiltTree, bpy.types.Operator):
    bl_idname = "bih.mesh_from_tree"
    bl_label = "Make Mesh from Tree"
    bl_description = (
        "Make real geometry of the built tree's boxes or clip planes, a mesh for each kind and depth, in a new "
        "collection, instead of the overlay. Takes time and the scene's memory for each box; undo takes it away"
    )
    bl_options = {"REGISTER", "UNDO"}

    shown: EnumProperty(
        name="Show",
        description="What becomes geometry",
        items=[
            ("planes", "Clip Planes", "The clip planes, and the boxes of leaves"),
            ("boxes", "Boxes", "The box of every node"),
            ("leaves", "Leaves", "The boxes of leaves alone"),
        ],
    )
    first_depth: IntProperty(name="From Depth", description="The first level", min=0, default=0)
    last_depth: IntProperty(name="To Depth", description="The last level; each may double the memory", min=0, default=4)
    as_frames: BoolProperty(
        name="Boxes as Frames",
        description="Only the edges of boxes, as bars, so that one can look inside",
        default=True,
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        chosen = context.scene.bih_overlay
        self.first_depth, self.last_depth = chosen.first_depth, chosen.last_depth
        if chosen.shown in SHOWN:
            self.shown = chosen.shown
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            made = meshes(context, self.shown, self.first_depth, self.last_depth, as_frames=self.as_frames)
        except UserError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.scene.bih_overlay.is_shown = False  # it would flicker through the same places
        self.report({"INFO"}, f"BIH: {len(made.objects)} meshes in collection {made.name!r}")
        return {"FINISHED"}


def meshes(context: bpy.types.Context, shown: str, first: int, last: int, *, as_frames: bool) -> bpy.types.Collection:
    """A new collection of the scene with one object for each kind and depth. Raises UserError."""
    from ..pipeline import tree_mesh

    built = built_tree(context)
    found = tree_mesh.tree_meshes(built.nodes, shown, first, last)
    collection = bpy.data.collections.new(f"Tree of {context.scene.name}")
    context.scene.collection.children.link(collection)
    lower, upper = built.tree.bounds
    bar = BAR * float(((upper - lower) ** 2).sum() ** 0.5)
    for part in found:
        made = bpy.data.objects.new(part.name, _mesh(part))
        collection.objects.link(made)
        made.color = made.data.materials[0].diffuse_color
        if as_frames and part.name.startswith(("Box", "Leaf", "Unbuilt")):
            frame = made.modifiers.new("Frame", "WIREFRAME")
            frame.thickness, frame.use_relative_offset = bar, False
    return collection


def _mesh(part: Any) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(part.name)
    mesh.from_pydata(part.vertices.tolist(), [], part.faces.tolist())
    mesh.materials.append(_material(part.kind))
    return mesh


def _material(kind: Any) -> bpy.types.Material:
    """One for each kind, in the colour of the overlay, shared by all trees."""
    from ..pipeline import overlay_style, tree_mesh

    name = f"BIH {tree_mesh.NAMES[kind]}"
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        red, green, blue = Color(overlay_style.VIEWPORT_COLOURS[kind]).from_srgb_to_scene_linear()
        material.diffuse_color = (red, green, blue, 1.0)
        compat.use_nodes(material)
        principled = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        principled.inputs["Base Color"].default_value = (red, green, blue, 1.0)
    return material
