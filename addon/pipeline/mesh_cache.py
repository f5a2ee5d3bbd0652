"""Meshes of one export kept for the next: one object for as long as its content stays, so that its tree stays too."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import fields
from typing import Any

import numpy as np

from .mesh import Mesh


class MeshCache:
    """Between two calls of `forget_unused` is one export."""

    def __init__(self) -> None:
        self.read = 0
        """How many meshes were read in all, changed or not."""
        self._meshes: dict[Hashable, Mesh] = {}
        self._used: set[Hashable] = set()

    def mesh(self, identity: Hashable, read: Callable[[], Mesh], *, maybe_changed: bool = True) -> Mesh:
        """The mesh of this identity: the one that is kept unless it may have changed, else what `read` gives; of two
        with the same content, to the bit, the one that is kept."""
        kept = self._meshes.get(identity)
        self._used.add(identity)
        if kept is not None and not maybe_changed:
            return kept
        fresh = read()
        self.read += 1
        if kept is not None and have_same_content(kept, fresh):
            return kept
        self._meshes[identity] = fresh
        return fresh

    def forget_unused(self) -> None:
        """Let go of what was not asked for since the last call: its object is gone."""
        self._meshes = {identity: mesh for identity, mesh in self._meshes.items() if identity in self._used}
        self._used.clear()


def have_same_content(a: Mesh, b: Mesh) -> bool:
    return all(_are_equal(getattr(a, field.name), getattr(b, field.name)) for field in fields(Mesh))


def _are_equal(a: Any, b: Any) -> bool:
    if not (isinstance(a, np.ndarray) and isinstance(b, np.ndarray)):
        return bool(a == b)
    # Bytes, because NaN is not itself: a mesh that has one is the same mesh all the same.
    return a.dtype == b.dtype and a.shape == b.shape and _bytes(a) == _bytes(b)


def _bytes(array: np.ndarray[Any, Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
