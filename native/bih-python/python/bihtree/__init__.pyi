"""bihtree: ray queries on triangle meshes by a Bounding Interval Hierarchy.

Conventions: right-handed; lengths are in whatever unit the caller has; directions need not be of unit length and `t`
is in units of the direction's length; a miss has triangle -1 and t = inf; triangle ids are the caller's rows. Triangles
are closed: their boundary is hit; degenerate ones and ones in the ray's plane are not. A hit has t_min <= t <= t_max.
Equal t: the lower row. All of this is decided exactly, for the vertices and rays as the real numbers that they are.

A ray with NaN in anything, an infinite origin or direction, a zero direction, t_min = inf or t_max = -inf is a miss,
counted in Hits.invalid. Floats of the results: float64 for precision "exact" or float64 vertices, else float32. A t
beyond the largest finite number is that number.

The same bits come out for any number of threads. Queries release the interpreter lock and may run from several Python
threads at once; Ctrl-C ends long ones. Where memory is short of what the work needs, it raises MemoryError with
the number of bytes before it begins.
"""

from collections.abc import Callable
from os import PathLike
from typing import Any, Literal, Self, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import BihError as BihError
from .errors import Cancelled as Cancelled
from .errors import FileFormatError as FileFormatError
from .errors import GeometryError as GeometryError
from .hits import HitLists as HitLists
from .hits import Hits as Hits
from .picture import Camera as Camera
from .picture import render as render
from .scene import Scene as Scene

__all__ = [
    "BihError",
    "Camera",
    "Cancelled",
    "FileFormatError",
    "GeometryError",
    "HitLists",
    "Hits",
    "Scene",
    "Stats",
    "Tree",
    "__version__",
    "cpu_features",
    "render",
]

__version__: str

def cpu_features() -> list[str]:
    """The instruction sets this process dispatches to, best first, for example ["avx512", "avx2", "scalar"]; others are
    "neon". The environment variable BIHTREE_ISA leaves only the one it names, and "scalar"; where it names what the
    processor does not have, importing bihtree raises ImportError. Which of them runs changes no result."""

@final
class Stats:
    """What a tree is and what it cost. Times in seconds, sizes in bytes."""

    @property
    def structure(self) -> str: ...
    @property
    def layout(self) -> str: ...
    @property
    def build(self) -> str: ...
    @property
    def heuristic(self) -> str:
        """Where nodes were split: "global", "local" or "sah"."""

    @property
    def precision(self) -> str: ...
    @property
    def triangles(self) -> int:
        """Rows of the mesh."""

    @property
    def nodes(self) -> int:
        """Inner nodes (wide: records) and leaves that exist now."""

    @property
    def leaves(self) -> int: ...
    @property
    def references(self) -> int:
        """Triangles of all leaves: each that can be hit once, in a kd_tree once for each leaf that it reaches into."""

    @property
    def unbuilt(self) -> int:
        """Nodes not yet subdivided; on demand only."""

    @property
    def depth(self) -> int:
        """Depth of the deepest node, in records where they are wide; the root has 0."""

    @property
    def tree_bytes(self) -> int:
        """The acceleration data: 12 bytes a node (256 a wide record, and 36 a triangle; 8 a node of a kd_tree), 4 bytes
        a reference and rejected row. On demand so far: what rays came to, and of wide records the vertices of leaves
        that they came to twice."""

    @property
    def bound_bytes(self) -> int:
        """Known before the build; tree_bytes never exceeds it. 0 for a kd_tree, whose references are not."""

    @property
    def mesh_bytes(self) -> int:
        """Vertices and indices held; 0 when borrowed."""

    @property
    def peak_build_bytes(self) -> int:
        """Tree and working memory at the peak of the build; the mesh is not counted."""

    @property
    def build_seconds(self) -> float:
        """All of the construction; on demand so far, of all threads together."""
    @property
    def presorted(self) -> bool:
        """Whether the bucket sort came first."""

    @property
    def left_out(self) -> dict[str, str]:
        """Part -> why this mesh did not need it, and what that saved."""

    @property
    def rejected(self) -> int:
        """Triangles that no ray can hit: non-finite coordinates or zero area."""

    def to_dict(self) -> dict[str, Any]:
        """All of it by name."""

@final
class Tree:
    """An acceleration structure over one triangle mesh: the Bounding Interval Hierarchy of Wächter and Keller,
    "Instant Ray Tracing: The Bounding Interval Hierarchy", EGSR 2006, or a rival to compare it with."""

    def __new__(
        cls,
        vertices: ArrayLike,
        triangles: ArrayLike | None = None,
        *,
        structure: Literal["bih", "kd_tree", "bvh"] = "bih",
        layout: Literal["wide", "compact", "classic"] | None = None,
        build: Literal["eager", "on_demand"] = "eager",
        heuristic: Literal["global", "local", "sah"] | None = None,
        presort: bool | None = None,
        precision: Literal["watertight", "exact", "fast"] = "watertight",
        leaf_size: int | None = None,
        threads: int = 0,
        copy: bool = True,
        progress: Callable[[float], bool | None] | None = None,
    ) -> Tree:
        """Build the tree.

        vertices: (V, 3) float32 or float64 (other real numbers become float64, float16 float32); a triangle with a
            vertex that is not finite is rejected and counted in stats.rejected.
        triangles: (T, 3) integer rows of vertices; None: each three vertices are one triangle.
        structure: "bih"; or a rival: "kd_tree" by the surface area heuristic (Wald and Havran 2006), which may refer to
            one triangle several times (docs/decisions/kd-tree.md); "bvh" by the binned heuristic (Wald 2007,
            docs/decisions/bvh.md). A bih has every layout and heuristic; a kd_tree has "classic", "sah" and no
            leaf_size; a bvh has "wide" or "compact", and "sah".
        layout: None: "wide", of a kd_tree "classic". "wide" are records of eight boxes for vector units
            (docs/decisions/wide-records.md); "compact" are such records with quantised boxes, whose leaves read the
            caller's arrays: the least memory, and slower (docs/decisions/compact-records.md); "classic" are nodes of
            two children, the paper's of 12 bytes, for study.
        heuristic: where a node is split; None: "global", a rival: "sah". "global" in the middle of the longest side of
            a cell that is halved from the scene's bounds, as in the paper; "local" in the middle of the longest side of
            its centres' bounds; "sah" where the surface area heuristic expects the least cost
            (docs/decisions/heuristics.md).
        presort: the bucket sort before the global heuristic, which changes no bit of the tree; None: where it pays.
        precision: "watertight" decides every hit exactly; "exact" makes the same decisions, and answers t, u and v in
            float64 with an error below one unit in the last place, the same bits for every structure, layout and
            heuristic; "fast" is single precision throughout, for previews: rays may slip through edges, and
            docs/accuracy.md says what else may happen.
        build: "eager" builds all of the tree now; "on_demand", of "bih" alone, lays down its upper nodes, and rays
            build what they come to: for views that need a part of a large mesh (docs/decisions/on-demand.md). Every
            answer is the same.
        leaf_size: most triangles of a leaf; None: 4, or 8 of wide records, which hold no more.
        threads: of construction and queries; 0: all cores this process may use.
        copy: False: borrow the arrays, which become read-only; one that has to be converted is copied all the same.
        progress: called on this thread with the share done, from 0 to 1; returning False cancels.

        Raises GeometryError (shape, dtype, a row out of range), ValueError (an option, or two that do not go together),
        Cancelled.
        """

    def intersect(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> Hits:
        """The nearest hit of each ray: origins and directions (N, 3) real numbers, t_min and t_max numbers or (N,).
        Raises GeometryError for other shapes or dtypes."""

    def occluded(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> NDArray[np.bool_]:
        """(N,) whether each ray hits anything; arguments and errors as of `intersect`."""

    def intersect_all(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        max_hits: int | None = None,
    ) -> HitLists:
        """All triangles that each ray hits, nearest first.

        origins and directions (N, 3) real numbers, t_min and t_max numbers or (N,); max_hits: of each ray the nearest
        so many, 1 at least; None: all. The first hit of a ray is the one that `intersect` gives (of precision "fast" in
        the layout "classic" it may be another).

        Raises GeometryError (shape, dtype), ValueError (max_hits below 1).
        """

    def count(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = np.inf
    ) -> NDArray[np.int32]:
        """(N,) how often each ray crosses the surface with t_min <= t <= t_max: 0 for a miss and for an invalid ray.

        Through an edge or a vertex a surface is crossed once, however many triangles meet there, and one that is only
        touched is crossed twice or not at all: the ray is thought of as moved by (ε, ε², ε³), for an ε smaller than any
        number (Edelsbrunner and Mücke 1990, "Simulation of Simplicity", section 1; docs/accuracy.md, section 8). So
        along any ray that starts outside and ends outside a closed mesh the number is even. It is never more than the
        hits of `intersect_all`, and less where the ray meets a boundary. Each of coincident triangles counts; those in
        the ray's plane do not. Decided exactly in every precision, also "fast".

        Arguments and errors as of `intersect`.
        """

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """(N,) whether each of points (N, 3) is inside a closed mesh or on it: on a triangle, an edge or a vertex.

        Inside is where an odd number of crossings lies above (towards +z), counted as by `count`; for a closed mesh,
        one in which an even number of triangles meets at every edge, it is the same number modulo 2 in every direction.
        For an open mesh the answer is what is above the point. Where closed parts overlap, inside of two is outside. A
        point with NaN or an infinity is not inside. Decided exactly in every precision, also "fast".

        Raises GeometryError (shape, dtype).
        """

    def traversal_cost(self, origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """(N,) nodes visited and (N,) triangles tested by `intersect` for each ray; 0 for an invalid one."""

    def decision_cost(self, origins: ArrayLike, directions: ArrayLike) -> NDArray[np.int32]:
        """(N, 5) tests of each ray of `intersect` against triangles that came to each means of deciding, because that
        before it could not tell: single precision, double precision, sums of two doubles, whole numbers of a fixed
        length, big integers (docs/accuracy.md, sections 2 to 4). All 0 in precision "fast", over binary nodes, which
        have no filter in single precision, and for an invalid ray."""

    @property
    def stats(self) -> Stats: ...
    @property
    def bounds(self) -> NDArray[np.floating]:
        """(2, 3) lower and upper corner of what can be hit, rounded outward to float32; inf and -inf for nothing."""

    def nodes(self, *, max_depth: int | None = None, limit: int | None = None) -> NDArray[np.void]:
        """The tree as a structured array, one row a node, breadth first, the left child before the right one.

        Fields: parent i4 (-1 for the root), depth i4, kind u1 (0 inner, 1 leaf, 2 not yet subdivided), axis i1
        (-1 where not inner), clip f4[2] (the left child's upper plane, the right child's lower plane; NaN where not
        inner), lower f4[3], upper f4[3] (the box that the clip planes on the way down cut from the bounds), first i8,
        count i8 (the node's range in order()). Both planes of a kd_tree's node are the same one. Nodes of a bvh have no
        axis (-1) and no planes (NaN), and the boxes of what lies below them."""

    def order(self) -> NDArray[np.int32]:
        """(T,) the caller's rows in leaf order, then the rejected ones; a permutation. A kd_tree's is longer where it
        refers to rows several times."""

    def build_all(self) -> None:
        """Build all that no ray has come to yet; nothing where all was built at once."""

    def refit(self, vertices: ArrayLike) -> None:
        """Move the vertices of the same triangles: boxes and planes are computed again from the leaves up, nothing is
        sorted. Hits are those of a tree that is built anew; the more the mesh changed its shape, the slower they are
        found. Where other triangles than before have an area and finite vertices, the tree is built anew.

        vertices: as many rows as before, (V, 3) float32 where the tree has such, else real numbers; they are copied.
        Queries that run meanwhile in other threads go on with the old vertices, and so does a `Scene` of this tree
        until its next `set_matrices`.

        Raises GeometryError (shape, dtype), and ValueError for a kd_tree and for a tree that is built on demand; then
        everything stays as it was."""

    def validate(self) -> None:
        """Check every rule that a tree keeps; raises BihError naming the first broken node."""

    def save(self, path: str | PathLike[str]) -> None:
        """Write the tree and its mesh to one file, docs/format.md byte by byte. What is at `path` stays until all of
        the new file is on the disk, then it is replaced; raises OSError, and leaves nothing, where that cannot be done.

        A tree that is built on demand is saved as the one that is built at once, which gives the same hits; the tree
        itself stays as it is. Not saved are the number of threads and who else has the arrays."""

    @classmethod
    def load(cls, path: str | PathLike[str], *, mmap: bool = True) -> Self:
        """A tree that `save` wrote, with its mesh; every query gives the same bits. It uses all cores.

        With `mmap` the file is mapped: its pages are read when they are used, and processes share them. It may be
        deleted or replaced by `save` meanwhile; a program that writes into it in place changes the tree. Without, all
        of it is read into memory, once and for all.

        All of the file is checked first, by checksums and by the rules of `validate`: raises FileFormatError naming
        what is wrong with one that is damaged, made up, of another version or no saved tree, and OSError where it
        cannot be read."""
