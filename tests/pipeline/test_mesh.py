"""A mesh and its .npz file, good and bad."""

from pathlib import Path

import numpy as np
import pytest

from addon.pipeline.errors import UserError
from addon.pipeline.mesh import Mesh, read_npz

CORNERS = np.array([[0.1, 0, 0], [1, 0.2, 0], [0, 1, 0.3], [1, 1, 1]])
ROWS = np.array([[0, 1, 2], [3, 2, 1]])


@pytest.mark.parametrize("dtype", ["<f2", "<f4", ">f4", "<f8", ">f8"])
@pytest.mark.parametrize("index", ["u1", "<i4", ">i8", "<u8"])
def test_values_survive_whatever_the_stored_types(tmp_path: Path, dtype: str, index: str) -> None:
    stored = CORNERS.astype(dtype)
    np.savez(tmp_path / "two.npz", vertices=stored, triangles=ROWS.astype(index))
    mesh = read_npz(tmp_path / "two.npz")
    assert mesh.name == "two"
    assert mesh.vertices.dtype == (np.float64 if dtype.endswith("8") else np.float32)
    assert mesh.vertices.tolist() == stored.tolist()
    assert mesh.triangles.dtype == np.int32
    assert mesh.triangles.tolist() == ROWS.tolist()


@pytest.mark.parametrize(
    ("arrays", "named"),
    [
        ({"vertices": CORNERS}, "no array 'triangles'"),
        ({"triangles": ROWS}, "no array 'vertices'"),
        ({"vertices": CORNERS[:, :2], "triangles": ROWS}, r"got \(4, 2\) float64"),
        ({"vertices": CORNERS.astype(int), "triangles": ROWS}, "vertices must be"),
        ({"vertices": CORNERS, "triangles": ROWS.ravel()}, r"got \(6,\) int64"),
        ({"vertices": CORNERS, "triangles": ROWS * 1.0}, "triangles must be"),
        ({"vertices": CORNERS, "triangles": ROWS + 1}, r"triangle 1 is \[4, 3, 2\], but there are 4 vertices"),
        ({"vertices": CORNERS, "triangles": ROWS - 1}, r"triangle 0 is \[-1, 0, 1\]"),
        ({"vertices": np.array([None, {}], object), "triangles": ROWS}, "not an .npz mesh"),
    ],
)
def test_a_file_of_the_wrong_arrays_is_named(tmp_path: Path, arrays: dict[str, np.ndarray], named: str) -> None:
    np.savez(tmp_path / "wrong.npz", **arrays)
    with pytest.raises(UserError, match=named):
        read_npz(tmp_path / "wrong.npz")


def test_no_file_and_no_archive(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="does not exist"):
        read_npz(tmp_path / "none.npz")
    with pytest.raises(UserError, match=r"not an .npz mesh"):
        read_npz(tmp_path)
    (tmp_path / "text.npz").write_text("solid cube\n")
    with pytest.raises(UserError, match=r"not an .npz mesh"):
        read_npz(tmp_path / "text.npz")
    np.save(tmp_path / "single.npy", CORNERS)
    with pytest.raises(UserError, match=r"not an .npz mesh"):
        read_npz(tmp_path / "single.npy")


def test_a_damaged_file_is_a_mesh_or_an_error_of_one_line(tmp_path: Path) -> None:
    whole = tmp_path / "whole.npz"
    np.savez_compressed(whole, vertices=CORNERS, triangles=ROWS)
    data = whole.read_bytes()
    flipped = [data[:at] + bytes([data[at] ^ 16]) + data[at + 1 :] for at in range(0, len(data), 2)]
    refused = []
    for number, damaged in enumerate([data[:length] for length in range(0, len(data), 7)] + flipped):
        path = tmp_path / f"{number}.npz"
        path.write_bytes(damaged)
        try:
            read_npz(path)
        except UserError as error:
            refused.append(str(error))
    assert len(refused) >= len(data) // 7
    assert not any("\n" in message for message in refused)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_vertex_that_is_not_finite_is_named(value: float) -> None:
    vertices = CORNERS.astype(np.float32)
    Mesh("Suzanne", vertices, ROWS.astype(np.int32)).check_finite()
    vertices[2:, 1] = value
    with pytest.raises(UserError, match=r"'Suzanne': vertex 2 is .*(nan|inf)"):
        Mesh("Suzanne", vertices, ROWS.astype(np.int32)).check_finite()
