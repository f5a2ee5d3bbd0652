"""For scripts: everything that a depsgraph shows, to cast a million rays at in one call.

    from bl_ext.user_default.bih.addon.blender import scripting
    shown = scripting.shown()
    hits = shown.scene.intersect(origins, directions)   # (N, 3) each; hits.t, .triangle, .instance, .u and .v
    names = [shown.names[row] for row in hits.instance[hits.hit]]

`user_default` is the repository that the extension was installed into: Blender's preferences name it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy

from ..pipeline.errors import UserError
from . import modules
from .export import contents

if TYPE_CHECKING:
    import bihtree


@dataclass(frozen=True)
class Shown:
    """`names`, one for each row that hits.instance may have, are those of the objects whose meshes the instances show;
    `skipped` says what is not there, and why."""

    scene: bihtree.Scene
    names: tuple[str, ...]
    skipped: tuple[str, ...]


def shown(depsgraph: bpy.types.Depsgraph | None = None, *, threads: int = 0, **options: Any) -> Shown:
    """A bihtree.Scene of all that `depsgraph` shows, in world space; None: what the viewport shows now. A mesh that
    several instances show has one tree. It stays as it is when Blender's scene changes.

    `threads`: of construction and queries; 0: all. `options` are others of bihtree.Tree: structure, layout, build,
    heuristic, precision, leaf_size.

    Raises UserError for a vertex that is not finite, where there are no triangles, and where bihtree is
    missing; ValueError for options that do not go together.
    """
    modules.require("bihtree")
    import bihtree

    found = contents(bpy.context.evaluated_depsgraph_get() if depsgraph is None else depsgraph)
    for mesh in found.meshes:
        mesh.check_finite()
    if not found.triangle_count:
        raise UserError(f"scene {found.name!r} has no triangles to trace; add an object with faces")
    trees = [bihtree.Tree(mesh.vertices, mesh.triangles, threads=threads, **options) for mesh in found.meshes]
    scene = bihtree.Scene(trees, found.instance_mesh, found.instance_matrix, threads=threads)
    names = tuple(found.meshes[row].name for row in found.instance_mesh)
    return Shown(scene, names, tuple(found.skipped))
