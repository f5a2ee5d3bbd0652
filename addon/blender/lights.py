"""Blender's lights as rows of LIGHT_DTYPE."""

from __future__ import annotations

import bpy
import numpy as np

from ..pipeline.scene import ELLIPSE, LIGHT_DTYPE, POINT, RECTANGLE, SPOT, SUN
from .compat import casts_shadows, light_factor, light_notes

SHAPES = {"SQUARE": RECTANGLE, "RECTANGLE": RECTANGLE, "DISK": ELLIPSE, "ELLIPSE": ELLIPSE}


def light_row(owner: bpy.types.Object, matrix: np.ndarray) -> tuple[np.void, str]:
    """One LIGHT_DTYPE row, and a note where the light is simplified. Colours are scene-linear, powers Blender's."""
    light = owner.data
    row = np.zeros((), LIGHT_DTYPE)
    row["position"] = matrix[:3, 3]
    along, across = -matrix[:3, 2], matrix[:3, 0]
    row["direction"] = along / (np.linalg.norm(along) or 1.0)
    row["axis"] = across / (np.linalg.norm(across) or 1.0)
    row["colour"] = light.energy * np.array(light.color) * light_factor(light)
    row["shadowless"] = not casts_shadows(light)
    if light.type == "SUN":
        row["kind"], row["size"][0] = SUN, light.angle
    elif light.type == "AREA":
        _area(row, light, np.linalg.norm(matrix[:3, :2], axis=0))
    else:
        row["kind"], row["size"][0] = POINT, light.shadow_soft_size
    if light.type == "SPOT":
        row["kind"], row["spot"] = SPOT, (light.spot_size, light.spot_blend)
    notes = [f"light {owner.name!r}: {what}" for what in light_notes(light)]
    return row[()], "; ".join(notes)


def _area(row: np.ndarray, light: bpy.types.AreaLight, scale: np.ndarray) -> None:
    """An area's sides grow with its object; one without an area shines from its middle."""
    is_even = light.shape in {"SQUARE", "DISK"}
    row["kind"] = SHAPES[light.shape]
    row["size"] = np.array([light.size, light.size if is_even else light.size_y]) * scale
    if not np.linalg.norm(np.cross(row["axis"], row["direction"])):
        row["kind"], row["size"] = POINT, 0.0
