"""Where the thresholds of addon/pipeline/needs.py lie: scenes at which a part is measured kept and left out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from addon.pipeline.camera import framing_view, perspective_view
from addon.pipeline.scene import SceneData
from addon.pipeline.settings import Settings
from addon.report.scenes import soup, terrain
from addon.report.shapes import sphere

from .needs_scenes import Case, framed, mesh_of

COMBINED = Settings(passes=("combined",))


@dataclass(frozen=True)
class Point:
    """One size at which a part is measured both ways."""

    part: str
    what: str
    case: Case


def points() -> Iterator[Point]:
    """All, part by part."""
    for size in (1_000, 4_000, 8_000, 16_000, 64_000, 256_000, 1_000_000):
        for name, make in (("terrain", terrain), ("soup", soup)):
            case = Case(framed(mesh_of(name, make(size).mesh), (64, 48)), COMBINED)
            yield Point("bucket sort", f"{name}, {size:,}", case)
    for level in (1, 3, 5):
        for side in (8, 16, 32, 64, 128):
            ball = mesh_of("ball", sphere(level))
            case = Case(framed(ball, (side, side)), COMBINED)
            yield Point("threads", f"{side * side:,} rays, {len(ball.triangles):,} triangles", case)
    for count in (1, 2, 4, 8):
        few = mesh_of("few", soup(count).mesh)
        yield Point("tree", f"{count} triangles", Case(framed(few, (160, 120)), COMBINED))
    yield from _on_demand()


def _on_demand() -> Iterator[Point]:
    for size in (250_000, 1_000_000, 4_000_000):
        mesh = mesh_of("terrain", terrain(size).mesh)
        for share, name in ((0.6, "a corner"), (2.5, "a quarter"), (None, "all")):
            if share is None:
                view = framing_view(np.stack([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]), 320, 240)
            else:
                eye, target, up = np.array([5.0, 1.2, 5]), np.array([5.4, 0.6, 5.5]), np.array([0, 1.0, 0])
                view = perspective_view(eye, target, up, 320, 240, field_of_view=1.0, near=0.01, far=2 * share)
            case = Case(SceneData.of_mesh(mesh, view), COMBINED)
            yield Point("on demand", f"{size:,}, {name} in view", case)
