"""Instances for tests: matrices of every kind, and the mesh that a scene stands for, by fractions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import bihtree
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.agreement import Rows, faults, truth_of
from tests.meshes import Triangles
from tests.oracle import Truth
from tests.rays import Rays

Matrix = NDArray[np.float64]


def moved(linear: ArrayLike, shift: ArrayLike = (0, 0, 0)) -> Matrix:
    """(4, 4): a linear part (3, 3), or the three factors of a scale, and where the origin goes."""
    matrix = np.eye(4)
    part = np.asarray(linear, np.float64)
    matrix[:3, :3] = part if part.ndim == 2 else np.diag(part)
    matrix[:3, 3] = shift
    return matrix


def turned(angle: float, axis: int = 2) -> NDArray[np.float64]:
    """(3, 3) about one axis."""
    turn = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[[i, j], [i, j]] = np.cos(angle)
    turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
    return turn


def anywhere(count: int, rng: np.random.Generator, spread: float = 4.0) -> Matrix:
    """(count, 4, 4): turned, scaled, sheared, some mirrored, all apart or not."""
    linear = rng.normal(size=(count, 3, 3)) * rng.choice([0.3, 1.0, 2.0], (count, 1, 1))
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, :3] = linear
    matrices[:, :3, 3] = rng.uniform(-spread, spread, (count, 3))
    return matrices


KINDS = {
    "identity": moved(np.eye(3)),
    "shifted": moved(np.eye(3), (0.1, -0.7, 1e6)),
    "turned": moved(turned(0.3) @ turned(1.1, 0), (1, 2, 3)),
    "mirrored": moved((-1, 1, 1), (0.5, 0, 0)),
    "through the middle": moved((-2, -2, -2)),
    "sheared": moved([[1, 0.7, 0], [0, 1, -0.3], [0.2, 0, 1]]),
    "thin": moved(turned(0.4) @ np.diag([1, 1, 1e-6]) @ turned(0.9, 1)),
    "1e30": moved((1e30, 1e30, 1e30), (1e29, 0, -1e30)),
    "1e-30": moved((1e-30, -1e-30, 1e-30), (0, 3e-30, 0)),
    "1e30 on one axis": moved((1e30, 1, 1)),
    "1e30 and 1e-30": moved((1e30, 1, 1e-30)),
    "a stage far away": moved(turned(0.2) * 3, (1e9, -1e9, 1e9)),
    "scale 0 on an axis": moved((1, 1, 0), (0, 0, 0.5)),
    "scale 0, turned": moved(turned(0.3, 0) @ np.diag([1, 0, 2]) @ turned(0.7), (1, 1, 1)),
    "onto a line": moved([[1, 0, 0], [2, 0, 0], [3, 0, 0]]),
    "onto a point": moved((0, 0, 0), (1, 2, 3)),
    "nearly singular": moved([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9 + 1e-14]]),
    "beyond doubles in a product": moved((1e200, 1e200, 1e200)),
}
"""Matrices that a scene may hold, by what they do."""


def image(point: Sequence[Fraction], matrix: Matrix) -> list[Fraction]:
    """Where a matrix takes a point, exactly."""
    rows = [[Fraction(float(x)) for x in row] for row in matrix[:3]]
    return [row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3] for row in rows]


def exact_images(mesh: Triangles, matrix: Matrix) -> list[list[tuple[Fraction, Fraction, Fraction]]]:
    """The corners of the images of all triangles, not rounded."""
    points = []
    for vertex in mesh.vertices:
        x, y, z = image([Fraction(float(c)) for c in vertex], matrix)
        points.append((x, y, z))
    return [[points[row] for row in triangle] for triangle in mesh.triangles]


def flattened(shown: Sequence[Triangles], matrices: Matrix) -> Triangles:
    """The images of all meshes, one after another: each coordinate the float64 that is nearest to the truth."""
    parts, triangles, start = [], [], 0
    for mesh, matrix in zip(shown, matrices, strict=True):
        points = [image([Fraction(float(x)) for x in vertex], matrix) for vertex in mesh.vertices]
        parts.append(np.array([[float(x) for x in point] for point in points], np.float64).reshape(-1, 3))
        triangles.append(mesh.triangles + start)
        start += len(mesh.vertices)
    return Triangles(np.concatenate(parts), np.concatenate(triangles).astype(np.int32))


def as_one_mesh(hits: bihtree.Hits, shown: Sequence[Triangles]) -> Rows:
    """The answers of a scene as those of one mesh, whose rows are those of the flattened mesh."""
    starts = np.cumsum([0] + [len(mesh.triangles) for mesh in shown], dtype=np.int32)
    assert (hits.triangle[hits.hit] < np.diff(starts)[hits.instance[hits.hit]]).all()
    rows = np.where(hits.hit, hits.triangle + starts[hits.instance], -1)
    return Rows(hits.t, rows.astype(np.int32), hits.u, hits.v, np.where(hits.hit, 0, hits.instance).astype(np.int32))


def assert_scene_true(
    scene: bihtree.Scene, shown: Sequence[Triangles], matrices: Matrix, rays: Rays, t_min: float = 0.0
) -> Truth:
    """Closest hit and any hit are the oracle's of the flattened mesh; `shown` has the mesh of each instance."""
    origins, directions = rays
    near, far = np.full(len(origins), t_min), np.full(len(origins), np.inf)
    truth = truth_of(flattened(shown, matrices), origins, directions, near, far)
    hits = scene.intersect(origins, directions, t_min=t_min)
    wrong = faults(as_one_mesh(hits, shown), truth, scene.stats.precision.replace("fast", "watertight"))
    assert not wrong, f"{len(wrong)} faults in {len(truth)} rays:\n" + "\n".join(wrong[:10])
    assert np.array_equal(scene.occluded(origins, directions, t_min=t_min), truth.triangle >= 0)
    return truth
