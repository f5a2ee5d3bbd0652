"""Reading .ply meshes (Turk, "The PLY Polygon File Format", 1994): text, and binary of either byte order."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import UserError
from .mesh import Mesh, checked_mesh

TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float": "f4",
    "double": "f8",
    "float32": "f4",
    "float64": "f8",
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
FACES = ("vertex_indices", "vertex_index")


@dataclass
class _Property:
    """`count` is the type of a list's length; None: no list."""

    name: str
    type: str
    count: str | None = None


@dataclass
class _Element:
    name: str
    rows: int
    properties: list[_Property] = field(default_factory=list)


def read_ply(path: Path) -> Mesh:
    """Vertices and faces, polygons as fans of triangles; whatever else is in the file is passed over.

    Raises UserError where the file is not one, or ends too soon.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise UserError(f"mesh file {path} does not exist") from None
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        order, elements, start = _header(data)
        body = _Text(data[start:]) if not order else _Binary(data, start, order)
        found = {element.name: body.read(element) for element in elements}
        corners = found["vertex"]
        vertices = np.stack([corners["x"], corners["y"], corners["z"]], axis=1)
        lists = next((found["face"][name] for name in FACES if name in found["face"]), None)
        if lists is None:
            raise ValueError(f"its faces have no {FACES[0]}")
    except (ValueError, KeyError, IndexError, OverflowError) as error:
        raise UserError(f"{path}: not a .ply mesh ({error})") from None
    return checked_mesh(path, vertices, _fans(*lists))


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    """The byte order, the elements, and where they start."""
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise ValueError("no header of one")
    order, elements = "ascii", list[_Element]()
    for line in data[:end].decode("ascii", "replace").splitlines()[1:]:
        words = line.split()
        match words:
            case ["format", name, "1.0"]:
                order = name
            case ["element", name, rows]:
                elements.append(_Element(name, int(rows)))
            case ["property", "list", count, kind, name]:
                elements[-1].properties.append(_Property(name, TYPES[kind], TYPES[count]))
            case ["property", kind, name]:
                elements[-1].properties.append(_Property(name, TYPES[kind]))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise ValueError(f"header line {line!r}")
    if not {"vertex", "face"} <= {element.name for element in elements}:
        raise ValueError("it needs the elements vertex and face")
    return ORDERS[order], elements, data.index(b"\n", end) + 1


Lists = tuple[NDArray[Any], NDArray[Any]]
"""How many entries each row has, and the entries of all."""


class _Binary:
    def __init__(self, data: bytes, start: int, order: str) -> None:
        self.data, self.place, self.order = data, start, order

    def _take(self, type: np.dtype[Any], count: int) -> NDArray[Any]:
        taken = np.frombuffer(self.data, type, count, self.place)
        self.place += taken.nbytes
        return taken

    def read(self, element: _Element) -> dict[str, Any]:
        parts = element.properties
        if not any(part.count for part in parts):
            record = np.dtype([(part.name, self.order + part.type) for part in parts])
            rows = self._take(record, element.rows)
            return {part.name: rows[part.name] for part in parts}
        return self._alike(element) or self._one_by_one(element)

    def _alike(self, element: _Element) -> dict[str, Any] | None:
        """All rows at once, where every list is as long as the first row's; else None, and nothing is taken."""
        start, fields, lengths = self.place, list[tuple[str, str, tuple[int, ...]]](), {}
        if not element.rows:
            return {part.name: (np.zeros(0, int), np.zeros(0, int)) for part in element.properties}
        for part in element.properties:
            if part.count:
                lengths[part.name] = int(self._take(np.dtype(self.order + part.count), 1)[0])
                fields.append((f"{part.name} length", self.order + part.count, ()))
            count = lengths.get(part.name, 1)
            self._take(np.dtype(self.order + part.type), count)
            fields.append((part.name, self.order + part.type, (count,) if part.count else ()))
        self.place = start
        record = np.dtype(fields)
        if start + record.itemsize * element.rows > len(self.data):
            return None
        rows = self._take(record, element.rows)
        if not all((rows[f"{name} length"] == length).all() for name, length in lengths.items()):
            self.place = start
            return None
        return {
            part.name: (rows[f"{part.name} length"], rows[part.name].ravel()) if part.count else rows[part.name]
            for part in element.properties
        }

    def _one_by_one(self, element: _Element) -> dict[str, Any]:
        counts: dict[str, list[int]] = {part.name: [] for part in element.properties}
        entries: dict[str, list[NDArray[Any]]] = {part.name: [] for part in element.properties}
        for _ in range(element.rows):
            for part in element.properties:
                count = int(self._take(np.dtype(self.order + part.count), 1)[0]) if part.count else 1
                counts[part.name].append(count)
                entries[part.name].append(self._take(np.dtype(self.order + part.type), count))
        return {
            part.name: (np.array(counts[part.name]), np.concatenate(entries[part.name]))
            if part.count
            else np.concatenate(entries[part.name])
            for part in element.properties
        }


class _Text:
    def __init__(self, data: bytes) -> None:
        self.words = data.split()
        self.place = 0

    def _take(self, count: int) -> list[bytes]:
        taken = self.words[self.place : self.place + count]
        if len(taken) < count:
            raise ValueError("it ends too soon")
        self.place += count
        return taken

    def read(self, element: _Element) -> dict[str, Any]:
        parts = element.properties
        if not any(part.count for part in parts):
            rows = np.array(self._take(element.rows * len(parts)), "S").reshape(element.rows, len(parts))
            return {part.name: rows[:, column].astype(part.type) for column, part in enumerate(parts)}
        counts: dict[str, list[int]] = {part.name: [] for part in parts}
        entries: dict[str, list[bytes]] = {part.name: [] for part in parts}
        for _ in range(element.rows):
            for part in parts:
                count = int(self._take(1)[0]) if part.count else 1
                counts[part.name].append(count)
                entries[part.name] += self._take(count)
        found = {part.name: np.array(entries[part.name], "S").astype(part.type) for part in parts}
        return {
            part.name: (np.array(counts[part.name], int), found[part.name]) if part.count else found[part.name]
            for part in parts
        }


def _fans(counts: NDArray[Any], entries: NDArray[Any]) -> NDArray[np.int64]:
    """(T, 3): the polygon a, b, c, d is a, b, c and a, c, d; one of fewer than three corners is nothing."""
    entries, counts = entries.astype(np.int64), counts.astype(np.int64)
    if (counts == 3).all():
        return entries.reshape(-1, 3)
    first = np.cumsum(counts) - counts
    per_face = np.maximum(counts - 2, 0)
    start = np.repeat(first, per_face)
    step = np.arange(per_face.sum()) - np.repeat(np.cumsum(per_face) - per_face, per_face)
    return np.stack([entries[start], entries[start + step + 1], entries[start + step + 2]], axis=1)
