"""The tables of the slides, each row beside today's: `blender --command bih tables`, and `make tables`."""

from __future__ import annotations

from .. import airframe, published
from ..room import room
from . import bucket_sort, nodes, structures, views
from .bucket_sort import SortAsPublished
from .options import Named, Options, Progress, scanned

__all__ = ["Options", "made"]


def made(options: Options, progress: Progress, sort_as_published: SortAsPublished | None = None) -> str:
    """All of them as Markdown. Raises UserError for a file that is no mesh."""
    progress("meshes")
    dragon = scanned("Dragon", options.dragon, options.dragon_triangles)
    compared = [
        structures.section(options, progress, Named("room by formula", room()), published.SHIRLEY),
        structures.section(options, progress, dragon, published.DRAGON),
    ]
    sorts = list(bucket_sort.rows(options, progress, dragon, published.BUCKET_SORT[1], sort_as_published))
    counts = list(nodes.rows(options, progress, dragon))
    for name, path, triangles, printed in (
        ("Buddha", options.buddha, options.buddha_triangles, published.BUCKET_SORT[0]),
        ("Thai statue", options.thai, options.thai_triangles, published.BUCKET_SORT[2]),
    ):
        progress(f"a mesh of {triangles:,}")
        mesh = scanned(name, path, triangles)
        sorts += bucket_sort.rows(options, progress, mesh, printed, sort_as_published)
        counts += nodes.rows(options, progress, mesh)
    progress(f"an airframe of {options.airframe_triangles:,}")
    plane = Named("airframe by formula", airframe.airframe(options.airframe_triangles))
    boeing = views.section(options, progress, plane)
    counts += nodes.rows(options, progress, plane)
    return "\n".join([bucket_sort.section(sorts), *compared, boeing, nodes.section(counts)])
