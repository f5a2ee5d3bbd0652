"""A scene ready to be traced: what it needs is decided and its tree is built, once for any number of pictures."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any

import bihtree
import numpy as np
from numpy.typing import NDArray

from . import needs
from .camera import CameraView, Tile
from .errors import UserError
from .scene import SceneData
from .settings import Settings
from .sharing import totals
from .tree_cache import TreeCache

Progress = Callable[[str, float], bool | None]
"""Gets a stage ("build", "trace", "overlay" or "write") and how much of it is done, 0 to 1; False cancels."""

TREE_OPTIONS = ("structure", "layout", "heuristic", "precision")
"""The settings that bihtree.Tree takes as they are, by the same names; needs.plan decides the others."""


@dataclass(frozen=True)
class Prepared:
    scene: SceneData
    settings: Settings
    plan: needs.Plan
    tree: bihtree.Tree | bihtree.Scene
    threads: int
    seconds: dict[str, float]
    """What it took to get here, by the names that the report has."""

    def picture(
        self,
        view: CameraView | None = None,
        *,
        tile: Tile | None = None,
        samples: int | None = None,
        first_sample: int = 0,
        progress: Callable[[float], bool | None] | None = None,
    ) -> dict[str, NDArray[Any]]:
        """The passes of the plan, (H, W, C) with the first row at the bottom, or of `tile` alone in its own size.
        None: the scene's own camera and samples, these from `first_sample` on. Another view is right where the plan
        left no object out.

        Raises bihtree.Cancelled where `progress` returns False.
        """
        view = view or camera_of(self.scene)
        given = dict(self.plan.render)
        wanted = given["passes"]
        if self.plan.is_instanced and "triangle" in wanted:
            # A row of a mesh is one of the scene by its instance.
            given["passes"] = tuple(dict.fromkeys((*wanted, "instance")))
        passes = bihtree.render(
            self.tree,
            bihtree.Camera(view.clip_to_world, view.width, view.height),
            samples=self.settings.samples if samples is None else samples,
            first_sample=first_sample,
            seed=self.settings.seed,
            tile=tile,
            **given,
            progress=progress,
        )
        if not view.perspective and "depth" in passes:
            passes["depth"] = passes["depth"] + np.float32(view.near)
        if "triangle" in passes:
            if self.plan.is_instanced:
                passes["triangle"] = self.plan.rows_of_instances(passes["triangle"], passes["instance"])
            passes["triangle"] = self.plan.rows_of_all(passes["triangle"])
        if "instance" in passes:
            passes["instance"] = self.plan.instances_of_all(passes["instance"])
        return {name: passes[name] for name in wanted}

    def report(self, trace_seconds: float, tile: Tile | None = None) -> dict[str, Any]:
        """Plain JSON values: times in seconds, sizes in bytes. `tile`: all that was traced."""
        view, stats = camera_of(self.scene), self.tree.stats
        made = totals(self.tree, self.plan.scene.instance_mesh)
        width, height = tile[2:] if tile else (view.width, view.height)
        rays = width * height * self.settings.samples
        return {
            "scene": self.scene.name,
            "width": width,
            "height": height,
            "samples": self.settings.samples,
            "threads": self.threads or _cores(),
            "structure": self.settings.structure,
            "layout": self.settings.layout,
            "build": stats.build,
            "precision": stats.precision,
            "meshes": len(self.scene.meshes),
            "instances": len(self.scene.instance_mesh),
            "vertices": self.plan.scene.vertex_count,
            "triangles": made.triangles,
            "rejected": made.rejected,
            "nodes": made.nodes,
            "leaves": made.leaves,
            "unbuilt": made.unbuilt,
            "depth": made.depth,
            "tree_bytes": made.tree_bytes,
            "bound_bytes": made.bound_bytes,
            "bytes_per_triangle": made.tree_bytes / made.triangles,
            "peak_build_bytes": made.peak_build_bytes,
            **self.seconds,
            "build_seconds": made.build_seconds,
            "trace_seconds": trace_seconds,
            "primary_rays": rays,
            "rays_per_second": rays / trace_seconds,
            "needs": needs.report(self.plan.parts, stats.left_out),
            "skipped": list(self.scene.skipped),
            "cpu_features": bihtree.cpu_features(),
            "versions": {
                "bihtree": bihtree.__version__,
                "numpy": np.__version__,
                "python": platform.python_version(),
            },
        }


def prepare(
    scene: SceneData,
    settings: Settings,
    wanted: Collection[str],
    *,
    tree_shown: bool,
    export_seconds: float = 0.0,
    trees: TreeCache | None = None,
    progress: Progress | None = None,
) -> Prepared:
    """Decide what the scene needs for the passes `wanted`, and build the tree, or take it from `trees`. It borrows the
    arrays of a scene that is one mesh not moved, or whose meshes are shared: they become read-only.

    Raises UserError for a scene without a camera or triangles, or with a vertex that is not finite, and
    bihtree.Cancelled where `progress` returns False.
    """
    camera_of(scene)
    _check_geometry(scene)
    started = perf_counter()
    plan = needs.plan(scene, settings, wanted, tree_shown=tree_shown)
    decided = perf_counter()
    options: dict[str, Any] = {**{name: getattr(settings, name) for name in TREE_OPTIONS}, **plan.tree}
    cache = TreeCache() if trees is None else trees
    told = stage(progress, "build")
    tree: bihtree.Tree | bihtree.Scene
    if plan.is_instanced:
        tree, flatten_seconds = cache.scene(plan.scene, options, told), 0.0
    else:
        tree, flatten_seconds = cache.tree(plan.scene, plan.flatten, options, told)
    seconds = {
        "export_seconds": export_seconds,
        "decide_seconds": decided - started,
        "flatten_seconds": flatten_seconds,
    }
    return Prepared(scene, settings, plan, tree, options["threads"], seconds)


def camera_of(scene: SceneData) -> CameraView:
    """The scene's camera. Raises UserError where it has none."""
    if scene.camera is None:
        raise UserError(f"scene {scene.name!r} has no camera: add one and make it the scene's active camera")
    return scene.camera


def stage(progress: Progress | None, name: str) -> Callable[[float], bool | None] | None:
    """What is told of one stage alone."""
    return None if progress is None else partial(progress, name)


def _check_geometry(scene: SceneData) -> None:
    if not scene.triangle_count:
        why = f" ({'; '.join(scene.skipped)})" if scene.skipped else ""
        what = "no mesh" if not len(scene.instance_mesh) else "no triangles"
        raise UserError(
            f"scene {scene.name!r} has {what} to trace{why}: add an object with faces, or show a hidden one in renders"
        )
    for row in np.unique(scene.instance_mesh):
        scene.meshes[row].check_finite()


def _cores() -> int:
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1
