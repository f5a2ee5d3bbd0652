"""The only file that draws with gpu: the overlay in 3D viewports.

Nothing of gpu is touched at import or when the add-on registers: under --background there is none.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..pipeline import overlay_style as style
from ..pipeline.overlay_boxes import SHOWN
from . import compat
from .trees import TREES, SceneTrees

NEARER = 2e-5
"""How much nearer, in parts of the depth range, the coloured mesh lies than the mesh that Blender draws."""

FEW = 10_000
"""Up to so many lines and points are drawn a second time, faintly, where a surface hides them."""

MOST_POINT = 3.0
"""Pixels of the side of a point."""

WIDE = 1.3
"""Lines of more pixels are drawn as bands: too slow for many of them."""
MOST_WIDE = 2_000


@dataclass
class Batches:
    """What the GPU has of one chunk, made when it is first drawn that way."""

    chunk: Any
    lines: Any = None
    points: Any = None
    wide: Any = None


@dataclass
class Drawn:
    """Outlines with their batches."""

    outlines: Any
    batches: list[Batches] = field(init=False)

    def __post_init__(self) -> None:
        self.batches = [Batches(chunk) for chunk in self.outlines.chunks]


class Overlay:
    """Draws the trees of each viewport's scene; what the GPU has is kept until its tree or the range changes."""

    def __init__(self) -> None:
        self._handles: list[Any] = []
        self._layers: dict[int, Any] = {}
        """Layers by scene."""

    def start(self) -> None:
        view = bpy.types.SpaceView3D
        for draw, when in ((self.draw_view, "POST_VIEW"), (self.draw_text, "POST_PIXEL")):
            self._handles.append(view.draw_handler_add(draw, (), "WINDOW", when))

    def stop(self) -> None:
        while self._handles:
            bpy.types.SpaceView3D.draw_handler_remove(self._handles.pop(), "WINDOW")
        self.forget()

    def forget(self) -> None:
        """What the GPU has."""
        self._layers.clear()

    def draw_view(self) -> None:
        """Called by Blender for each viewport, with its matrices set."""
        scene = bpy.context.scene
        trees, chosen = TREES.of(scene), scene.bih_overlay
        if trees.bounds is not None:
            self._draw_bounds(scene, trees)
            return
        if scene.session_uid in self._layers:
            self._layers[scene.session_uid].drop("bounds")
        if not trees.is_there:
            self._layers.pop(scene.session_uid, None)
            return
        if not chosen.is_shown or not _shows_overlays():
            return
        import gpu

        layers = self._layers_of(scene)
        gpu.state.blend_set("ALPHA")
        gpu.state.depth_mask_set(False)
        _draw_meshes(layers, trees, chosen)
        _draw_tree(layers, "main", trees, chosen, None)
        if trees.other is not None:
            from .overlay_layers import beside

            _draw_tree(layers, "other", trees, chosen, beside(trees))
        gpu.state.depth_test_set("NONE")
        if chosen.shown == "ray" and trees.path is not None:
            _draw_path(layers, trees)
        if trees.selected >= 0:
            _draw_selected(layers, trees)
        gpu.state.depth_mask_set(True)
        gpu.state.blend_set("NONE")

    def draw_text(self) -> None:
        """The legend, and what stands beside nodes; called with one unit a pixel."""
        scene = bpy.context.scene
        chosen, trees = scene.bih_overlay, TREES.of(scene)
        if not (trees.is_there and trees.bounds is None and chosen.is_shown and chosen.legend and _shows_overlays()):
            return
        from ..pipeline import overlay_legend_lines
        from . import overlay_text

        assert trees.main is not None
        nodes, shown, first, last = trees.main.nodes, chosen.shown, chosen.first_depth, chosen.last_depth
        entries = self._layers_of(scene).layer(
            "legend",
            (nodes, shown, first, last, trees.path),
            lambda: overlay_legend_lines.entries(nodes, shown, first, last, path=trees.path),
        )
        overlay_text.draw(bpy.context, trees, chosen, entries)

    def _draw_bounds(self, scene: bpy.types.Scene, trees: SceneTrees) -> None:
        """Of what is read and built now, in place of any tree."""
        if not scene.bih_overlay.is_shown or not _shows_overlays():
            return
        import gpu

        from . import overlay_layers

        gpu.state.blend_set("ALPHA")
        drawn = self._layers_of(scene).layer(
            "bounds", (trees.bounds,), lambda: Drawn(overlay_layers.bounds_outlines(trees.bounds))
        )
        _draw_outlines(drawn, in_front=True)
        gpu.state.depth_test_set("NONE")
        gpu.state.blend_set("NONE")

    def _layers_of(self, scene: bpy.types.Scene) -> Any:
        from .overlay_layers import Layers

        return self._layers.setdefault(scene.session_uid, Layers())


OVERLAY = Overlay()


def register() -> None:
    if not bpy.app.background:
        OVERLAY.start()


def unregister() -> None:
    OVERLAY.stop()


def most_lines(chosen: bpy.types.PropertyGroup) -> int:
    """As chosen; by itself what a redraw has time for."""
    import gpu

    from ..pipeline.overlay_detail import MOST_LINES, MOST_LINES_OF_A_GPU

    if chosen.most_lines:
        return int(chosen.most_lines)
    is_software = any(name in gpu.platform.renderer_get() for name in ("llvmpipe", "softpipe", "SwiftShader"))
    return MOST_LINES if is_software else MOST_LINES_OF_A_GPU


def _draw_meshes(layers: Any, trees: SceneTrees, chosen: bpy.types.PropertyGroup) -> None:
    from . import overlay_layers

    if trees.other is not None:
        mesh = layers.layer("other mesh", (trees.other,), lambda: _mesh_batch(overlay_layers.other_mesh(trees)))
        _draw_mesh(mesh)
    if chosen.cost and trees.cost is not None:
        mesh = layers.layer("cost", (trees.cost,), lambda: _mesh_batch(overlay_layers.cost_mesh(trees)))
        _draw_mesh(mesh)


def _draw_tree(
    layers: Any, name: str, trees: SceneTrees, chosen: bpy.types.PropertyGroup, move: NDArray[Any] | None
) -> None:
    from . import overlay_layers

    built: Any = trees.main if move is None else trees.other
    if chosen.shown not in SHOWN:
        return
    made_of = (built.nodes, chosen.shown, chosen.first_depth, chosen.last_depth)
    if chosen.filled and chosen.shown == "planes":
        filled = layers.layer(
            f"{name} faces",
            made_of,
            lambda: [(part, _batch("TRIS", part.corners)) for part in overlay_layers.faces(built, chosen, move)],
        )
        _draw_faces(filled, in_front=chosen.in_front)
    drawn = layers.layer(name, made_of, lambda: Drawn(overlay_layers.outlines(built, chosen, move)))
    _draw_outlines(drawn, in_front=chosen.in_front)


def _draw_path(layers: Any, trees: SceneTrees) -> None:
    from . import overlay_layers

    drawn = layers.layer("path", (trees.path,), lambda: Drawn(overlay_layers.path_outlines(trees)))
    _draw_outlines(drawn, in_front=True)
    ends = trees.path.ends.astype(np.float32)
    line = layers.layer("ray", (trees.path,), lambda: _batch("LINES", ends, wide=True))
    _draw_wide(line, (*style.RAY_COLOUR, 1.0), 3.0)


def _draw_selected(layers: Any, trees: SceneTrees) -> None:
    made_of = (trees.main.nodes, trees.selected)
    for batch, colour in layers.layer("selected", made_of, lambda: _selected_batches(trees)):
        _draw_wide(batch, (*colour, 1.0), 2.5)


def _selected_batches(trees: SceneTrees) -> list[tuple[Any, style.Colour]]:
    """The box of the selected node and its clip planes, with their colours."""
    from ..pipeline.overlay import EDGES
    from . import overlay_layers

    box = overlay_layers.selected_box(trees)[EDGES]
    planes = [
        (part.corners.reshape(-1, 3)[part.edges], style.VIEWPORT_COLOURS[part.kind])
        for part in overlay_layers.selected_outlines(trees).chunks
        if part.kind in (style.Kind.LEFT, style.Kind.RIGHT)
    ]
    return [(_batch("LINES", lines, wide=True), colour) for lines, colour in [(box, style.SELECTED_COLOUR), *planes]]


def _shows_overlays() -> bool:
    """Blender's own switch of all overlays in this viewport."""
    space = bpy.context.space_data
    return bool(space is not None and space.overlay.show_overlays)


def _shader(name: str) -> Any:
    import gpu

    return gpu.shader.from_builtin(name)


def _point_shader() -> Any:
    return _shader(compat.point_shader())


def _batch(kind: str, positions: NDArray[np.float32], edges: Any = None, *, wide: bool = False) -> Any:
    from gpu_extras.batch import batch_for_shader

    shader = _shader("POLYLINE_UNIFORM_COLOR") if wide else _point_shader() if kind == "POINTS" else None
    flat = np.ascontiguousarray(positions.reshape(-1, 3), np.float32)
    return batch_for_shader(shader or _shader("UNIFORM_COLOR"), kind, {"pos": flat}, indices=edges)


def _mesh_batch(mesh: Any) -> Any:
    from gpu_extras.batch import batch_for_shader

    return batch_for_shader(_shader("SMOOTH_COLOR"), "TRIS", {"pos": mesh.positions, "color": mesh.colours})


def _draw_mesh(batch: Any) -> None:
    """Opaque, over the mesh that Blender has drawn at the same place."""
    import gpu
    from mathutils import Matrix

    nearer = Matrix.Identity(4)
    nearer[2][3] = -NEARER
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    with gpu.matrix.push_pop_projection():
        gpu.matrix.load_projection_matrix(nearer @ gpu.matrix.get_projection_matrix())
        batch.draw(_shader("SMOOTH_COLOR"))
    gpu.state.depth_mask_set(False)


def _draw_faces(filled: list[tuple[Any, Any]], *, in_front: bool) -> None:
    import gpu

    shader = _shader("UNIFORM_COLOR")
    gpu.state.depth_test_set("NONE" if in_front else "LESS_EQUAL")
    for part, batch in filled:
        opacity = float(style.FACE_OPACITY[part.kind][min(part.depth, style.LEVELS - 1)])
        shader.uniform_float("color", (*style.VIEWPORT_COLOURS[part.kind], opacity))
        batch.draw(shader)


def _draw_outlines(drawn: Drawn, *, in_front: bool) -> None:
    """Lines or points, those of the upper levels last; what surfaces hide is faint, or is not drawn if it is much."""
    import gpu

    region, view = bpy.context.region, bpy.context.region_data
    extents = drawn.outlines.extents
    pixels = extents.pixels(np.array(view.perspective_matrix, np.float64), region.width, region.height)
    is_lines = extents.is_lines(pixels, most_lines(bpy.context.scene.bih_overlay))
    is_points = extents.is_points(pixels, is_lines)
    passes = [("NONE", 1.0)] if in_front else [("LESS_EQUAL", 1.0)]
    if not in_front and extents.lines[is_lines].sum() + extents.counts[is_points].sum() <= FEW:
        passes.insert(0, ("GREATER", style.HIDDEN))
    scale = bpy.context.preferences.system.ui_scale
    for test, strength in passes:
        gpu.state.depth_test_set(test)
        for number in np.flatnonzero(is_lines | is_points).tolist():
            _draw_chunk(drawn.batches[number], 0.0 if is_lines[number] else pixels[number], strength, scale)
    gpu.state.point_size_set(1.0)


def _draw_chunk(part: Batches, small: float, strength: float, scale: float) -> None:
    """As lines; where the outlines are no larger than `small` pixels, as points of about their size."""
    import gpu

    chunk = part.chunk
    opacity = strength * max(style.LEAST_OPACITY, style.line_opacity(chunk.kind, chunk.depth))
    colour = (*style.VIEWPORT_COLOURS[chunk.kind], opacity)
    width = scale * style.line_width(chunk.kind, chunk.depth)
    if small:
        if part.points is None:
            part.points = _batch("POINTS", chunk.centres)
        shader = _point_shader()
        gpu.state.point_size_set(min(max(1.0, round(small / 3)), MOST_POINT))
        shader.uniform_float("color", colour)
        part.points.draw(shader)
    elif width > WIDE and len(chunk.corners) * 12 <= MOST_WIDE:
        if part.wide is None:
            part.wide = _batch("LINES", chunk.corners.reshape(-1, 3)[chunk.edges], wide=True)
        _draw_wide(part.wide, colour, width)
    else:
        if part.lines is None:
            part.lines = _batch("LINES", chunk.corners, chunk.edges)
        shader = _shader("UNIFORM_COLOR")
        shader.uniform_float("color", colour)
        part.lines.draw(shader)


def _draw_wide(batch: Any, colour: tuple[float, ...], width: float) -> None:
    import gpu

    shader = _shader("POLYLINE_UNIFORM_COLOR")
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    shader.uniform_float("lineWidth", width)
    shader.uniform_float("color", colour)
    batch.draw(shader)
