"""The answers to a batch of rays."""

from typing import final

import numpy as np
from numpy.typing import NDArray

__all__ = ["HitLists", "Hits"]

@final
class Hits:
    """The answer to a batch of N rays, as NumPy arrays that own their memory."""

    @property
    def t(self) -> NDArray[np.floating]:
        """(N,) distance along the ray; inf where nothing was hit. Within one unit in the last place of the true value
        in float32 and where precision is "exact", else within 2^-40 of it, relatively; no such promise where precision
        is "fast"."""

    @property
    def triangle(self) -> NDArray[np.int32]:
        """(N,) the caller's row; -1 where nothing was hit."""

    @property
    def u(self) -> NDArray[np.floating]:
        """(N,) barycentric weight of the triangle's second vertex, 0 for a miss; within 2^-32 and one rounding, where
        precision is "exact" within one unit in the last place."""

    @property
    def v(self) -> NDArray[np.floating]:
        """(N,) and of its third."""

    @property
    def instance(self) -> NDArray[np.int32]:
        """(N,) the row of the instance in a Scene, 0 for a hit in a Tree, -1 for a miss."""

    @property
    def invalid(self) -> int:
        """Rays that no answer could be given for."""

    @property
    def hit(self) -> NDArray[np.bool_]:
        """(N,) whether anything was hit."""

    def __len__(self) -> int: ...

@final
class HitLists:
    """All triangles hit by each of N rays (both at a shared edge), as NumPy arrays that own their memory: M hits in
    all, those of ray i in the rows offsets[i]:offsets[i+1], nearest first and of equal distances the lower row
    first."""

    @property
    def offsets(self) -> NDArray[np.int64]:
        """(N+1,) where the hits of each ray start, and where the last ones end: the first is 0, the last is M. A ray
        that hits nothing, and an invalid one, has none."""

    @property
    def t(self) -> NDArray[np.floating]:
        """(M,) distance along the ray, in units of the direction's length; dtype and error as of `Hits.t`. Their order
        is that of the true values, whatever they are rounded to; where precision is "fast", that of these numbers."""

    @property
    def triangle(self) -> NDArray[np.int32]:
        """(M,) the caller's row; none twice for one ray."""

    @property
    def u(self) -> NDArray[np.floating]:
        """(M,) barycentric weight of the triangle's second vertex, as of `Hits.u`."""

    @property
    def v(self) -> NDArray[np.floating]:
        """(M,) and of its third."""

    @property
    def instance(self) -> NDArray[np.int32]:
        """(M,) the row of the instance in a Scene, 0 in a Tree."""

    def __len__(self) -> int:
        """N, the rays."""
