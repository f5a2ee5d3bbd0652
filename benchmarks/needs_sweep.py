"""Where the thresholds of addon/pipeline/needs.py lie: scenes at which a part is measured kept and left out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from addon.pipeline.camera import framing_view, perspective_view
from addon.pipeline.mesh import Mesh
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
    yield from _instances()
    yield from _on_demand()


def _instances() -> Iterator[Point]:
    """A field of equal balls, turned and shrunk at random, looked at as a whole."""
    for level in (3, 5):
        ball = mesh_of("ball", sphere(level))
        for side in (4, 8, 16, 32):
            scene = field_of(ball, side)
            if 100_000 <= scene.triangle_count <= 8_000_000:
                what = f"{side * side:,} of {len(ball.triangles):,} triangles"
                yield Point("instances", what, Case(scene, COMBINED))


def field_of(mesh: Mesh, side: int) -> SceneData:
    """side * side instances of a mesh of about unit size, and a camera, 320 x 240."""
    rng = np.random.default_rng(1)
    matrices = np.zeros((side * side, 4, 4))
    turns, _ = np.linalg.qr(rng.normal(size=(side * side, 3, 3)))
    matrices[:, :3, :3] = turns * rng.uniform(0.3, 0.6, (side * side, 1, 1))
    rows, columns = np.divmod(np.arange(side * side), side)
    matrices[:, 0, 3], matrices[:, 1, 3], matrices[:, 3, 3] = 2 * columns, 2 * rows, 1
    view = framing_view(np.array([(-1.0, -1.0, -1.0), (2.0 * side, 2.0 * side, 1.0)]), 320, 240)
    return SceneData([mesh], np.zeros(side * side, np.int32), matrices, "field", view)


def _on_demand() -> Iterator[Point]:
    """A landscape of 10 x 10 from above, so high that a share of it is in view."""
    for size in (16_000, 64_000, 256_000, 1_000_000, 4_000_000):
        mesh = mesh_of("terrain", terrain(size).mesh)
        for share in (0.02, 0.1, 0.25, 0.5):
            width, angle = 10 * (share / 0.75) ** 0.5, 0.5
            eye, target = np.array([5.0, 0.5 * width / np.tan(0.5 * angle) + 0.6, 5]), np.array([5.0, 0, 5])
            up = np.array([0, 0, 1.0])
            view = perspective_view(eye, target, up, 320, 240, field_of_view=angle, near=0.1, far=2 * eye[1])
            case = Case(SceneData.of_mesh(mesh, view), COMBINED)
            yield Point("on demand", f"{size:,}, {share:.0%} in view", case)
