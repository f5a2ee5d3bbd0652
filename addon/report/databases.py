"""Scenes after the Standard Procedural Databases (Haines, "A Proposal for Standard Graphics Environments", 1987), as
triangles: each is given by its level, and its docstring says how many triangles that makes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .shapes import Shape, along, box, copies, ground, joined, ring, scaled, shape, soup_of, sphere, surface, tube
from .view import Scene, framed


def tetra(level: int) -> Scene:
    """4^level: Sierpinski's tetrahedron."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], np.float64)
    centres = np.zeros((1, 3))
    for step in range(1, level):
        centres = (centres[:, None] + corners * 0.5**step).reshape(-1, 3)
    faces = corners[[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]] * 0.5 ** (level - 1)
    mesh = soup_of(centres[:, None, None] + faces)
    return Scene(mesh, framed(mesh, (0.4, 0.5, 1)))


def balls(level: int, detail: int = 2) -> Scene:
    """(9^(level + 1) - 1) / 8 spheres of 8 · 4^detail, and 2: spheres on spheres on a plane."""
    six, three = np.arange(6) * np.pi / 3, np.arange(3) * 2 * np.pi / 3 + np.pi / 6
    tilt = np.radians(35)
    around = np.stack([np.cos(six), 0 * six, np.sin(six)], axis=1)
    above = np.stack([np.cos(three) * np.sin(tilt), np.full(3, np.cos(tilt)), np.sin(three) * np.sin(tilt)], axis=1)
    children = np.concatenate([around, above])
    centre, axis, radius = np.zeros((1, 3)), np.array([[0.0, 1, 0]]), 1.0
    centres, radii = [centre], [np.array([radius])]
    for _ in range(level):
        axis = (along(axis)[:, None] @ children[None, :, :, None])[..., 0]
        centre = (centre[:, None] + axis * (radius * 4 / 3)).reshape(-1, 3)
        axis, radius = axis.reshape(-1, 3), radius / 3
        centres.append(centre)
        radii.append(np.full(len(centre), radius))
    mesh = scaled(sphere(detail), np.concatenate(radii), np.concatenate(centres))
    view = framed(mesh, (0.3, 0.6, 1))
    return Scene(joined(mesh, ground(-2.5, 12)), view)


TEETH = 36


def _gear() -> Shape:
    """572: a toothed disc around y, 144 corners a side; outer radius 1.1, inner 0.9, from y = -0.5 to 0.5."""
    angle = ((np.arange(TEETH)[:, None] + [0.0, 0.2, 0.5, 0.7]) * (2 * np.pi / TEETH)).ravel()
    radius = np.tile([0.9, 1.1, 1.1, 0.9], TEETH)
    rim = np.stack([radius * np.cos(angle), np.zeros_like(angle), radius * np.sin(angle)], axis=1)
    count = len(rim)
    here = np.arange(count)
    there = np.roll(here, -1)
    side = np.concatenate([np.stack([here, here + count, there], 1), np.stack([there, here + count, there + count], 1)])
    root = np.arange(0, count, 4)
    teeth = np.concatenate([np.stack([root, root + 1, root + 2], 1), np.stack([root, root + 2, root + 3], 1)])
    inner = np.stack([root, root + 3], axis=1).ravel()
    fan = np.stack([np.full(len(inner) - 2, inner[0]), inner[1:-1], inner[2:]], axis=1)
    cap = np.concatenate([teeth, fan])
    rims, caps = [rim - [0, 0.5, 0], rim + [0, 0.5, 0]], [side, cap, cap[:, ::-1] + count]
    return shape(np.concatenate(rims), np.concatenate(caps))


def gears(size: int) -> Scene:
    """572 · size³ + 2: meshing gears in a block over a plane."""
    x, y, z = (grid.ravel() for grid in np.mgrid[0:size, 0:size, 0:size])
    # A neighbour's teeth go where this one's gaps are.
    turn = np.where((x + z) % 2 == 0, 0.0, np.pi / TEETH) + 0.1 * y
    cosine, sine, zero = np.cos(turn), np.sin(turn), np.zeros_like(turn)
    one = np.full_like(turn, 0.7)
    turns = np.stack([cosine, zero, sine, zero, one, zero, -sine, zero, cosine], axis=1).reshape(-1, 3, 3)
    mesh = copies(_gear(), turns, np.stack([2.0 * x, y, 2.0 * z], axis=1))
    view = framed(mesh, (0.5, 0.7, 1))
    return Scene(joined(mesh, ground(-1, 4.0 * size, (size - 1, size - 1))), view)


def mount(level: int, detail: int = 3) -> Scene:
    """2 · 4^level, and 4 spheres of 8 · 4^detail: a mountain by displaced midpoints, spheres above it."""
    rng = np.random.default_rng(3)
    height: NDArray[np.float64] = np.zeros((2, 2))
    for step in range(level):
        size = 2 * len(height) - 1
        finer = np.zeros((size, size))
        finer[::2, ::2] = height
        finer[1::2, ::2] = (finer[:-1:2, ::2] + finer[2::2, ::2]) / 2
        finer[:, 1::2] = (finer[:, :-1:2] + finer[:, 2::2]) / 2
        moved = 0.5 * 0.55**step * rng.standard_normal((size, size))
        moved[::2, ::2] = 0
        height = finer + moved
    z, x = np.mgrid[-1 : 1 : complex(len(height)), -1 : 1 : complex(len(height))]
    mountain = surface(np.stack([x, height, z], axis=2))
    places = [(-0.5, 1.2, 0.1), (0.45, 1.3, -0.3), (0.1, 1.1, 0.5), (0.5, 1.0, 0.6)]
    mesh = joined(mountain, scaled(sphere(detail), np.full(4, 0.2), places))
    return Scene(mesh, framed(mesh, (0.4, 0.7, 1)))


def rings(size: int, sides: int = 10, segments: int = 24) -> Scene:
    """2 · sides · segments · 3 size³: links of a chain that runs along three axes."""
    cell = np.stack([grid.ravel() for grid in np.mgrid[0:size, 0:size, 0:size]], axis=1).astype(np.float64)
    link = ring(sides, segments, 0.18)
    parts = []
    for axis in range(3):
        turn = along(np.eye(3)[axis]) * 0.42
        parts.append(copies(link, turn, cell + 0.5 * np.eye(3)[axis]))
    mesh = joined(*parts)
    return Scene(mesh, framed(mesh, (0.5, 0.6, 1)))


def shells(count: int, detail: int = 5) -> Scene:
    """count · 7 · 4^detail: concentric spheres, one octant cut away so that all are seen."""
    radii = np.linspace(0.5, 1, count)
    mesh = scaled(sphere(detail, octants=7), radii, np.zeros((count, 3)))
    return Scene(mesh, framed(mesh, (1, 0.8, 1)))


def jacks(size: int) -> Scene:
    """36 size³: crosses of three rods, longer than their distance, every one turned in its own way."""
    rng = np.random.default_rng(13)
    thin = 0.04
    rods = scaled(box(), [[0.7, thin, thin], [thin, 0.7, thin], [thin, thin, 0.7]], np.zeros((3, 3)))
    cell = np.stack([grid.ravel() for grid in np.mgrid[0:size, 0:size, 0:size]], axis=1).astype(np.float64)
    directions = rng.standard_normal((len(cell), 3))
    mesh = copies(rods, along(directions / np.linalg.norm(directions, axis=1, keepdims=True)), cell)
    return Scene(mesh, framed(mesh, (0.5, 0.6, 1)))


def lattice(size: int, detail: int = 1, sides: int = 8) -> Scene:
    """(size + 1)³ · 8 · 4^detail + 6 · sides · (size + 1)²: spheres, and rods through the whole of them."""
    points = np.arange(size + 1.0)
    nodes = np.stack([grid.ravel() for grid in np.meshgrid(points, points, points)], axis=1)
    parts = [scaled(sphere(detail), np.full(len(nodes), 0.18), nodes)]
    rod = scaled(tube(sides), [[0.06, float(size), 0.06]], np.zeros((1, 3)))
    parts += [copies(rod, along(np.eye(3)[axis]), nodes[nodes[:, axis] == 0]) for axis in range(3)]
    mesh = joined(*parts)
    return Scene(mesh, framed(mesh, (0.45, 0.35, 1)))


def tree(level: int, sides: int = 6) -> Scene:
    """2 · sides · (3^(level + 1) - 1) / 2 + 2: branches that fork in three, on a plane."""
    foot, direction, length = np.zeros((1, 3)), np.array([[0.0, 1, 0]]), 1.0
    turn, tilt = np.arange(3) * 2 * np.pi / 3, np.radians(32)
    forks = np.stack([np.cos(turn) * np.sin(tilt), np.full(3, np.cos(tilt)), np.sin(turn) * np.sin(tilt)], axis=1)
    branch = tube(sides)
    parts = []
    for _ in range(level + 1):
        size = np.array([0.06 * length, length, 0.06 * length])
        parts.append(copies(branch, along(direction) * size, foot))
        foot = np.repeat(foot + direction * length, 3, axis=0)
        direction = (along(direction)[:, None] @ forks[None, :, :, None])[..., 0].reshape(-1, 3)
        length *= 0.66
    mesh = joined(*parts)
    view = framed(mesh, (0.2, 0.1, 1))
    return Scene(joined(mesh, ground(0, 6)), view)


def sponge(level: int) -> Scene:
    """4 · 20^level + 8 · 8^level: Menger's sponge, the faces between full and empty cells."""
    full = np.ones((1, 1, 1), bool)
    cell = np.ones((3, 3, 3), bool)
    cell[1, 1, :] = cell[1, :, 1] = cell[:, 1, 1] = False
    for _ in range(level):
        full = np.kron(full, cell)
    padded = np.pad(full, 1)
    corners = []
    for axis in range(3):
        lower, upper = np.diff(padded.astype(np.int8), axis=axis) == 1, np.diff(padded.astype(np.int8), axis=axis) == -1
        for faces, order in ((lower, (0, 1, 3, 2)), (upper, (0, 2, 3, 1))):
            cells = np.argwhere(faces).astype(np.float32) - 1
            cells[:, axis] += 1
            # Along the axis itself the difference stands between two cells, along the others the padding counts.
            u, v = np.eye(3, dtype=np.float32)[(axis + 1) % 3], np.eye(3, dtype=np.float32)[(axis + 2) % 3]
            square = np.array([0 * u, u, v, u + v])[list(order)]
            corners.append(cells[:, None] + square)
    points = np.concatenate(corners) / np.float32(len(full))
    first = 4 * np.arange(len(points), dtype=np.uint32)[:, None]
    mesh = shape(points, np.hstack([first, first + 1, first + 2, first, first + 2, first + 3]))
    return Scene(mesh, framed(mesh, (0.6, 0.5, 1)))
