"""Files of every form that the format has, and those that are none."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from addon.pipeline.errors import UserError
from addon.pipeline.ply import ORDERS, read_ply

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, -1.25]], np.float32)
TRIANGLES = [[0, 1, 2], [0, 2, 3], [0, 1, 4]]


def header(form: str, faces: int, extra: str = "", vertex: str = "float", name: str = "vertex_indices") -> bytes:
    lines = [
        *("ply", f"format {form} 1.0", "comment made for a test", f"element vertex {len(VERTICES)}"),
        *(f"property {vertex} {axis}" for axis in "xyz"),
        *("property uchar red", f"element face {faces}", f"property list uchar int {name}"),
    ]
    return "\n".join([*lines, *([extra] if extra else []), "end_header", ""]).encode()


def body(form: str, faces: list[list[int]], vertex: str = "f", extra: bytes | None = None) -> bytes:
    order = ORDERS[form]
    if not order:
        rows = [f"{x} {y} {z} 7" for x, y, z in VERTICES.tolist()]
        rows += [" ".join(map(str, [len(face), *face])) for face in faces]
        return ("\n".join(rows) + "\n").encode()
    parts = [struct.pack(f"{order}3{vertex}B", *row, 7) for row in VERTICES.tolist()]
    parts += [struct.pack(f"{order}B{len(face)}i", len(face), *face) + (extra or b"") for face in faces]
    return b"".join(parts)


@pytest.mark.parametrize("form", ORDERS)
def test_every_form_is_read(form: str, tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(header(form, 3) + body(form, TRIANGLES))
    mesh = read_ply(path)
    assert mesh.name == "a"
    assert mesh.vertices.dtype == np.float32
    assert np.array_equal(mesh.vertices, VERTICES)
    assert mesh.triangles.tolist() == TRIANGLES


@pytest.mark.parametrize("form", ORDERS)
def test_polygons_are_fans(form: str, tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(
        header(form, 4, name="vertex_index") + body(form, [[0, 1, 2, 3], [0, 1], [4, 3, 2, 1, 0], [0, 1, 4]])
    )
    expected = [[0, 1, 2], [0, 2, 3], [4, 3, 2], [4, 2, 1], [4, 1, 0], [0, 1, 4]]
    assert read_ply(path).triangles.tolist() == expected


def test_double_precision_other_properties_and_no_faces(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    form = "binary_little_endian"
    path.write_bytes(header(form, 3, "property float quality", "double") + body(form, TRIANGLES, "d", b"\0\0\0\0"))
    mesh = read_ply(path)
    assert mesh.vertices.dtype == np.float64
    assert mesh.triangles.tolist() == TRIANGLES
    for empty in ORDERS:
        path.write_bytes(header(empty, 0) + body(empty, []))
        assert read_ply(path).triangles.shape == (0, 3)


@pytest.mark.parametrize("form", ORDERS)
def test_a_file_cut_short_anywhere_is_one_line(form: str, tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    whole = header(form, 3) + body(form, TRIANGLES)
    path.write_bytes(whole)
    for length in range(len(whole) - 2):
        path.write_bytes(whole[:length])
        with pytest.raises(UserError, match=r"a\.ply") as caught:
            read_ply(path)
        assert "\n" not in str(caught.value)


def test_what_is_wrong_is_said(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    with pytest.raises(UserError, match="does not exist"):
        read_ply(path)
    path.write_bytes(header("ascii", 1) + body("ascii", [[0, 1, 5]]))
    with pytest.raises(UserError, match=r"triangle 0 is \[0, 1, 5\]"):
        read_ply(path)
    path.write_bytes(header("ascii", 3).replace(b"property uchar red", b"property colour red") + b"")
    with pytest.raises(UserError, match=r"not a \.ply mesh"):
        read_ply(path)
    path.write_bytes(header("ascii", 3, name="corners") + body("ascii", TRIANGLES))
    with pytest.raises(UserError, match="no vertex_indices"):
        read_ply(path)
