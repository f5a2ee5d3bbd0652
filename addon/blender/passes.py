"""The passes of the pipeline under the names that Blender has for them."""

from __future__ import annotations

from collections.abc import Collection

import bpy

from ..pipeline.image import CHANNELS
from ..pipeline.settings import PASSES

KINDS = {1: "VALUE", 3: "VECTOR", 4: "COLOR"}
"""What Blender calls a pass of so many channels."""


def blender_passes(name: str) -> list[tuple[str, str]]:
    """Names and channels in the Render Result of one pass of the pipeline: those that its EXR files have."""
    parts: dict[str, str] = {}
    for channel in CHANNELS[name]:
        label, letter = channel.split(".")
        parts[label] = parts.get(label, "") + letter
    return list(parts.items())


def wanted_passes(view_layer: bpy.types.ViewLayer, chosen: Collection[str]) -> tuple[str, ...]:
    """The passes chosen for BIH, those that the view layer asks any engine for, and always Combined."""
    flags = {
        "depth": view_layer.use_pass_z,
        "normal": view_layer.use_pass_normal,
        "position": view_layer.use_pass_position,
        "object_index": view_layer.use_pass_object_index,
        "material_index": view_layer.use_pass_material_index,
    }
    asked = {"combined", *chosen, *(name for name, is_asked in flags.items() if is_asked)}
    return tuple(name for name in PASSES if name in asked)
