"""Meshes of one export kept for the next: one object for as long as its content stays, so that its tree stays too."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from .content import have_same_content
from .mesh import Mesh


class MeshCache:
    """Between two calls of `forget_unused` is one export."""

    def __init__(self) -> None:
        self.read = 0
        """How many meshes were read in all, changed or not."""
        self._meshes: dict[Hashable, tuple[int | None, Mesh]] = {}
        self._used: set[Hashable] = set()

    def mesh(self, identity: Hashable, read: Callable[[], Mesh], *, evaluation: int | None = None) -> Mesh:
        """The mesh of this identity: what `read` gives, or the one that is kept where that has the same content, to the
        bit. `evaluation` is a number that no other content has had: where it is the same as before, nothing is read."""
        kept = self._meshes.get(identity)
        self._used.add(identity)
        if kept and evaluation is not None and evaluation == kept[0]:
            return kept[1]
        fresh = read()
        self.read += 1
        mesh = kept[1] if kept and have_same_content(kept[1], fresh) else fresh
        self._meshes[identity] = evaluation, mesh
        return mesh

    def forget_unused(self) -> None:
        """Let go of what was not asked for since the last call: its object is gone."""
        self._meshes = {identity: kept for identity, kept in self._meshes.items() if identity in self._used}
        self._used.clear()
