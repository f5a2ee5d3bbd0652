"""What is looked at beside the tree: a second structure over the same mesh, and what rays to the mesh cost."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import bpy
import numpy as np

from ..pipeline.camera import distance_to_see
from ..pipeline.errors import UserError
from ..pipeline.settings import GOES_WITH, Settings
from .build import built_tree
from .modal_work import ModalWork
from .properties import settings_of
from .trees import TREES, OfBuiltTree, SceneTrees, redraw
from .worker import Worker

ROOM = 0.9
"""The share of what is seen that both structures fill."""


class BIH_OT_compare(OfBuiltTree, ModalWork, bpy.types.Operator):
    bl_idname = "bih.compare"
    bl_label = "Compare"
    bl_description = (
        "Build Other Structure over the same mesh, and show both side by side, from so far away that both are seen: "
        "the time and memory of another build"
    )

    _made: Any = None

    def started(self, context: bpy.types.Context) -> Worker[Any]:
        from ..pipeline import built

        made = self._made = built_tree(context)
        settings = other_settings(settings_of(context.scene), context.scene.bih_overlay.other_structure)
        return Worker("BIH compare", lambda told: built.rebuilt(made, settings, told=told))

    def finished(self, context: bpy.types.Context, result: Any) -> str:
        first, second = unchanged(context, self._made).tree.stats, result.tree.stats
        trees = TREES.of(context.scene)
        trees.other = result
        context.scene.bih_overlay.is_shown = True
        see_both(context, trees)
        redraw(context)
        return (
            f"BIH: {first.structure} {first.build_seconds:.3f} s, {first.tree_bytes:,} bytes; "
            f"{second.structure} {second.build_seconds:.3f} s, {second.tree_bytes:,} bytes"
        )


class BIH_OT_cost_map(OfBuiltTree, ModalWork, bpy.types.Operator):
    bl_idname = "bih.cost_map"
    bl_label = "Cost from View"
    bl_description = (
        "Trace a ray from this view to each vertex, and colour the mesh by the nodes that it visits and the triangles "
        "that it tests; Show brings the tree back. Takes about a second of time for a million vertices, 4 bytes of "
        "memory each"
    )

    _made: Any = None

    def started(self, context: bpy.types.Context) -> Worker[Any]:
        from ..pipeline.cost_map import cost_map

        made = self._made = built_tree(context)
        eye, along = eye_of(context)
        return Worker("BIH cost", lambda _told: cost_map(made.tree, made.vertices, eye, along))

    def finished(self, context: bpy.types.Context, result: Any) -> str:
        unchanged(context, self._made)
        TREES.of(context.scene).cost = result
        TREES.of(context.scene).read_again()
        chosen = context.scene.bih_overlay
        chosen.is_shown, chosen.cost, chosen.shown = True, True, "nothing"
        redraw(context)
        return f"BIH: from {result.least:,} to {result.most:,} nodes and triangles for a ray"


def unchanged(context: bpy.types.Context, made: Any) -> Any:
    """The tree that the work was about. Raises UserError where it was freed or built again meanwhile."""
    if TREES.of(context.scene).main is not made:
        raise UserError("the tree was freed or built again meanwhile; start again")
    return made


def other_settings(settings: Settings, structure: str) -> Settings:
    """The same with another structure: its own choices where it lacks those of the first."""
    own = {
        name: value if (value := getattr(settings, name)) in known else known[0]
        for name, known in GOES_WITH[structure].items()
    }
    return replace(settings, structure=structure, **own, leaf_size=None, parts={})


def see_both(context: bpy.types.Context, trees: SceneTrees) -> None:
    """The view from so far away that both structures are in it, beside the sidebar; one through a camera stays as it
    is."""
    from .overlay_layers import beside

    view = view_of(context)
    if view is None or view.view_perspective == "CAMERA":
        return
    assert trees.main is not None
    lower, upper = trees.main.tree.bounds.astype(np.float64)
    upper += beside(trees)
    centre = 0.5 * (lower + upper)
    turn = np.array(view.view_rotation.to_matrix(), np.float64)
    corners = (np.array(list(product(*zip(lower, upper, strict=True)))) - centre) @ turn
    sidebar = next((part.width for part in context.area.regions if part.type == "UI"), 0)
    free = max(0.2, 1.0 - 2.0 * sidebar / context.region.width)
    scale = 1.0 if view.is_perspective else view.view_distance
    slopes = (ROOM * free / (scale * view.window_matrix[0][0]), ROOM / (scale * view.window_matrix[1][1]))
    view.view_location = centre
    view.view_distance = distance_to_see(corners, slopes, perspective=view.is_perspective)


def view_of(context: bpy.types.Context) -> bpy.types.RegionView3D | None:
    """That of the 3D viewport that an operator was called from, if it was one."""
    return context.region_data if context.area is not None and context.area.type == "VIEW_3D" else None


def eye_of(context: bpy.types.Context) -> tuple[Any, Any]:
    """Where the view is from, and, of an orthographic one, where it looks; that of the scene's camera where there is no
    3D viewport. Raises UserError where there is neither."""
    view = view_of(context)
    if view is None:
        camera = context.scene.camera
        if camera is None:
            raise UserError("there is no view: call it from a 3D viewport, or give the scene a camera")
        return _eye(camera.matrix_world, camera.type == "CAMERA" and camera.data.type == "ORTHO")
    return _eye(view.view_matrix.inverted(), not view.is_perspective)


def _eye(matrix: Any, is_parallel: bool) -> tuple[Any, Any]:
    along = [-matrix[row][2] for row in range(3)]
    return list(matrix.translation), along if is_parallel else None
