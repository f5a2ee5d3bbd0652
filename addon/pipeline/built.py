"""A tree built to be looked at: all of a scene as one mesh, its tree, and what both cost."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import bihtree
import numpy as np
from numpy.typing import NDArray

from .camera import CameraView
from .errors import UserError
from .overlay import UNBUILT
from .scene import SceneData
from .settings import Settings

Told = Callable[[str, float], bool | None]
"""Gets a line and how much is done, 0 to 1; False cancels."""

MOST_NODES = 200_000
"""Nodes that are looked at, breadth first; deeper ones of a larger tree are not read."""


@dataclass
class BuiltTree:
    """`vertices` (V, 3) and `triangles` (T, 3) in the world, borrowed by the tree; `nodes` its first MOST_NODES rows,
    as they were when they were last read. `rays` and `trace_seconds` of one look at it; 0 without one."""

    name: str
    vertices: NDArray[np.floating[Any]]
    triangles: NDArray[np.int32]
    tree: bihtree.Tree
    nodes: NDArray[np.void]
    skipped: tuple[str, ...] = ()
    rays: int = 0
    trace_seconds: float = 0.0

    def read_nodes(self) -> None:
        """Again: rays have built more of a tree on demand."""
        self.nodes = self.tree.nodes(limit=MOST_NODES)

    @property
    def deepest(self) -> int:
        """Of the nodes that were read."""
        return int(self.nodes["depth"].max(initial=0))

    @property
    def has_more(self) -> bool:
        """Whether there are nodes that were not read."""
        return len(self.nodes) == MOST_NODES


def build(
    scene: SceneData, settings: Settings, view: CameraView | None = None, *, told: Told = lambda _line, _share: None
) -> BuiltTree:
    """Build the tree of all instances of `scene`, and trace one ray a pixel of `view`.

    Built at once, unless the settings keep "on demand": then by the rays of that look alone.
    Raises UserError where there is nothing to build or a vertex is not finite, and bihtree.Cancelled where `told`
    returns False.
    """
    for row in np.unique(scene.instance_mesh):
        scene.meshes[row].check_finite()
    told("reading the scene", 0.0)
    vertices, triangles = scene.flatten()
    if not len(triangles):
        raise UserError(f"scene {scene.name!r} has no triangles; add an object with faces, or show a hidden one")
    tree = _tree(vertices, triangles, settings, told)
    built = BuiltTree(scene.name, vertices, triangles, tree, tree.nodes(limit=1), tuple(scene.skipped))
    if view is not None:
        told("tracing", 0.0)
        started = perf_counter()
        camera = bihtree.Camera(view.clip_to_world, view.width, view.height)
        bihtree.render(tree, camera, shadows=False, progress=lambda share: told("tracing", share))
        built.rays, built.trace_seconds = view.width * view.height, perf_counter() - started
    built.read_nodes()
    return built


def rebuilt(made: BuiltTree, settings: Settings, *, told: Told = lambda _line, _share: None) -> BuiltTree:
    """Another tree over the same mesh. Raises bihtree.Cancelled where `told` returns False."""
    tree = _tree(made.vertices, made.triangles, settings, told)
    return BuiltTree(made.name, made.vertices, made.triangles, tree, tree.nodes(limit=MOST_NODES), made.skipped)


def _tree(
    vertices: NDArray[np.floating[Any]], triangles: NDArray[np.int32], settings: Settings, told: Told
) -> bihtree.Tree:
    options = tree_options(settings)
    return bihtree.Tree(vertices, triangles, **options, copy=False, progress=lambda share: told("building", share))


def tree_options(settings: Settings) -> dict[str, Any]:
    """What bihtree.Tree is told."""
    return {
        "structure": settings.structure,
        "layout": settings.layout,
        "heuristic": settings.heuristic,
        "precision": settings.precision,
        "leaf_size": settings.leaf_size,
        "threads": settings.threads,
        "build": "on_demand" if settings.parts.get("on demand") else "eager",
        "presort": settings.parts.get("bucket sort"),
    }


def table(built: BuiltTree) -> list[tuple[str, str]]:
    """What it is and what it cost: a label and a value each."""
    stats = built.tree.stats
    rows = [
        ("Triangles", f"{stats.triangles:,}"),
        ("Nodes", f"{stats.nodes:,}"),
        ("Leaves", f"{stats.leaves:,}"),
        ("Depth", f"{built.deepest}" + (" and more" if built.has_more else "")),
        ("Bytes a triangle", f"{stats.tree_bytes / max(1, stats.triangles):.1f}"),
        ("Build time", f"{stats.build_seconds:.3f} s"),
    ]
    if built.rays:
        rows += [
            ("Trace time", f"{built.trace_seconds:.3f} s"),
            ("Rays", f"{built.rays:,}"),
            ("Rays a second", f"{built.rays / built.trace_seconds:,.0f}"),
        ]
    rows.append(("Not yet built", f"{unbuilt_share(built):.0%}"))
    if stats.rejected:
        rows.append(("Without area", f"{stats.rejected:,}"))
    return rows


def left_out(built: BuiltTree) -> list[tuple[str, str]]:
    """What this mesh did without, and why; large numbers as they stand in the table."""
    return [
        (name.capitalize(), re.sub(r"\d{4,}", lambda number: f"{int(number[0]):,}", why))
        for name, why in built.tree.stats.left_out.items()
    ]


def unbuilt_share(built: BuiltTree) -> float:
    """The share of the triangles that lie below nodes not yet subdivided."""
    stats = built.tree.stats
    if not stats.unbuilt:
        return 0.0
    nodes = built.nodes
    return float(nodes["count"][nodes["kind"] == UNBUILT].sum()) / stats.triangles
