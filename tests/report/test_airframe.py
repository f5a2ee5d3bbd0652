"""The airframe: as many triangles as its formula says, and each view shows what it is named after."""

from __future__ import annotations

import bihtree
import numpy as np
import pytest

from addon.report.airframe import VIEWS, airframe, radius, triangles
from addon.report.view import Scene, camera_of


@pytest.mark.parametrize("size", [1, 3_000, 3_111, 9_999, 10_000, 123_456, 1_000_003])
def test_as_many_triangles_as_the_formula_says(size: int) -> None:
    mesh = airframe(size).mesh
    assert len(mesh.triangles) == triangles(size)
    assert mesh.vertices.dtype == np.float32
    assert np.isfinite(mesh.vertices).all()
    assert mesh.triangles.max() == len(mesh.vertices) - 1


@pytest.mark.parametrize("size", [5_000, 77_777, 10_000_000, 349_569_456])
def test_a_large_one_is_as_large_as_asked_but_for_seven(size: int) -> None:
    assert size - 7 <= triangles(size) <= size


def test_it_is_made_of_small_separate_parts() -> None:
    """Triangles that share vertices are one part: thousands of them, none of a hundredth of all triangles."""
    mesh = airframe(50_000).mesh
    part = np.arange(len(mesh.vertices))
    while True:
        least = part[mesh.triangles].min(axis=1)
        lower = part.copy()
        np.minimum.at(lower, mesh.triangles.ravel(), np.repeat(least, 3))
        if np.array_equal(lower, part):
            break
        part = lower[lower]
    sizes = np.unique(part[mesh.triangles[:, 0]], return_counts=True)[1]
    assert len(sizes) > 4_000
    assert sizes.max() < 500


def test_the_fuselage_is_round_and_pointed() -> None:
    assert (radius(np.linspace(0, 12, 100)) > 0).all()
    assert radius(5.0) == 1
    assert (radius([0.0, 12.0]) < 0.2).all()


@pytest.mark.parametrize("name", VIEWS)
def test_every_view_is_full_of_it(name: str) -> None:
    """From within nearly all is hit; from outside a good part of the picture; and many triangles of it."""
    mesh = airframe(200_000).mesh
    view = camera_of(Scene(mesh, VIEWS[name]), 80, 64)
    hits = bihtree.Tree(mesh.vertices, mesh.triangles).intersect(*bihtree.Camera(view.clip_to_world, 80, 64).rays())
    assert hits.hit.mean() > {"whole": 0.05, "engine": 0.4}.get(name, 0.8)
    assert len(np.unique(hits.triangle)) > 100
