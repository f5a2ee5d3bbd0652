"""Where the versions of Blender differ, from 4.2 on: nothing else asks for a version or an attribute."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np


def keeps_memory_of_instances() -> bool:
    """Whether `object_instances.foreach_get` leaves behind what the first object shows."""
    return bpy.app.version < (5, 0, 0)


def modifier_errors(modifier: bpy.types.Modifier) -> list[str]:
    """What geometry nodes say that goes wrong; Blender 5.0 was the first to tell. Other modifiers tell nobody."""
    return [warning.message for warning in getattr(modifier, "node_warnings", ()) if warning.type == "ERROR"]


def point_shader() -> str:
    """The name of gpu's own shader for points of one colour; from 4.5 on they have one of their own."""
    return "POINT_UNIFORM_COLOR" if bpy.app.version >= (4, 5, 0) else "UNIFORM_COLOR"


def material_index_panel() -> str:
    """The name of Eevee's panel for a material's Pass Index; in 5.0 it took the name of another one."""
    later = "EEVEE_NEXT_MATERIAL_PT_settings"
    return later if hasattr(bpy.types, later) else "EEVEE_MATERIAL_PT_settings"


def use_nodes(material: bpy.types.Material) -> None:
    """Give it shader nodes; from 5.0 on every material has some."""
    if material.node_tree is None:
        material.use_nodes = True


def light_factor(light: bpy.types.Light) -> np.ndarray:
    """(3,) exposure and temperature, which Blender 4.5 brought; before it a light has neither."""
    factor = np.full(3, 2.0 ** getattr(light, "exposure", 0.0))
    if getattr(light, "use_temperature", False):
        factor *= light.temperature_color
    return factor


def casts_shadows(light: bpy.types.Light) -> bool:
    return bool(getattr(light, "use_shadow", True))


def light_notes(light: bpy.types.Light) -> list[str]:
    """What of a light is not traced."""
    notes = []
    if light.type == "AREA" and getattr(light, "spread", np.pi) < np.pi - 1e-3:
        notes.append("its spread is not traced")
    if not getattr(light, "normalize", True):
        notes.append("it is traced as if its power were normalised")
    return notes


def uses_nodes(block: bpy.types.Material | bpy.types.World) -> bool:
    """From Blender 5.0 on every material and world has nodes, and the question is deprecated."""
    return bpy.app.version >= (5, 0, 0) or bool(block.use_nodes)


@contextmanager
def as_png(settings: bpy.types.ImageFormatSettings) -> Iterator[None]:
    """Files are PNG of 8 bits with alpha meanwhile; from 5.0 on they are of a kind first."""
    names = [name for name in ("media_type", "file_format", "color_mode", "color_depth") if hasattr(settings, name)]
    before = {name: getattr(settings, name) for name in names}
    wanted = {"media_type": "IMAGE", "file_format": "PNG", "color_mode": "RGBA", "color_depth": "8"}
    try:
        for name in names:
            setattr(settings, name, wanted[name])
        yield
    finally:
        for name in names:
            setattr(settings, name, before[name])
