"""Flattening, against a loop over vertices in plain Python floats."""

import numpy as np
import pytest

from addon.pipeline.errors import UserError
from addon.pipeline.mesh import Mesh
from addon.pipeline.scene import SceneData

RNG = np.random.default_rng(3)


def mesh(name: str, vertices: int, triangles: int, dtype: type = np.float32) -> Mesh:
    return Mesh(
        name, RNG.normal(0, 3, (vertices, 3)).astype(dtype), RNG.integers(0, vertices, (triangles, 3)).astype(np.int32)
    )


def by_hand(scene: SceneData) -> tuple[list[list[float]], list[list[int]]]:
    vertices, triangles = [], []
    for number, matrix in zip(scene.instance_mesh.tolist(), scene.instance_matrix.tolist(), strict=True):
        shown, start = scene.meshes[number], len(vertices)
        for x, y, z in shown.vertices.tolist():
            vertices.append([((x * a + y * b) + z * c) + d for a, b, c, d in matrix[:3]])
        triangles += [[start + corner for corner in row] for row in shown.triangles.tolist()]
    return vertices, triangles


MATRICES = np.stack([np.eye(4), *(np.vstack([RNG.normal(0, 2, (3, 4)), [0, 0, 0, 1]]) for _ in range(4))])
MIRROR, FLAT = np.diag([-1.0, 1, 1, 1]), np.diag([1.0, 1, 0, 1])


@pytest.mark.parametrize(
    ("dtypes", "rows", "matrices"),
    [
        ((np.float32,), [0, 0, 0], MATRICES[:3]),
        ((np.float32, np.float32), [1, 0, 1, 0, 1], MATRICES),
        ((np.float64, np.float32), [0, 1, 1], MATRICES[2:]),
        ((np.float32, np.float64), [0], MATRICES[1:2]),
        ((np.float32,), [0, 0], [MIRROR, FLAT]),
    ],
)
def test_flatten_has_the_bits_of_a_loop(dtypes: tuple[type, ...], rows: list[int], matrices: list[np.ndarray]) -> None:
    meshes = [mesh(str(number), 11 + number, 17, dtype) for number, dtype in enumerate(dtypes)]
    scene = SceneData(meshes, np.array(rows, np.int32), np.array(matrices))
    vertices, triangles = scene.flatten()
    expected, expected_rows = by_hand(scene)
    wide = any(dtypes[row] is np.float64 for row in rows)
    assert vertices.dtype == (np.float64 if wide else np.float32)
    assert triangles.dtype == np.int32
    assert vertices.tolist() == np.array(expected).astype(vertices.dtype).tolist()
    assert triangles.tolist() == expected_rows
    assert scene.triangle_count == len(triangles) == 17 * len(rows)


def test_one_mesh_that_is_not_moved_is_not_copied() -> None:
    scene = SceneData.of_mesh(mesh("one", 5, 9))
    vertices, triangles = scene.flatten()
    assert vertices is scene.meshes[0].vertices
    assert triangles is scene.meshes[0].triangles
    assert not scene.moves


def test_the_meshes_are_left_as_they_are() -> None:
    original = mesh("one", 5, 9)
    before = original.vertices.copy(), original.triangles.copy()
    scene = SceneData([original], np.zeros(2, np.int32), MATRICES[:2])
    vertices, triangles = scene.flatten()
    vertices += 1
    triangles += 1
    assert (original.vertices == before[0]).all()
    assert (original.triangles == before[1]).all()
    assert scene.moves


def test_an_empty_scene_is_empty_arrays() -> None:
    scene = SceneData([], np.zeros(0, np.int32), np.zeros((0, 4, 4)))
    vertices, triangles = scene.flatten()
    assert vertices.shape == triangles.shape == (0, 3)
    assert scene.triangle_count == 0


@pytest.mark.parametrize("factor", [1e39, np.inf, np.nan])
def test_a_transform_beyond_float32_names_the_object_and_the_vertex(factor: float) -> None:
    vertices = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0]], np.float32)
    far = Mesh("Far", vertices, np.array([[0, 1, 2]], np.int32))
    near = Mesh("Near", vertices, np.array([[0, 1, 2]], np.int32))
    matrix = np.eye(4)
    matrix[0, 0] = factor
    named = "vertex 2" if factor == 1e39 else "vertex 0"  # 0 · inf and 0 · NaN are NaN
    with pytest.raises(UserError, match=f"'Far'.*{named} beyond float32"):
        SceneData([near, far], np.array([0, 1], np.int32), np.stack([np.eye(4), matrix])).flatten()
