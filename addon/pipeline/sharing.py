"""Meshes that a scene shows several times: found once, and built once."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Any

import bihtree
import numpy as np
from numpy.typing import NDArray

from .content import have_same_content
from .mesh import Mesh
from .scene import SceneData


def shared(scene: SceneData) -> SceneData:
    """The same scene with those of its meshes that are shown, equal ones once: all of their numbers are the same."""
    row_of: dict[int, int] = {}
    kept: list[Mesh] = []
    alike: defaultdict[tuple[Any, ...], list[int]] = defaultdict(list)
    for row in np.unique(scene.instance_mesh).tolist():
        mesh = scene.meshes[row]
        others = alike[_outside(mesh)]
        same = next((other for other in others if _are_equal(kept[other], mesh)), None)
        if same is None:
            same = len(kept)
            kept.append(mesh)
            others.append(same)
        row_of[row] = same
    rows = np.array([row_of[row] for row in scene.instance_mesh.tolist()], np.int32)
    return replace(scene, meshes=kept, instance_mesh=rows)


def _arrays(mesh: Mesh) -> tuple[NDArray[Any] | None, ...]:
    return mesh.vertices, mesh.triangles, mesh.materials, mesh.corner_normals


def _outside(mesh: Mesh) -> tuple[Any, ...]:
    """What tells most meshes apart without a look at their numbers."""
    return tuple(None if array is None else (array.shape, array.dtype.str) for array in _arrays(mesh))


def _are_equal(one: Mesh, other: Mesh) -> bool:
    """By bytes: of 0 and -0 one may be shown where the other is not."""
    return have_same_content(_arrays(one), _arrays(other))


@dataclass(frozen=True)
class Totals:
    """What a tree is, or the trees of a scene together with the one over them."""

    triangles: int
    rejected: int
    nodes: int
    leaves: int
    unbuilt: int
    depth: int
    tree_bytes: int
    bound_bytes: int
    peak_build_bytes: int
    build_seconds: float


def totals(tree: bihtree.Tree | bihtree.Scene, rows: NDArray[np.int32]) -> Totals:
    """`rows` are those of the trees that instances show."""
    own = tree.stats
    if not isinstance(tree, bihtree.Scene):
        return Totals(**{name: getattr(own, name) for name in Totals.__dataclass_fields__})
    each = [one.stats for one in tree.trees]
    return Totals(
        triangles=own.triangles,
        rejected=sum(each[row].rejected for row in rows.tolist()),
        nodes=own.nodes + sum(stats.nodes for stats in each),
        leaves=sum(stats.leaves for stats in each),
        unbuilt=sum(stats.unbuilt for stats in each),
        depth=own.depth + max((stats.depth for stats in each), default=0),
        tree_bytes=own.tree_bytes + sum(stats.tree_bytes for stats in each),
        bound_bytes=own.bound_bytes + sum(stats.bound_bytes for stats in each),
        peak_build_bytes=own.peak_build_bytes + sum(stats.peak_build_bytes for stats in each),
        build_seconds=own.build_seconds + sum(stats.build_seconds for stats in each),
    )
