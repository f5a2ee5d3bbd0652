"""Nodes and tests a ray, inner nodes an object, bytes a triangle, and how much of the bound is used."""

from __future__ import annotations

from collections.abc import Iterator

import bihtree
import numpy as np

from .. import published
from ..markdown import number, paragraph, table
from ..structures import Ours
from ..view import camera_of
from .options import Named, Options, Progress, percent

TREES = (
    Ours("BIH, classic, one object a leaf", {"layout": "classic", "leaf_size": 1}),
    Ours("BIH, classic", {"layout": "classic"}),
    Ours("BIH, wide", {"layout": "wide"}),
    Ours("BIH, compact", {"layout": "compact"}),
    Ours("kd_tree", {"structure": "kd_tree", "layout": "classic", "heuristic": "sah"}),
    Ours("bvh", {"structure": "bvh", "layout": "wide", "heuristic": "sah"}),
)


def rows(options: Options, progress: Progress, mesh: Named) -> Iterator[list[str]]:
    """Of camera rays. Counts repeat exactly: no clock is involved."""
    view = camera_of(mesh.scene, *options.picture())
    origins, directions = bihtree.Camera(view.clip_to_world, view.width, view.height).rays()
    for tree in TREES:
        progress(f"nodes: {mesh}, {tree.name}")
        if missing := tree.missing():
            yield [str(mesh), tree.name, missing, *["–"] * 5]
            continue
        built = tree.build(mesh.scene.mesh, view).tree
        visited, tested = built.traversal_cost(origins, directions)
        stats = built.stats
        inner, count = stats.nodes - stats.leaves, stats.triangles
        # Rounded down: a tree of one object a leaf has one inner node less than objects.
        an_object = f"{1000 * inner // count / 1000:.3f}"
        counts = [number(float(np.mean(visited))), number(float(np.mean(tested))), an_object]
        bound = number(stats.bound_bytes / count) if stats.bound_bytes else "none"
        used = percent(stats.tree_bytes, stats.bound_bytes) if stats.bound_bytes else "–"
        yield [str(mesh), tree.name, *counts, number(stats.tree_bytes / count), bound, used]


def section(found: list[list[str]]) -> str:
    """With its heading."""
    heads = ["mesh, triangles", "tree", "nodes a ray", "tests a ray", "inner nodes an object", "bytes a triangle"]
    most = published.INNER_NODES_AN_OBJECT
    said = paragraph(
        "Camera rays, those that miss the mesh too; leaves are nodes, and a wide record is one. The slides count up to",
        f"{most} inner nodes an object. Those of a BIH of ours stay below 1: a half without objects makes no node, so",
        "there is one inner node less than there are leaves. The bound is known before the build.",
    )
    return "\n".join(["### Nodes\n", said, table([*heads, "bound, bytes a triangle", "of it used"], found)])
