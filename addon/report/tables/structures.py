"""Structures side by side: memory, frame rate and time to image."""

from __future__ import annotations

from .. import published
from ..markdown import number, paragraph, table
from ..rounds import Measured, Structure, measure
from ..structures import Embreex, Ours
from ..view import camera_of
from .options import Named, Options, Progress, milliseconds

STRUCTURES: tuple[tuple[Structure, str], ...] = (
    (Ours("BIH, wide", {"layout": "wide", "threads": 1}), "BIH"),
    (Ours("BIH, wide, fast", {"layout": "wide", "precision": "fast", "threads": 1}), "BIH"),
    (Ours("BIH, classic", {"layout": "classic", "threads": 1}), "BIH"),
    (Ours("BIH, compact", {"layout": "compact", "threads": 1}), "BIH"),
    (Ours("on demand, wide", {"layout": "wide", "build": "on_demand", "threads": 1}), "on demand"),
    (Ours("on demand, classic", {"layout": "classic", "build": "on_demand", "threads": 1}), "on demand"),
    (Ours("kd_tree", {"structure": "kd_tree", "layout": "classic", "heuristic": "sah", "threads": 1}), "kd"),
    (Ours("bvh", {"structure": "bvh", "layout": "wide", "heuristic": "sah", "threads": 1}), ""),
    (Embreex(), ""),
)
"""Each, and which of the slides' columns it stands beside."""


def section(options: Options, progress: Progress, mesh: Named, printed: tuple[published.Structure, ...]) -> str:
    """With its heading."""
    progress(f"structures: {mesh}")
    width, height = options.picture()
    shape = mesh.scene.mesh
    found = measure([who for who, _ in STRUCTURES], shape, camera_of(mesh.scene, width, height), options.rounds)
    rows = []
    for structure, theirs in STRUCTURES:
        cells = _cells(found.get(structure.name), shape.vertices.nbytes + shape.triangles.nbytes, mesh.triangles)
        beside = [_printed(row) for row in printed if row.name == theirs]
        rows.append([structure.name, *(cells or [structure.missing(), *["–"] * 4]), *(beside or ["–"])])
        progress("    " + " | ".join(rows[-1]))
    rows += [[f"{row.name} (not ours)", *["–"] * 5, _printed(row)] for row in printed if row.name == "InView"]
    heads = ["structure", "triangles, bytes", "acceleration data, bytes", "bytes a triangle", "frames a second"]
    said = paragraph(
        f"{width} x {height}, one thread, a headlight and no shadows; time to image is from the arrays to the first",
        "picture, after which the bytes are counted; frames are further ones. Hits are exact, but for “fast” and",
        "embreex. Triangles are the caller's arrays, with shared vertices. embreex is given all rays in one call;",
        "NumPy shades, and all threads build.",
        "Published: triangles' bytes, acceleration data, frames a second, time to image.",
    )
    return "\n".join([f"### {mesh} triangles\n", said, table([*heads, "time to image, ms", "as published"], rows)])


def _cells(found: Measured | None, triangle_bytes: int, triangles: int) -> list[str] | None:
    if found is None:
        return None
    held = found.facts.get("tree_bytes")
    sizes = [f"{triangle_bytes:,}", "–" if held is None else f"{held:,}", number(held and held / triangles)]
    return [*sizes, number(found.frames), milliseconds(found.image)]


def _printed(row: published.Structure) -> str:
    frames = "n.a." if row.frames is None else f"{row.frames}"
    return f"{row.triangle_bytes:,}; {row.tree_bytes:,}; {frames}; {row.image_ms:,} ms"
