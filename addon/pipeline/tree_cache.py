"""Trees of one picture kept for the next one: what has not changed is not built again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter
from typing import Any

import bihtree

from .mesh import Mesh
from .scene import SceneData

Options = Mapping[str, Any]


class TreeCache:
    """Meshes are the same where they are the same object (addon/pipeline/mesh_cache.py keeps them so)."""

    def __init__(self) -> None:
        self.built = 0
        """How many trees were built in all."""
        self._tree: bihtree.Tree | None = None
        self._meshes: list[Mesh] = []
        self._made_of: tuple[Any, ...] = ()

    def tree(
        self,
        scene: SceneData,
        flatten: Options,
        options: Options,
        progress: Callable[[float], bool | None] | None = None,
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
        self._tree = None
        self._tree = bihtree.Tree(vertices, triangles, **options, copy=False, progress=progress)
        self._meshes, self._made_of = meshes, made_of
        self.built += 1
        return self._tree, flatten_seconds


def _are_same(some: list[Mesh], others: list[Mesh]) -> bool:
    return len(some) == len(others) and all(a is b for a, b in zip(some, others, strict=True))
