"""Where the versions of Blender differ, from 4.2 on: nothing else asks for a version or an attribute."""

from __future__ import annotations

import bpy


def modifier_errors(modifier: bpy.types.Modifier) -> list[str]:
    """What geometry nodes say that goes wrong; Blender 5.0 was the first to tell. Other modifiers tell nobody."""
    return [warning.message for warning in getattr(modifier, "node_warnings", ()) if warning.type == "ERROR"]


def point_shader() -> str:
    """The name of gpu's own shader for points of one colour; from 4.5 on they have one of their own."""
    return "POINT_UNIFORM_COLOR" if bpy.app.version >= (4, 5, 0) else "UNIFORM_COLOR"


def use_nodes(material: bpy.types.Material) -> None:
    """Give it shader nodes; from 5.0 on every material has some."""
    if material.node_tree is None:
        material.use_nodes = True
