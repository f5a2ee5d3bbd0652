"""The main job: a scene and settings in; passes, files and a report out."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import bihtree
import numpy as np
from numpy.typing import NDArray

from . import heat_map, image, overlay_picture, prepared
from .errors import UserError
from .files import check_target, written_beside
from .prepared import Progress, stage
from .scene import SceneData
from .settings import Settings


@dataclass(frozen=True)
class Outputs:
    """Files to write: .exr gets every pass of the settings, any other image the combined pass."""

    images: tuple[Path, ...] = ()
    overlay: Path | None = None
    stats: Path | None = None
    heat_map: Path | None = None

    @property
    def passes(self) -> tuple[str, ...]:
        """What plain pictures and the overlay are made of, whatever the settings ask for."""
        is_plain = any(path.suffix.lower() not in image.MULTILAYER for path in self.images)
        made = {"combined": is_plain or self.overlay, "depth": self.overlay, "cost": self.heat_map}
        return tuple(name for name, is_made in made.items() if is_made)

    @property
    def paths(self) -> tuple[Path, ...]:
        return self.images + tuple(path for path in (self.overlay, self.heat_map, self.stats) if path)


ANY = Outputs(images=(Path("any.png"),), overlay=Path("any.png"))
"""What a caller might still write who does not say so."""


@dataclass(frozen=True)
class Preview:
    """Passes by name, (H, W, C) with the first row at the bottom: those of the settings and what the outputs are made
    of. The report holds plain JSON values: times in seconds, sizes in bytes."""

    passes: dict[str, NDArray[Any]]
    tree: bihtree.Tree | bihtree.Scene
    report: dict[str, Any]


def check_outputs(outputs: Outputs) -> None:
    """Raise UserError for a file that could not be written, before any work is done."""
    paths = [path.resolve() for path in outputs.paths]
    for number, path in enumerate(paths):
        check_target(path)
        if path in paths[:number]:
            raise UserError(f"two outputs have the name {path}; give each its own", exit_status=2)
    for path in outputs.images:
        image.check_format(path)
    for drawn in filter(None, (outputs.overlay, outputs.heat_map)):
        image.check_format(drawn, kinds=image.EIGHT_BIT)


def trace(
    scene: SceneData,
    settings: Settings,
    *,
    outputs: Outputs | None = None,
    export_seconds: float = 0.0,
    progress: Progress | None = None,
) -> Preview:
    """Build the tree once and trace the picture, without what the scene does not need. The tree borrows the arrays of a
    scene that is one mesh not moved: they become read-only. `outputs` are those that will be written; None: any.

    Raises UserError for a scene without a camera or triangles, or with a vertex that is not finite, and
    bihtree.Cancelled where `progress` returns False.
    """
    wanted = dict.fromkeys((*settings.passes, *(ANY.passes if outputs is None else outputs.passes)))
    job = prepared.prepare(
        scene,
        settings,
        tuple(wanted),
        tree_shown=outputs is None or outputs.overlay is not None,
        export_seconds=export_seconds,
        progress=progress,
    )
    started = perf_counter()
    passes = job.picture(progress=stage(progress, "trace"))
    return Preview(passes, job.tree, job.report(perf_counter() - started))


def write(
    preview: Preview,
    scene: SceneData,
    settings: Settings,
    outputs: Outputs,
    *,
    display: image.Display | None = None,
    progress: Progress | None = None,
) -> None:
    """Write all files of `outputs`, or none: they get their names when the last one is finished. Plain pictures show
    what `display` makes of the combined pass; None: sRGB.

    Raises UserError where a file cannot be written, and bihtree.Cancelled where `progress` returns False.
    """
    check_outputs(outputs)
    overlay = None
    if outputs.overlay:
        _tell(progress, "overlay", 0.0)
        overlay = _overlay(preview, scene, settings)
        _tell(progress, "overlay", 1.0)
    with ExitStack() as stack:
        for number, path in enumerate(outputs.paths):
            _tell(progress, "write", number / len(outputs.paths))
            beside = stack.enter_context(written_beside(path))
            if overlay is not None and path == outputs.overlay:
                image.write_srgb8(beside, overlay)
            elif path == outputs.heat_map:
                caption = {"scene": scene.name, "tree": f"{preview.report['structure']}, {preview.report['layout']}"}
                image.write_srgb8(beside, heat_map.draw(preview.passes["cost"], caption))
            elif path == outputs.stats:
                beside.write_text(_json(preview.report), encoding="utf-8")
            elif path.suffix.lower() in image.MULTILAYER:
                image.write_passes(beside, {name: preview.passes[name] for name in settings.passes})
            else:
                image.write_picture(beside, preview.passes["combined"], display)
        _tell(progress, "write", 1.0)


def summary(report: Mapping[str, Any]) -> list[str]:
    """The report in five lines of a table for a person, and one more where triangles were rejected."""
    rows = [f"{about:<6} {number:>9} {unit}" + (f"   {of}" if of else "") for about, number, unit, of in _rows(report)]
    return rows + _rejected(report)


def sentences(report: Mapping[str, Any]) -> list[str]:
    """The same where columns have no room."""
    rows = [
        f"{about.capitalize()}: {number} {unit}" + (f", {of}" if of else "")
        for about, number, unit, of in _rows(report)
    ]
    return rows + _rejected(report)


def _rows(report: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """What it is about, a number, its unit, and how much there was of what."""
    return [
        ("export", f"{report['export_seconds']:.3f}", "s", f"{report['vertices']:,} vertices"),
        ("build", f"{report['build_seconds']:.3f}", "s", f"{report['triangles']:,} triangles"),
        ("trace", f"{report['trace_seconds']:.3f}", "s", f"{report['width']:,} x {report['height']:,} pixels"),
        ("tree", f"{report['bytes_per_triangle']:.1f}", "bytes a triangle", ""),
        ("rays", f"{report['rays_per_second']:,.0f}", "camera rays a second", ""),
    ]


def _rejected(report: Mapping[str, Any]) -> list[str]:
    count = report["rejected"]
    return [f"{count:,} triangles have no area and are not in the picture"] if count else []


def _overlay(preview: Preview, scene: SceneData, settings: Settings) -> NDArray[np.uint8]:
    depth, stats = settings.overlay_depth, preview.tree.stats
    # Behind the scene is paper, whatever the world is.
    is_hit = np.isfinite(preview.passes["depth"])
    return overlay_picture.draw_overlay(
        np.where(is_hit, preview.passes["combined"], np.float32(0)),
        preview.passes["depth"],
        preview.tree.nodes(max_depth=depth),
        prepared.camera_of(scene),
        depth,
        caption={"scene": scene.name, "whole tree": f"{stats.nodes:,} nodes, {stats.depth} deep"},
    )


def _json(report: Mapping[str, Any]) -> str:
    versions = {**report["versions"], "OpenImageIO": image.version()}
    return json.dumps({**report, "versions": versions}, indent=2, allow_nan=False) + "\n"


def _tell(progress: Progress | None, stage: str, fraction: float) -> None:
    if progress is not None and progress(stage, fraction) is False:
        raise bihtree.Cancelled("cancelled")
