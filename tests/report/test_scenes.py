"""Scenes by formula: as many triangles as the formulas say, and meshes that are what they claim to be."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from addon.report import building, databases, scenes
from addon.report.shapes import Shape, box, ring, sphere, tube
from addon.report.view import Scene

LEVELS: list[tuple[Callable[..., Scene], int, int]] = [
    *[(databases.tetra, level, 4**level) for level in (1, 2, 5)],
    *[(databases.balls, level, 8 * 4**2 * (9 ** (level + 1) - 1) // 8 + 2) for level in (0, 1, 2)],
    *[(databases.gears, size, 572 * size**3 + 2) for size in (1, 2, 3)],
    *[(databases.mount, level, 2 * 4**level + 4 * 8 * 4**3) for level in (0, 1, 4)],
    *[(databases.rings, size, 3 * size**3 * 2 * 10 * 24) for size in (1, 2)],
    *[(databases.shells, count, count * 7 * 4**5) for count in (1, 3)],
    *[(databases.jacks, size, 36 * size**3) for size in (1, 3)],
    *[(databases.lattice, size, (size + 1) ** 3 * 32 + 3 * (size + 1) ** 2 * 16) for size in (1, 2)],
    *[(databases.tree, level, 12 * sum(3**k for k in range(level + 1)) + 2) for level in (0, 1, 4)],
    *[(databases.sponge, level, 4 * 20**level + 8 * 8**level) for level in (0, 1, 2, 3)],
]


@pytest.mark.parametrize(("make", "level", "count"), LEVELS)
def test_triangles_of_a_level(make: Callable[..., Scene], level: int, count: int) -> None:
    assert len(make(level).mesh.triangles) == count


@pytest.mark.parametrize("name", scenes.SCENES)
@pytest.mark.parametrize("triangles", [1_000, 30_000])
def test_a_scene_is_as_large_as_asked_and_the_same_every_time(name: str, triangles: int) -> None:
    mesh, view = scenes.SCENES[name](triangles)
    again = scenes.SCENES[name](triangles)
    assert np.array_equal(mesh.vertices, again.mesh.vertices)
    assert np.array_equal(mesh.triangles, again.mesh.triangles)
    assert view == again.view
    assert mesh.vertices.dtype == np.float32
    assert mesh.triangles.dtype == np.uint32
    assert np.isfinite(mesh.vertices).all()
    # Every vertex is one of a triangle.
    assert np.array_equal(np.unique(mesh.triangles), np.arange(len(mesh.vertices)))
    # The databases have levels, 20-fold apart at most.
    assert triangles / 8 <= len(mesh.triangles) <= triangles * 8


@pytest.mark.parametrize("triangles", [1_000, 12_345, 100_000])
def test_counts_of_the_others(triangles: int) -> None:
    assert len(scenes.soup(triangles).mesh.triangles) == triangles
    assert len(scenes.city(triangles).mesh.triangles) == (triangles - 2) // 12 * 12 + 2
    assert len(scenes.terrain(triangles).mesh.triangles) == 2 * round((triangles / 2) ** 0.5) ** 2
    assert len(scenes.stadium(triangles).mesh.triangles) == pytest.approx(triangles, rel=0.1)


def edges(mesh: Shape) -> tuple[np.ndarray, np.ndarray]:
    """The directed edges of a mesh whose vertices of one place are one, and how often each stands there."""
    _, rows = np.unique(mesh.vertices, axis=0, return_inverse=True)
    corners = rows.reshape(-1)[mesh.triangles]
    directed = corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return np.unique(directed, axis=0, return_counts=True)


def is_closed(mesh: Shape) -> bool:
    """Each directed edge has its opposite, as often."""
    directed, counts = edges(mesh)
    opposite, other_counts = edges(Shape(mesh.vertices, mesh.triangles[:, ::-1]))
    return np.array_equal(directed, opposite) and np.array_equal(counts, other_counts)


def volume(mesh: Shape) -> float:
    a, b, c = mesh.vertices.astype(np.float64)[mesh.triangles].transpose(1, 0, 2)
    return abs(float(np.sum(a * np.cross(b, c)))) / 6


def test_closed_solids_of_known_volume() -> None:
    assert is_closed(box())
    assert volume(box()) == pytest.approx(8)
    assert is_closed(sphere(5))
    assert volume(sphere(5)) == pytest.approx(4 / 3 * np.pi, rel=0.002)
    assert volume(ring(64, 256, 0.2)) == pytest.approx(2 * np.pi**2 * 0.2**2, rel=0.003)
    assert volume(databases.tetra(1).mesh) == pytest.approx(8 / 3)
    for level in (0, 1, 2, 3):
        assert is_closed(databases.sponge(level).mesh)
        assert volume(databases.sponge(level).mesh) == pytest.approx((20 / 27) ** level)
    assert is_closed(databases.gears(1).mesh._replace(triangles=databases.gears(1).mesh.triangles[:-2]))


def test_a_sphere_without_an_octant_is_open() -> None:
    assert len(sphere(2, octants=7).triangles) == 7 * 16
    assert not is_closed(sphere(2, octants=7))
    assert np.allclose(np.linalg.norm(sphere(3).vertices, axis=1), 1)


def test_a_tube_has_its_area() -> None:
    a, b, c = tube(256, 3).vertices[tube(256, 3).triangles].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(2 * np.pi, rel=0.001)


def test_tetrahedra_touch_but_do_not_overlap() -> None:
    """Sierpinski's: half the size, four times as many, so half the volume a level."""
    for level in (2, 3, 4):
        assert volume(databases.tetra(level).mesh) == pytest.approx(8 / 3 * 0.5 ** (level - 1), rel=1e-5)


def test_the_balls_touch_their_parents() -> None:
    mesh = databases.balls(2).mesh
    spheres = mesh.vertices[:-4].reshape(91, -1, 3).astype(np.float64)
    centres, radii = spheres.mean(axis=1), np.linalg.norm(spheres - spheres.mean(axis=1, keepdims=True), axis=2).max(1)
    for child in range(1, 91):
        parent = (child - 1) // 9
        assert np.linalg.norm(centres[child] - centres[parent]) == pytest.approx(radii[child] + radii[parent], rel=1e-4)


def test_a_building_is_seen_from_within_one_of_its_rooms() -> None:
    rooms = 40
    mesh, view = building.building(5_820 * rooms)
    assert len(mesh.triangles) == 5_820 * rooms
    lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    # Two storeys of ten rooms on either side of the corridor.
    assert np.allclose(upper - lower, [10 * building.WIDE, 2 * building.HIGH, 2 * building.DEEP + building.CORRIDOR])
    cell = [building.WIDE, building.HIGH, building.DEEP]
    places = [np.floor_divide(point, cell) for point in (view.eye, view.target, view.light)]
    assert np.array_equal(places[0], places[1])
    assert np.array_equal(places[0], places[2])


@pytest.mark.parametrize("exponent", [0, 3, 9])
def test_the_stadium_is_as_stiff_as_asked(exponent: float) -> None:
    mesh, view = scenes.stadium(20_000, exponent)
    size = mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)
    assert size[0] == pytest.approx(1)
    distance = np.linalg.norm(mesh.vertices, axis=1)
    near = (distance < 0.7 * 10.0**-exponent).sum()
    assert near >= 4_000
    assert np.linalg.norm(view.eye) < 10 * 10.0**-exponent


def test_every_scene_is_in_its_picture() -> None:
    """The target lies in the bounds, the eye does not lie in it, and up is not the direction of view."""
    for name, make in scenes.SCENES.items():
        mesh, view = make(3_000)
        lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        assert (lower <= view.target).all(), name
        assert (view.target <= upper).all(), name
        along = np.subtract(view.target, view.eye)
        assert np.linalg.norm(np.cross(along, view.up)) > 0.1 * np.linalg.norm(along), name
