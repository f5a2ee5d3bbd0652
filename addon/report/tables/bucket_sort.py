"""Construction with and without the bucket sort."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from .. import published
from ..markdown import number, paragraph, table
from ..rounds import measure
from ..structures import Ours
from ..view import Scene, camera_of
from .options import THREADS, Named, Options, Progress, milliseconds, percent, threads_named

SortAsPublished = Callable[[Scene, str], "tuple[float, float, float] | None"]
"""Of a scene and its name: seconds of a plain construction and of one by the bucket sort as published, and the frame
rate with the latter as a share of that with the former; None where that cannot be measured."""


def rows(
    options: Options,
    progress: Progress,
    mesh: Named,
    printed: published.Sorted,
    sort_as_published: SortAsPublished | None,
) -> Iterator[list[str]]:
    """Ours in two layouts, on one thread and on all, then the sort as published."""
    view = camera_of(mesh.scene, *options.picture())
    whose = f"{printed.mesh}, {printed.triangles:,}: "
    whose += f"{printed.plain_ms:,}; {printed.sorted_ms:,}; {printed.frame_rate} %"
    for layout in ("classic", "wide"):
        for threads in THREADS:
            progress(f"bucket sort: {mesh}, {layout}, {threads_named(threads)} threads")
            sides = [
                Ours(name, {"layout": layout, "presort": presort, "threads": threads})
                for name, presort in (("in place", False), ("sorted", True))
            ]
            found = measure(sides, mesh.scene.mesh, view, options.rounds)
            plain, sort = found["in place"], found["sorted"]
            times = [milliseconds(plain.build), milliseconds(sort.build), number(sort.build / plain.build)]
            rate = percent(sort.frames, plain.frames)
            yield [str(mesh), f"ours, {layout}", threads_named(threads), *times, rate, whose]
    if sort_as_published:
        progress(f"bucket sort as published: {mesh}")
        measured = sort_as_published(mesh.scene, mesh.name)
        if measured:
            in_place, seconds, share = measured
            times = [milliseconds(in_place), milliseconds(seconds), number(seconds / in_place)]
            yield [str(mesh), "as published, another tree", "1", *times, percent(share, 1), whose]


def section(found: list[list[str]]) -> str:
    """With its heading."""
    heads = ["mesh, triangles", "construction", "threads", "in place, ms", "bucket sort, ms", "ratio", "frame rate"]
    said = paragraph(
        "Frame rate is that with the bucket sort, in per cent of that without. Ours sorts by the cells of the",
        "construction itself, so both make one tree, to the bit: what differs from 100 % is noise of the clock.",
        "As published, objects are put into a grid of the box over the average object size times a factor (here one",
        "that makes as many cells as there are objects), and the boxes of its buckets are sorted in the objects'",
        "place,",
        "which makes another tree. That row is a construction of the benchmarks, of one object a leaf and the slides'",
        "12-byte nodes, both without and with that sort; `make tables` alone has it.",
        "The last column is published: in place, bucket sort, frame rate.",
    )
    return "\n".join(["### Bucket sort\n", said, table([*heads, "as published, ms"], found)])
