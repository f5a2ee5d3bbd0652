"""The one owner of trees that were built to be looked at, by scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy

if TYPE_CHECKING:  # the add-on registers where bihtree is missing
    from ..pipeline.built import BuiltTree
    from ..pipeline.cost_map import CostMap
    from ..pipeline.ray_path import RayPath


WITHOUT_TRIANGLES = frozenset({"CAMERA", "LIGHT", "LIGHT_PROBE", "SPEAKER", "ARMATURE", "LATTICE"})


@dataclass
class SceneTrees:
    """What was built of one scene, and what is looked at: `other` is the second structure beside it, `path` the picked
    ray, `selected` a row of main.nodes or -1. `sources` are the objects that `main` was built of, by their numbers, and
    `gone` says how many of them are no longer in the scene."""

    main: BuiltTree | None = None
    sources: frozenset[int] = frozenset()
    gone: int = 0
    other: BuiltTree | None = None
    path: RayPath | None = None
    selected: int = -1
    cost: CostMap | None = None
    bounds: Any = None
    """Boxes (N, 2, 3) of what is being read and built, where that is many instances."""

    @property
    def is_there(self) -> bool:
        """Whether there is a tree, and anything that it was built of is still in the scene: undo brings both back."""
        return self.main is not None and self.gone < len(self.sources)

    def count_gone(self, scene: bpy.types.Scene) -> None:
        """All objects are looked at: only when some may have come or gone, never at a redraw."""
        if self.main is not None:
            self.gone = len(self.sources.difference(found.session_uid for found in scene.objects))

    def read_again(self) -> None:
        """Rays may have built more of a tree on demand: its nodes have other rows then."""
        if self.main is not None and self.main.tree.stats.build == "on_demand":
            self.main.read_nodes()
            self.path, self.selected = None, -1

    def free(self) -> None:
        self.main = self.other = self.path = self.cost = None
        self.sources, self.gone, self.selected = frozenset(), 0, -1


class Trees:
    def __init__(self) -> None:
        self._by_scene: dict[int, SceneTrees] = {}

    def of(self, scene: bpy.types.Scene) -> SceneTrees:
        """Its own, empty at first; the number lasts as long as the file is open, undo included."""
        return self._by_scene.setdefault(scene.session_uid, SceneTrees())

    def free_all(self) -> None:
        self._by_scene.clear()


TREES = Trees()


def sources(context: bpy.types.Context) -> frozenset[int]:
    """The objects that triangles of what the viewport shows may come from; their numbers last as that of the scene."""
    return frozenset(
        shown.session_uid
        for shown in context.view_layer.objects
        if shown.type not in WITHOUT_TRIANGLES
        and (shown.type != "EMPTY" or shown.instance_type != "NONE")
        and shown.visible_get()
    )


def redraw(context: bpy.types.Context) -> None:
    """All that shows trees: 3D viewports and the properties."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "PROPERTIES"}:
                area.tag_redraw()


NO_TREE = "no tree is built; press Build, or call bpy.ops.bih.build()"


class OfBuiltTree:
    """What operators that are about a built tree have beside Blender's own: without one they are grey, and say why."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        is_built = TREES.of(context.scene).main is not None
        if not is_built:
            cls.poll_message_set(NO_TREE)  # type: ignore[attr-defined]
        return is_built


@bpy.app.handlers.persistent
def free_all(*_: object) -> None:
    """Another file is opened: what was built of this one is gone with it."""
    TREES.free_all()


@bpy.app.handlers.persistent
def count_gone(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Objects that come or go change a scene or a collection; those that move change neither."""
    if depsgraph.id_type_updated("SCENE") or depsgraph.id_type_updated("COLLECTION"):
        TREES.of(scene).count_gone(scene)


@bpy.app.handlers.persistent
def count_gone_of_all(*_: object) -> None:
    """Undo and redo say of nothing what they changed."""
    for scene in bpy.data.scenes:
        TREES.of(scene).count_gone(scene)


def register() -> None:
    for handlers, called in _handlers():
        handlers.append(called)


def unregister() -> None:
    for handlers, called in _handlers():
        handlers.remove(called)
    TREES.free_all()


def _handlers() -> tuple[tuple[Any, Any], ...]:
    """Blender's lists, and what of ours is in each while the add-on is registered."""
    known = bpy.app.handlers
    return (
        (known.load_pre, free_all),
        (known.depsgraph_update_post, count_gone),
        (known.undo_post, count_gone_of_all),
        (known.redo_post, count_gone_of_all),
    )
