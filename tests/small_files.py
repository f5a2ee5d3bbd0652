"""Small trees, each of another kind, saved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests import meshes
from tests.variants import Variant

SMALL = (
    Variant("wide"),
    Variant("compact", {"layout": "compact"}),
    Variant("classic", {"layout": "classic"}),
    Variant("kd_tree", {"structure": "kd_tree"}),
    Variant("bvh", {"structure": "bvh", "layout": "compact"}),
)
every_small = pytest.mark.parametrize("variant", SMALL, ids=str)


def saved(variant: Variant, folder: Path, mesh: meshes.Triangles | None = None) -> bytes:
    """The bytes of the file."""
    path = folder / "good"
    variant.tree(*(mesh or with_rejected(meshes.box()))).save(path)
    return path.read_bytes()


def with_rejected(mesh: meshes.Triangles) -> meshes.Triangles:
    """The mesh with a triangle that has no area and one that is nowhere."""
    vertices = np.concatenate([mesh.vertices, [[np.nan, 0, 0]]]).astype(mesh.vertices.dtype)
    rows = np.array([[0, 1, 0], [0, 1, len(vertices) - 1]], mesh.triangles.dtype)
    return meshes.Triangles(vertices, np.concatenate([mesh.triangles[:5], rows, mesh.triangles[5:]]))
