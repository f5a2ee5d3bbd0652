"""Loop's scheme on surfaces whose new points are known, and scans of an exact count."""

from __future__ import annotations

import numpy as np
import pytest

from addon.report.shapes import sphere
from addon.report.subdivision import loop_subdivided, scan

TETRAHEDRON = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], np.float64)
SIDES = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


def test_the_new_points_of_a_tetrahedron_are_those_of_the_scheme() -> None:
    """Edges: 3/8 of both ends and 1/8 of both wings. Vertices of valence 3: 7/16 themselves, 9/16 the mean around."""
    vertices, triangles = loop_subdivided(TETRAHEDRON, SIDES)
    assert (len(vertices), len(triangles)) == (4 + 6, 16)
    total = TETRAHEDRON.sum(axis=0)
    for old, new in zip(TETRAHEDRON, vertices[:4], strict=True):
        assert new == pytest.approx(7 / 16 * old + 9 / 16 * (total - old) / 3)
    edges = np.array([TETRAHEDRON[a] + TETRAHEDRON[b] for a in range(4) for b in range(a + 1, 4)])
    expected = 3 / 8 * edges + 1 / 8 * (total - edges)
    distances = np.linalg.norm(expected[:, None] - vertices[None, 4:], axis=2)
    assert (distances.min(axis=1) < 1e-12).all()


def test_where_all_have_six_neighbours_weights_are_those_of_the_box_spline() -> None:
    """Vertices: 5/8 themselves, 1/16 each neighbour. On a torus of 6 x 6, with one vertex raised by 16."""
    size = 6
    here = np.arange(size * size).reshape(size, size)
    right, above = np.roll(here, -1, 1), np.roll(here, -1, 0)
    across = np.roll(above, -1, 1)
    rows = np.stack([here, right, above, above, right, across], axis=2).reshape(-1, 3)
    raised = np.zeros((size * size, 3))
    raised[14, 2] = 16
    vertices, triangles = loop_subdivided(raised, rows)
    assert (len(vertices), len(triangles)) == (4 * size * size, 8 * size * size)
    old, new = vertices[: size * size, 2], vertices[size * size :, 2]
    assert old[14] == pytest.approx(10)
    assert sorted(old.tolist())[-7:-1] == pytest.approx([1] * 6)
    # Of edges: 3/8 at its six ends, 1/8 where it is a wing of one.
    assert sorted(new.tolist())[-12:] == pytest.approx([2] * 6 + [6] * 6)
    assert vertices[:, 2].sum() == pytest.approx(4 * 16)


def test_it_stays_closed_and_turned_the_same_way() -> None:
    ball = sphere(1)
    vertices, triangles = ball.vertices.astype(np.float64), ball.triangles.astype(np.int64)
    for _ in range(2):
        vertices, triangles = loop_subdivided(vertices, triangles)
    directed = set(map(tuple, triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()))
    assert len(directed) == 3 * len(triangles)
    assert {(b, a) for a, b in directed} == directed
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a)
    first = ball.vertices.astype(np.float64)[ball.triangles[0]]
    assert (np.sign(outward) == np.sign(np.linalg.det(first))).all()


@pytest.mark.parametrize("triangles", [1_000, 3_001, 54_463, 67_982])
def test_a_scan_has_the_count_asked_for(triangles: int) -> None:
    mesh, view = scan(triangles)
    assert len(mesh.triangles) == triangles
    assert np.array_equal(np.unique(mesh.triangles), np.arange(len(mesh.vertices)))
    again = scan(triangles)
    assert np.array_equal(mesh.vertices, again.mesh.vertices)
    assert view == again.view
    # What was cut off is little: most edges still have two sides.
    edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    assert counts.max() == 2
    assert (counts == 2).mean() > 0.95
