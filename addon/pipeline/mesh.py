"""One mesh: vertices and the triangles between them."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from .errors import UserError


@dataclass(frozen=True)
class Mesh:
    """Vertices (V, 3) float32 or float64 in object space; triangles (T, 3) int32 rows of them. `materials` (T,) are the
    triangles' material slots, None: all the first; `corner_normals` (T, 3, 3) those to shade by, None: their own."""

    name: str
    vertices: NDArray[np.floating[Any]]
    triangles: NDArray[np.int32]
    materials: NDArray[np.int32] | None = None
    corner_normals: NDArray[np.float32] | None = None

    def check_finite(self) -> None:
        """Raise UserError naming the first vertex that is NaN or infinite."""
        finite = np.isfinite(self.vertices)
        # All numbers at once take a hundredth of the time that all rows take.
        if not finite.all():
            row = int(np.argmin(finite.all(axis=1)))
            x, y, z = (float(c) for c in self.vertices[row])
            raise UserError(
                f"object {self.name!r}: vertex {row} is ({x:g}, {y:g}, {z:g}); "
                "every coordinate must be finite. Delete that vertex, or hide the object from renders."
            )


def bounds_of(points: NDArray[np.floating[Any]]) -> NDArray[np.floating[Any]]:
    """(2, 3) lower and upper corner of points (N, 3), N at least 1."""
    # Column by column: along rows of three NumPy takes a hundred times as long.
    return np.array([[column.min() for column in points.T], [column.max() for column in points.T]], points.dtype)


def read_npz(path: Path) -> Mesh:
    """Read `vertices` (V, 3) floats and `triangles` (T, 3) integers from an .npz file (no pickles)."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            for name in ("vertices", "triangles"):
                if name not in archive:
                    raise UserError(f"{path}: no array {name!r}; an .npz mesh holds 'vertices' and 'triangles'")
            vertices, triangles = archive["vertices"], archive["triangles"]
    except FileNotFoundError:
        raise UserError(f"mesh file {path} does not exist") from None
    except (OSError, ValueError, EOFError, TypeError, RuntimeError, BadZipFile, zlib.error) as error:
        raise UserError(f"{path}: not an .npz mesh ({error})") from None
    return checked_mesh(path, vertices, triangles)


def checked_mesh(path: Path, vertices: NDArray[Any], triangles: NDArray[Any]) -> Mesh:
    """What was read from a file as a mesh of its name. Raises UserError for other shapes, kinds and rows."""
    if vertices.ndim != 2 or vertices.shape[1] != 3 or vertices.dtype.kind != "f":
        raise UserError(f"{path}: vertices must be (V, 3) floats, got {vertices.shape} {vertices.dtype}")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        raise UserError(f"{path}: triangles must be (T, 3) integers, got {triangles.shape} {triangles.dtype}")
    if triangles.size:
        rows = ((triangles < 0) | (triangles >= len(vertices))).any(axis=1)
        if rows.any():
            row = int(np.argmax(rows))
            raise UserError(
                f"{path}: triangle {row} is {triangles[row].tolist()}, but there are {len(vertices)} vertices"
            )
    keep = np.float32 if vertices.dtype.itemsize <= 4 else np.float64
    return Mesh(path.stem, np.ascontiguousarray(vertices, keep), np.ascontiguousarray(triangles, np.int32))
