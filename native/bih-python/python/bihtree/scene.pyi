"""Instances of trees."""

from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import Stats, Tree
from .hits import HitLists, Hits

__all__ = ["Scene"]

@final
class Scene:
    """Instances of trees: a tree over trees (docs/decisions/instances.md).

    What is hit is the image M·v of a triangle of the mesh, and the ray is as it is given: the inverse of a matrix only
    leads through the mesh's tree, and what it may be off by is allowed for (docs/accuracy.md, section 9). In trees of
    precision "exact" M·v is the real number that it is. In the others each coordinate of it is rounded once, to
    float64, the same for all triangles that share a vertex, so that no ray passes between them; then everything is
    decided exactly, also where precision is "fast". A triangle whose image has no area is not hit, nor is one whose
    image lies beyond the largest float64. Of equal t the lower instance is hit, and in it the lower triangle. The
    scene keeps its trees; any structure, layout and build will do, and several threads may query at once. A tree that
    is refitted is shown as it was until `set_matrices`.

    An instance whose matrix has no inverse, or none that float64 can lead by, gets a tree of its own over the images of
    its triangles; stats.left_out["inverse"] says how many there are."""

    def __new__(cls, trees: Sequence[Tree], instances: ArrayLike, matrices: ArrayLike, *, threads: int = 0) -> Scene:
        """instances: (M,) integer rows of `trees`; several may show one tree, and some trees none.
        matrices: (M, 4, 4) finite numbers, object to world, the last row of each (0, 0, 0, 1); mirrored, sheared and
            singular ones too.
        threads: of construction and queries; 0: all cores this process may use.

        Raises TypeError (a tree that is none), ValueError (trees of different precisions), GeometryError
        (shape, dtype, a row out of range, a number that is not finite).
        """

    def intersect(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> Hits:
        """The nearest hit of each ray: `triangle` is a row of the mesh, `instance` one of the scene. Arguments and
        errors as of `Tree.intersect`; float64 results where precision is "exact" or a tree has float64 vertices."""

    def occluded(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> NDArray[np.bool_]:
        """(N,) whether each ray hits anything; arguments and errors as of `Tree.intersect`."""

    def intersect_all(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        max_hits: int | None = None,
    ) -> HitLists:
        """All triangles that each ray hits, nearest first; of equal distances the lower instance first, and in it the
        lower triangle. Arguments and errors as of `Tree.intersect_all`."""

    def count(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> NDArray[np.int32]:
        """(N,) how often each ray crosses the surfaces of all instances, as of `Tree.count`."""

    def traversal_cost(self, origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(N,) nodes visited, of the upper tree and of those of the instances, and (N,) triangles tested by `intersect`
        for each ray; 0 for an invalid one."""

    def set_matrices(self, matrices: ArrayLike) -> None:
        """Put all instances to other places, in the same order: builds the upper tree again, and no tree of a mesh. A
        query that runs meanwhile in another thread goes on with the old places. Errors as of the constructor, and then
        everything stays as it was."""

    @property
    def trees(self) -> Sequence[Tree]:
        """Those that the instances show, in their order."""

    @property
    def stats(self) -> Stats:
        """What the upper tree is: its nodes, leaves and depth; triangles are those of all instances together,
        references the instances that can be hit, rejected the others. tree_bytes holds also what is kept of each
        instance, and the trees of their own that some have, but not those of the meshes."""

    @property
    def bounds(self) -> NDArray[np.floating]:
        """(2, 3) lower and upper corner of the instances' boxes, rounded outward to float32; inf and -inf for
        nothing."""

    def nodes(self, *, max_depth: int | None = None, limit: int | None = None) -> NDArray[np.void]:
        """The upper tree as `Tree.nodes` has it: what leaves refer to are instances, one each."""
