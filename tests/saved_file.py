"""Saved trees taken apart and put together by docs/format.md alone, checksums included: no code of the product."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, replace

MAGIC = b"\x89BIH\r\n\x1a\n"
HEADER = 272
SECTIONS = ("vertices", "triangles", "order", "nodes", "rows", "left_out")
FIRST_ENTRY = 128
ENTRY = struct.Struct("<QQII")

FIELDS = {
    "version": (8, "<I"),
    "byte_order": (12, "<I"),
    "file_bytes": (16, "<Q"),
    "checksum": (24, "<I"),
    "sections": (28, "<I"),
    "structure": (32, "<B"),
    "layout": (33, "<B"),
    "heuristic": (34, "<B"),
    "precision": (35, "<B"),
    "coordinate": (36, "<B"),
    "is_indexed": (37, "<B"),
    "is_presorted": (38, "<B"),
    "zero": (39, "<B"),
    "leaf_size": (40, "<I"),
    "depth": (44, "<I"),
    "rejected": (48, "<Q"),
    "leaves": (56, "<Q"),
    "peak_build_bytes": (64, "<Q"),
    "build_seconds": (72, "<d"),
    "lower_x": (80, "<f"),
    "upper_z": (100, "<f"),
    "zeros": (104, "<Q"),
}
"""Where a number of the header stands, and its type."""


def sealed(data: bytes) -> bytes:
    """The same with the right checksum of the header."""
    file = bytearray(data)
    file[24:28] = bytes(4)
    file[24:28] = struct.pack("<I", zlib.crc32(file[:HEADER]))
    return bytes(file)


def with_field(data: bytes, name: str, value: float) -> bytes:
    """The same with another number in the header, sealed unless the number is the checksum."""
    place, kind = FIELDS[name]
    file = bytearray(data)
    struct.pack_into(kind, file, place, value)
    return bytes(file) if name == "checksum" else sealed(bytes(file))


def field(data: bytes, name: str) -> float:
    place, kind = FIELDS[name]
    return float(struct.unpack_from(kind, data, place)[0])


def with_entry(data: bytes, section: str, **values: int) -> bytes:
    """The same with other numbers in the entry of a section: start, bytes, item_bytes, checksum."""
    place = FIRST_ENTRY + ENTRY.size * SECTIONS.index(section)
    entry = dict(zip(("start", "bytes", "item_bytes", "checksum"), ENTRY.unpack_from(data, place), strict=True))
    file = bytearray(data)
    ENTRY.pack_into(file, place, *{**entry, **values}.values())
    return sealed(bytes(file))


@dataclass(frozen=True)
class SavedFile:
    """The header, and the sections with the bytes of their items."""

    header: bytes
    sections: dict[str, bytes]
    items: dict[str, int]

    @classmethod
    def of(cls, data: bytes) -> SavedFile:
        assert data[:8] == MAGIC
        sections, items = {}, {}
        for number, name in enumerate(SECTIONS):
            start, length, item, checksum = ENTRY.unpack_from(data, FIRST_ENTRY + ENTRY.size * number)
            sections[name], items[name] = data[start : start + length], item
            assert start % 64 == 0
            assert zlib.crc32(sections[name]) == checksum
        assert sealed(data) == data
        return cls(data[:FIRST_ENTRY], sections, items)

    def with_section(self, name: str, data: bytes) -> SavedFile:
        return replace(self, sections={**self.sections, name: data})

    def data(self) -> bytes:
        """The bytes of a file that is right as far as checksums and places go."""
        entries, body, end = b"", b"", HEADER
        for name in SECTIONS:
            section = self.sections[name]
            start = -(-end // 64) * 64
            entries += ENTRY.pack(start, len(section), self.items[name], zlib.crc32(section))
            body += bytes(start - end) + section
            end = start + len(section)
        file = bytearray(self.header + entries + body)
        struct.pack_into("<Q", file, 16, end)
        return sealed(bytes(file))
