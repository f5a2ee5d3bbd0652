"""A scene as plain arrays: what the export makes and everything else reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .camera import CameraView
from .errors import UserError
from .mesh import Mesh

LIGHT_DTYPE = np.dtype(
    [("kind", "u1"), ("position", "f8", 3), ("direction", "f8", 3), ("axis", "f8", 3), ("size", "f8", 2)]
    + [("spot", "f8", 2), ("colour", "f4", 3), ("shadowless", "?")]
)
"""One light, as `bihtree.render(lights=…)` takes it. Kinds: SUN (irradiance `colour` in W/m², shining along
`direction`, `size` its angle), POINT (`colour` in W, at `position`, `size` its radius), SPOT (along `direction`; `spot`
its angle and blend), RECTANGLE and ELLIPSE (`size` width along `axis` and height)."""

SUN, POINT, SPOT, RECTANGLE, ELLIPSE = range(5)

SURFACE_DTYPE = np.dtype([("base", "f4", 3), ("emission", "f4", 3), ("index", "i4")])
"""What a material slot holds: reflectance, radiance of its own, and its pass index."""

OBJECT_DTYPE = np.dtype([("first_surface", "i4"), ("index", "i4"), ("flags", "u1")])
"""An instance: the row of the surface of its first slot, its pass index, and a sum of flags."""

HIDDEN, NO_SHADOW, HOLDOUT = 1, 2, 4
"""Camera rays pass through it; shadow rays do; where it is seen the picture is empty."""

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class SceneData:
    """Meshes in object space, and instances of them: row i shows meshes[instance_mesh[i]] through
    instance_matrix[i] (4, 4) float64, object to world, as objects[i] (OBJECT_DTYPE) says; None: all are plain.
    `surfaces` (SURFACE_DTYPE) are those of the material slots; none: all is grey. `world` is the scene-linear radiance
    all around; None: there is none, and a dim headlight fills what lights do not reach. `skipped` names what is not
    traced, and why."""

    meshes: Sequence[Mesh]
    instance_mesh: NDArray[np.int32]
    instance_matrix: NDArray[np.float64]
    name: str = "scene"
    camera: CameraView | None = None
    lights: NDArray[np.void] = field(default_factory=lambda: np.zeros(0, LIGHT_DTYPE))
    skipped: Sequence[str] = ()
    surfaces: NDArray[np.void] = field(default_factory=lambda: np.zeros(0, SURFACE_DTYPE))
    objects: NDArray[np.void] | None = None
    world: Colour | None = None
    film_transparent: bool = False

    @classmethod
    def of_mesh(cls, mesh: Mesh, camera: CameraView | None = None) -> SceneData:
        return cls([mesh], np.zeros(1, np.int32), np.eye(4)[None], mesh.name, camera)

    @property
    def triangle_counts(self) -> NDArray[np.int64]:
        """(M,) of each instance."""
        return np.array([len(mesh.triangles) for mesh in self.meshes], np.int64)[self.instance_mesh]

    @property
    def triangle_count(self) -> int:
        return int(self.triangle_counts.sum())

    @property
    def vertex_count(self) -> int:
        """Of all instances, as if each had its own."""
        return int(np.array([len(mesh.vertices) for mesh in self.meshes], np.int64)[self.instance_mesh].sum())

    @property
    def moves(self) -> bool:
        """Whether any instance's matrix is not the identity."""
        return not bool((self.instance_matrix == np.eye(4)).all())

    def only(self, chosen: NDArray[np.bool_]) -> SceneData:
        """The same scene with some of its instances (M,)."""
        return replace(
            self,
            instance_mesh=self.instance_mesh[chosen],
            instance_matrix=self.instance_matrix[chosen],
            objects=None if self.objects is None else self.objects[chosen],
        )

    def flatten(
        self, *, dtype: type[np.floating[Any]] | None = None, transform_all: bool = False
    ) -> tuple[NDArray[np.floating[Any]], NDArray[np.int32]]:
        """World-space vertices (V, 3) and triangles (T, 3) of all instances, in their order.

        float64 where a mesh is float64, else float32: each vertex is transformed in float64, to the same bits on
        every machine, and rounded once; `dtype` is what that is converted to. One mesh that is not moved is returned as
        it is, not copied, unless `transform_all` asks for the identity too.
        Raises UserError naming the object whose matrix makes a vertex NaN or infinite.
        """
        shown = [self.meshes[m] for m in self.instance_mesh]
        if not shown:
            return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32)
        kept = np.result_type(np.float32, *{mesh.vertices.dtype for mesh in shown})
        if len(shown) == 1 and not self.moves and not transform_all:
            return shown[0].vertices.astype(dtype or kept, copy=False), shown[0].triangles
        starts = np.cumsum([0] + [len(mesh.vertices) for mesh in shown])
        vertices = np.empty((starts[-1], 3), kept)
        for mesh, matrix, start in zip(shown, self.instance_matrix, starts, strict=False):
            part = vertices[start : start + len(mesh.vertices)]
            if not transform_all and np.array_equal(matrix, np.eye(4)):
                part[:] = mesh.vertices
                continue
            with np.errstate(over="ignore", invalid="ignore"):
                # Not a matrix product: BLAS rounds differently from one processor to the next.
                x, y, z = mesh.vertices.astype(np.float64).T[:, :, None]
                part[:] = x * matrix[:3, 0] + y * matrix[:3, 1] + z * matrix[:3, 2] + matrix[:3, 3]
            if not np.isfinite(part).all():
                row = int(np.argmin(np.isfinite(part).all(axis=1)))
                raise UserError(
                    f"object {mesh.name!r}: its transform takes vertex {row} beyond {kept.name}; "
                    "make the object's scale and location finite and smaller, or hide it from renders"
                )
        triangles = np.concatenate(
            [mesh.triangles + np.int32(start) for mesh, start in zip(shown, starts, strict=False)]
        )
        return vertices.astype(dtype or kept, copy=False), triangles
