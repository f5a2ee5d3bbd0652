"""The Boeing table: an airframe from four places."""

from __future__ import annotations

from .. import airframe, published
from ..markdown import number, paragraph, table
from ..rounds import Measured, Structure, measure
from ..structures import Ours
from ..view import Scene, camera_of
from .options import BOEING_PICTURE, THREADS, Named, Options, Progress, threads_named


def section(options: Options, progress: Progress, plane: Named) -> str:
    """With its heading; each view has trees of its own."""
    width, height = options.picture(BOEING_PICTURE)
    rows = []
    for (name, view), printed in zip(airframe.VIEWS.items(), published.BOEING, strict=True):
        whose = f"{printed.view}: {printed.tree_bytes:,}; {printed.frames}; {printed.total_seconds} s"
        for threads in THREADS:
            progress(f"airframe: {name}, {threads_named(threads)} threads")
            shared = {"layout": "wide", "threads": threads}
            sides = [Ours("on demand", {**shared, "build": "on_demand"}), Ours("eager", shared)]
            seen = Scene(plane.scene.mesh, view)
            found = measure(sides, seen.mesh, camera_of(seen, width, height), options.rounds)
            for side in sides:
                is_theirs = threads == 1 and side.name == "on demand"
                cells = _cells(side, found.get(side.name))
                rows.append([name, side.name, threads_named(threads), *cells, whose if is_theirs else "–"])
                progress("    " + " | ".join(rows[-1]))
    heads = ["view", "build", "threads", "acceleration data, bytes", "frames a second", "total, s", "as published"]
    said = paragraph(
        f"{width} x {height}; total is from the arrays to the first picture, after which the bytes are counted; frames",
        "are further ones, which add to the bytes on demand.",
        f"Published, of {published.BOEING_TRIANGLES:,} triangles on one core, on demand: acceleration data, frames a",
        "second, total. What its views show is not said in the slides: no row is the counterpart of the one that it",
        "stands beside.",
    )
    return "\n".join([f"### {plane} triangles, in the place of the Boeing\n", said, table(heads, rows)])


def _cells(side: Structure, found: Measured | None) -> list[str]:
    if found is None:
        return [side.missing(), "–", "–"]
    return [f"{found.facts['tree_bytes']:,}", number(found.frames), number(found.image)]
