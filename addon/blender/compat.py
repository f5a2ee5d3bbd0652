"""Where the versions of Blender differ, from 4.2 on: nothing else asks for a version or an attribute."""

from __future__ import annotations

import bpy


def modifier_errors(modifier: bpy.types.Modifier) -> list[str]:
    """What geometry nodes say that goes wrong; Blender 5.0 was the first to tell. Other modifiers tell nobody."""
    return [warning.message for warning in getattr(modifier, "node_warnings", ()) if warning.type == "ERROR"]
