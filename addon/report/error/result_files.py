"""results.json and results.csv: everything that the page shows, for programs."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from dataclasses import asdict, is_dataclass
from math import isfinite
from typing import Any

from .results import Results

SCHEMA = 2
COLUMNS = ("section", "name", "quantity", "k", "value", "least", "most", "repeats")


def plain(value: Any) -> Any:
    """As JSON has it: NaN and infinity become null."""
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, dict):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, bytes):
        return f"{len(value)} bytes of PNG, in the page"
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def as_json(results: Results) -> str:
    return json.dumps({"schema": SCHEMA, **plain(results)}, indent=1, allow_nan=False) + "\n"


def as_csv(results: Results) -> str:
    """A row a number."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for section, rows in _tables(results):
        for row in rows:
            fields = plain(row)
            name, k = fields.pop("name"), fields.pop("k", "")
            writer.writerows(_lines(section, name, k, fields))
    return text.getvalue()


def _tables(results: Results) -> Iterator[tuple[str, list[Any]]]:
    yield "hits", list(results.hits.rows)
    yield "image", [_named(row, f"{row.name}, {row.samples} samples") for row in results.image.rows]
    yield "stability", [_named(row, f"{row.sweep}: {row.name}") for row in results.stability.rows]
    yield "left out", list(results.left_out.rows)


def _named(row: Any, name: str) -> dict[str, Any]:
    return {**asdict(row), "name": name}


def _lines(section: str, name: str, k: object, fields: dict[str, Any]) -> Iterator[list[object]]:
    for quantity, value in fields.items():
        if isinstance(value, dict) and "median" in value:
            yield [section, name, quantity, k, value["median"], value["least"], value["most"], value["count"]]
        elif isinstance(value, dict):
            yield from ([section, name, f"{quantity}: {part}", k, number, "", "", ""] for part, number in value.items())
        elif isinstance(value, (int, float, str)) and not isinstance(value, bool) and value != "":
            yield [section, name, quantity, k, value, "", "", ""]
