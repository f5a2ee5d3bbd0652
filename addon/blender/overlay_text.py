"""The words over a 3D viewport: what the colours mean, the scale of the cost map, the structures' names."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..pipeline import cost_map, overlay_legend_lines
from ..pipeline import overlay_style as style
from .properties import STRUCTURE_TEXT
from .trees import SceneTrees

FONT = 0
SIZE = 12
PANEL = (0.05, 0.05, 0.05, 0.72)
INK = (0.95, 0.95, 0.95, 1.0)


def draw(
    context: bpy.types.Context, trees: SceneTrees, chosen: bpy.types.PropertyGroup, entries: list[tuple[Any, str]]
) -> None:
    """Lower left, beside the toolbar; the names of two structures stand above them."""
    import blf
    import gpu

    unit = context.preferences.system.ui_scale
    blf.size(FONT, SIZE * unit)
    gpu.state.blend_set("ALPHA")
    left, bottom = _free_corner(context, unit)
    has_scale = chosen.cost and trees.cost is not None
    top = _draw_entries(entries, left, bottom, unit)
    if has_scale:
        _draw_scale(trees.cost, left, top + 10 * unit, unit)
    if trees.other is not None:
        _draw_names(context, trees, unit)
    gpu.state.blend_set("NONE")


def _draw_entries(entries: list[tuple[Any, str]], left: float, bottom: float, unit: float) -> float:
    """The upper end of what was drawn."""
    import blf

    if not entries:
        return bottom
    pitch, pad, swatch = 1.5 * SIZE * unit, 8 * unit, 22 * unit
    width = max(blf.dimensions(FONT, text)[0] for _, text in entries) + swatch + 3 * pad
    height = pitch * len(entries) + pad
    _rectangle(left, bottom, width, height, PANEL)
    for number, (kind, text) in enumerate(reversed(entries)):
        y = bottom + pad + number * pitch
        if kind is not None:
            _rectangle(left + pad, y, swatch, SIZE * unit * 0.8, (*style.VIEWPORT_COLOURS[kind], 1.0))
        _text(left + (2 * pad + swatch if kind is not None else pad), y, text)
    return bottom + height


def _draw_scale(cost: Any, left: float, bottom: float, unit: float) -> None:
    pad, width, height = 8 * unit, 220 * unit, 12 * unit
    _rectangle(left, bottom, width + 2 * pad, 5.2 * SIZE * unit, PANEL)
    _ramp(left + pad, bottom + 1.9 * SIZE * unit, width, height)
    _text(left + pad, bottom + 3.7 * SIZE * unit, "Nodes and triangles for a ray")
    _text(left + pad, bottom + 0.6 * SIZE * unit, f"{cost.least}")
    _text(left + pad + width, bottom + 0.6 * SIZE * unit, f"{cost.most} and more", is_right=True)


def _draw_names(context: bpy.types.Context, trees: SceneTrees, unit: float) -> None:
    """Above the box of each structure as it is seen."""
    import blf
    from bpy_extras.view3d_utils import location_3d_to_region_2d

    from ..pipeline.overlay_boxes import boxes_of
    from .overlay_layers import beside

    assert trees.main is not None
    labels, places = [], []
    for built, move in ((trees.main, 0.0), (trees.other, beside(trees))):
        assert built is not None
        corners = boxes_of(built.nodes[:1])[0] + move
        seen = [location_3d_to_region_2d(context.region, context.region_data, corner) for corner in corners.tolist()]
        if None in seen:
            continue
        stats = built.tree.stats
        below = (
            f"{stats.tree_bytes / max(1, stats.triangles):.0f} bytes a triangle, built in {stats.build_seconds:.3f} s"
        )
        labels.append((STRUCTURE_TEXT[stats.structure][0], below))
        x, top = sum(place.x for place in seen) / len(seen), max(place.y for place in seen)
        places.append((x, top + 0.8 * SIZE * unit, blf.dimensions(FONT, below)[0] + 2 * SIZE * unit))
    lower = overlay_legend_lines.apart(places, 3.2 * SIZE * unit)
    for (name, below), (x, _, _), y in zip(labels, places, lower, strict=True):
        _text(x, y + 1.4 * SIZE * unit, name, is_centred=True)
        _text(x, y, below, is_centred=True)


def _free_corner(context: bpy.types.Context, unit: float) -> tuple[float, float]:
    """Beside the toolbar, and above what Blender says of the last operator."""
    sizes = {region.type: (region.width, region.height) for region in context.area.regions}
    wide, high = sizes.get("TOOLS", (0, 0))[0], sizes.get("HUD", (0, 0))[1]
    return (wide if wide > 1 else 0) + 12 * unit, (high + 12 * unit if high > 1 else 0) + 12 * unit


def _text(x: float, y: float, text: str, *, is_right: bool = False, is_centred: bool = False) -> None:
    import blf

    width = blf.dimensions(FONT, text)[0]
    blf.position(FONT, x - width * (1.0 if is_right else 0.5 if is_centred else 0.0), y, 0)
    blf.color(FONT, *INK)
    blf.draw(FONT, text)


def _ramp(x: float, y: float, width: float, height: float) -> None:
    """The colours of the scale from left to right."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    shares = np.linspace(0.0, 1.0, 64)
    corners = [(x + share * width, y + end) for share in shares.tolist() for end in (0.0, height)]
    colours = [(*colour, 1.0) for colour in cost_map.ramp(shares).tolist() for _ in range(2)]
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batch_for_shader(shader, "TRI_STRIP", {"pos": corners, "color": colours}).draw(shader)


def _rectangle(x: float, y: float, width: float, height: float, colour: tuple[float, ...]) -> None:
    import gpu
    from gpu_extras.batch import batch_for_shader

    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    batch = batch_for_shader(shader, "TRIS", {"pos": corners}, indices=[(0, 1, 2), (0, 2, 3)])
    shader.uniform_float("color", colour)
    batch.draw(shader)
