"""Trees of one picture kept for the next one: what has not changed is not built again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter
from typing import Any

import bihtree

from .mesh import Mesh
from .scene import SceneData

Options = Mapping[str, Any]
Progress = Callable[[float], bool | None]


class TreeCache:
    """Meshes are the same where they are the same object (addon/pipeline/mesh_cache.py keeps them so)."""

    def __init__(self) -> None:
        self.built = 0
        """How many trees were built in all."""
        self._tree: bihtree.Tree | None = None
        self._scene: bihtree.Scene | None = None
        self._meshes: list[Mesh] = []
        self._made_of: tuple[Any, ...] = ()
        self._of_mesh: dict[int, tuple[Mesh, bihtree.Tree]] = {}

    def tree(
        self, scene: SceneData, flatten: Options, options: Options, progress: Progress | None = None
    ) -> tuple[bihtree.Tree, float]:
        """The tree over all of `scene`, built by `options` of bihtree.Tree, and the seconds that flattening took.

        Raises UserError as SceneData.flatten does, and bihtree.Cancelled where `progress` returns False.
        """
        meshes = [scene.meshes[row] for row in scene.instance_mesh]
        made_of = (tuple(flatten.items()), tuple(options.items()), scene.instance_matrix.tobytes())
        is_kept = self._made_of == made_of and _are_same(meshes, self._meshes)
        if self._tree is not None and is_kept:
            return self._tree, 0.0
        started = perf_counter()
        vertices, triangles = scene.flatten(**flatten)
        flatten_seconds = perf_counter() - started
        self._tree, self._scene, self._of_mesh = None, None, {}
        tree = bihtree.Tree(vertices, triangles, **options, copy=False, progress=progress)
        self._tree, self._meshes, self._made_of = tree, meshes, made_of
        self.built += 1
        return tree, flatten_seconds

    def scene(self, scene: SceneData, options: Options, progress: Progress | None = None) -> bihtree.Scene:
        """One tree a mesh of `scene`, which borrows the arrays, and the instances that show it. Of what was there
        before only new meshes are built, and where nothing but matrices changed only the tree over the instances.

        Raises bihtree.Cancelled where `progress` returns False.
        """
        meshes = list(scene.meshes)
        made_of = (tuple(options.items()), scene.instance_mesh.tobytes())
        places = scene.instance_matrix.tobytes()
        made = self._scene
        if made is not None and self._made_of[:2] == made_of and _are_same(meshes, self._meshes):
            if self._made_of[2] != places:
                made.set_matrices(scene.instance_matrix)
                self._made_of = (*made_of, places)
            return made
        if made is None or self._made_of[0] != made_of[0]:
            self._of_mesh = {}
        self._tree = self._scene = None
        kept = self._of_mesh
        self._of_mesh = {id(mesh): kept[id(mesh)] for mesh in meshes if id(mesh) in kept}
        for number, mesh in enumerate(meshes):
            if id(mesh) not in self._of_mesh:
                told = None if progress is None else _share(progress, number, len(meshes))
                tree = bihtree.Tree(mesh.vertices, mesh.triangles, **options, copy=False, progress=told)
                self._of_mesh[id(mesh)] = (mesh, tree)
                self.built += 1
        trees = [self._of_mesh[id(mesh)][1] for mesh in meshes]
        threads = int(options.get("threads", 0))
        made = bihtree.Scene(trees, scene.instance_mesh, scene.instance_matrix, threads=threads)
        self._scene, self._meshes, self._made_of = made, meshes, (*made_of, places)
        return made


def _share(progress: Progress, number: int, count: int) -> Progress:
    return lambda done: progress((number + done) / count)


def _are_same(some: list[Mesh], others: list[Mesh]) -> bool:
    return len(some) == len(others) and all(a is b for a, b in zip(some, others, strict=True))
