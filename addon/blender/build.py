"""Building a tree to look at, and freeing it."""

from __future__ import annotations

from typing import Any

import bpy

from ..pipeline.camera import CameraView
from ..pipeline.errors import UserError
from ..pipeline.scene import SceneData
from ..pipeline.settings import Settings
from .camera import scene_view
from .properties import settings_of
from .scene_work import SceneWork
from .trees import NO_TREE, TREES, OfBuiltTree, redraw, sources
from .worker import Worker

LOOK = (320, 240)
"""Pixels of the look that tells rays a second."""


class BIH_OT_build(SceneWork, bpy.types.Operator):
    bl_idname = "bih.build"
    bl_label = "Build"
    bl_description = (
        "Build the tree of what the viewport shows, by the choices above, and trace 76,800 rays of the camera. "
        "Takes the build's time and memory until Free; Esc ends it"
    )

    _sources: frozenset[int] = frozenset()

    def started(self, context: bpy.types.Context) -> Worker[Any]:
        self._sources = sources(context)
        return build_worker(
            self.scene_read(context), look(context.evaluated_depsgraph_get()), settings_of(context.scene)
        )

    def finished(self, context: bpy.types.Context, result: Any) -> str:
        trees = TREES.of(context.scene)
        trees.free()
        trees.main, trees.sources = result, self._sources
        trees.count_gone(context.scene)
        redraw(context)
        stats = result.tree.stats
        return f"BIH: {stats.triangles:,} triangles, {stats.nodes:,} nodes in {stats.build_seconds:.3f} s"


class BIH_OT_free(OfBuiltTree, bpy.types.Operator):
    bl_idname = "bih.free"
    bl_label = "Free"
    bl_description = "Give the memory of the built trees back; the next look at one takes the build's time again"

    def execute(self, context: bpy.types.Context) -> set[str]:
        TREES.of(context.scene).free()
        redraw(context)
        return {"FINISHED"}


def build_worker(scene: SceneData, view: CameraView | None, settings: Settings) -> Worker[Any]:
    """Build in a thread, and trace what `view` sees."""
    from ..pipeline import built

    return Worker("BIH build", lambda told: built.build(scene, settings, view, told=told))


def look(depsgraph: bpy.types.Depsgraph) -> CameraView | None:
    """What the scene's camera sees; None where there is none that can be traced."""
    try:
        return scene_view(depsgraph, *LOOK)
    except UserError:
        return None


def built_tree(context: bpy.types.Context) -> Any:
    """The tree of the scene. Raises UserError where none was built."""
    tree = TREES.of(context.scene).main
    if tree is None:
        raise UserError(NO_TREE)
    return tree
