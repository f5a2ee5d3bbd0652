"""Blender's lights as rows of LIGHT_DTYPE."""

from __future__ import annotations

import bpy
import numpy as np

from ..pipeline.scene import LIGHT_DTYPE, POINT, SUN


def light_row(owner: bpy.types.Object, matrix: np.ndarray) -> tuple[np.void, str]:
    """One LIGHT_DTYPE row, and a note where the light is simplified.

    A sun keeps its irradiance (W/m²), any other light its power (W): a spot or an area light shines as a point
    light would from its place. Sizes are left out: shadows are hard. Colours are scene-linear.
    """
    light = owner.data
    row = np.zeros((), LIGHT_DTYPE)
    row["kind"] = SUN if light.type == "SUN" else POINT
    row["position"] = matrix[:3, 3]
    along = -matrix[:3, 2]
    row["direction"] = along / (np.linalg.norm(along) or 1.0)
    row["colour"] = light.energy * np.array(light.color) * _exposure_and_temperature(light)
    if light.type in {"SUN", "POINT"}:
        return row[()], ""
    return row[()], f"light {owner.name!r} ({light.type.lower()}) is traced as a point light"


def _exposure_and_temperature(light: bpy.types.Light) -> np.ndarray:
    """Blender 4.5 brought both properties; before it a light has neither."""
    factor = np.full(3, 2.0 ** getattr(light, "exposure", 0.0))
    if getattr(light, "use_temperature", False):
        factor *= light.temperature_color
    return factor
