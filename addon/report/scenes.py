"""Scenes by formula, of about any size; the same arrays in every run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from . import databases
from .airframe import airframe
from .building import building
from .shapes import Shape, box, ground, joined, quads, scaled, shape, soup_of, surface
from .view import Scene, View, framed


def _value_noise(x: NDArray[np.float64], y: NDArray[np.float64], seed: int) -> NDArray[np.float64]:
    """Smooth noise from 0 to 1 whose lattice has spacing 1."""
    table = np.random.default_rng(seed).random((256, 256))
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - column, y - row
    u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
    here, right = table[row % 256, column % 256], table[row % 256, (column + 1) % 256]
    above, across = table[(row + 1) % 256, column % 256], table[(row + 1) % 256, (column + 1) % 256]
    lower, upper = here + u * (right - here), above + u * (across - above)
    smooth: NDArray[np.float64] = lower + v * (upper - lower)
    return smooth


def terrain(triangles: int) -> Scene:
    """2 n²: a fractal landscape, nine octaves of noise."""
    size = max(1, round((triangles / 2) ** 0.5))
    line = np.arange(size + 1) / size
    heights = []
    # By rows of the grid, for the sake of memory.
    for block in np.array_split(line, max(1, size // 256)):
        x, y = np.meshgrid(line, block)
        height = np.zeros_like(x)
        for octave in range(9):
            frequency = 4.0 * 2**octave
            height += 0.12 * 0.5**octave * _value_noise(x * frequency, y * frequency, octave)
        heights.append(np.stack([10 * x, 10 * height, 10 * y], axis=2).astype(np.float32))
    view = View((0.3, 2.6, 0.3), (6.0, 0.6, 6.0), (0, 1, 0), 60, (9.0, 8.0, 1.0))
    return Scene(shape(np.concatenate(heights), quads(size, size)), view)


def soup(triangles: int) -> Scene:
    """Exactly so many random triangles in the unit cube that share nothing, of a size that fills it alike."""
    rng = np.random.default_rng(7)
    size = 0.012 * (1e6 / triangles) ** (1 / 3)
    centres = rng.random((triangles, 1, 3), np.float32)
    corners = centres + np.float32(size) * (rng.random((triangles, 3, 3), np.float32) - np.float32(0.5))
    return Scene(soup_of(corners), View((0.5, 0.6, -1.3), (0.5, 0.5, 0.5), (0, 1, 0), 45, (3.0, 4.0, -3.0)))


def city(triangles: int) -> Scene:
    """12 a box and 2: streets of boxes, towers of stacked ones in the middle, on one plane."""
    rng = np.random.default_rng(17)
    count = max(1, (triangles - 2) // 12)
    side = int(np.ceil((count / 1.5) ** 0.5))
    place = rng.integers(0, side * side, count)
    x, z = place % side, place // side
    # Later boxes on one place stand on the earlier ones and are narrower.
    order = np.argsort(place, kind="stable")
    starts = np.flatnonzero(np.diff(place[order], prepend=-1))
    storey = np.empty(count, np.int64)
    storey[order] = np.arange(count) - np.repeat(starts, np.diff([*starts, count]))
    middle = np.exp(-6 * ((x / side - 0.5) ** 2 + (z / side - 0.5) ** 2))
    height = (0.3 + 2.5 * middle) * (0.3 + rng.random(count))
    floor = storey * (0.3 + 2.0 * middle)
    wide = 0.38 * 0.8**storey * (0.8 + 0.2 * rng.random(count))
    deep = 0.38 * 0.8**storey * (0.8 + 0.2 * rng.random(count))
    sizes = np.stack([wide, height / 2, deep], axis=1)
    mesh = scaled(box(), sizes, np.stack([x, floor + height / 2, z], axis=1))
    middle_of_it = (side - 1) / 2
    view = View(
        (0.1 * side, 0.12 * side + 3, -0.15 * side), (0.55 * side, 0.0, 0.6 * side), (0, 1, 0), 45, (0.0, side, -side)
    )
    return Scene(joined(mesh, ground(0, side, (middle_of_it, middle_of_it))), view)


def _knot(triangles: int) -> Shape:
    """About so many: a knotted and fluted tube around the origin, of size 1."""
    sides = max(3, round((triangles / 16) ** 0.5))
    segments = max(3, triangles // (2 * sides))
    a = np.linspace(0, 2 * np.pi, segments + 1)[:, None]
    b = np.linspace(0, 2 * np.pi, sides + 1)[None]
    radius = 0.33 + 0.11 * np.cos(3 * a)
    spine = np.stack([radius * np.cos(2 * a), 0.11 * np.sin(3 * a), radius * np.sin(2 * a)], axis=2)
    tangent = np.gradient(spine, axis=0)
    tangent /= np.linalg.norm(tangent, axis=2, keepdims=True)
    across = np.cross(tangent, [0, 1.0, 0])
    across /= np.linalg.norm(across, axis=2, keepdims=True)
    upward = np.cross(across, tangent)
    thick = (0.055 + 0.004 * np.cos(9 * b) + 0 * a)[..., None]
    return surface(spine + thick * (np.cos(b)[..., None] * across + np.sin(b)[..., None] * upward))


def stadium(triangles: int, exponent: float = 3) -> Scene:
    """A knot of size 10^-exponent, half of the triangles, in a stadium of size 1; it fills the picture."""
    rows = max(2, round((triangles / 24) ** 0.5))
    columns = max(3, triangles // (4 * rows))
    step = np.repeat(np.arange(rows // 2 + 1), 2)[: rows + 1]
    rise = np.repeat(np.arange(rows // 2 + 2), 2)[1 : rows + 2]
    angle = np.linspace(0, 2 * np.pi, columns + 1)
    out = 0.3 + 0.2 * step / max(1, rows // 2)
    up = 0.2 * (rise / max(1, rows // 2)) ** 1.3
    x, z = np.outer(out, np.cos(angle)), np.outer(out, np.sin(angle))
    stands = np.stack([x, np.repeat(up[:, None], columns + 1, axis=1), z], axis=2)
    size = 10.0**-exponent
    knot = _knot(triangles - 2 - 2 * rows * columns)
    small = scaled(knot, [size], np.zeros((1, 3)))
    view = framed(small, (0.3, 0.5, 1))
    # Off the middle: the diagonal of the ground shall not run below the knot.
    return Scene(joined(small, surface(stands), ground(-size, 0.4, (0.1, 0))), view)


def _nearest(make: Callable[[int], Scene], count: Callable[[int], int], most: int) -> Callable[[int], Scene]:
    """A scene that is given by its level, as one that is given by about how many triangles it has."""

    def at_about(triangles: int) -> Scene:
        return make(min(range(1, most), key=lambda level: abs(np.log(count(level) / triangles))))

    return at_about


SCENES: dict[str, Callable[[int], Scene]] = {
    "terrain": terrain,
    "soup": soup,
    "city": city,
    "stadium": stadium,
    "airframe": airframe,
    "building": building,
    "tetra": _nearest(databases.tetra, lambda level: 4**level, 14),
    "balls": _nearest(databases.balls, lambda level: 16 * (9 ** (level + 1) - 1) + 2, 7),
    "gears": _nearest(databases.gears, lambda size: 572 * size**3 + 2, 40),
    "mount": _nearest(databases.mount, lambda level: 2 * 4**level, 13),
    "rings": _nearest(databases.rings, lambda size: 1440 * size**3, 30),
    "shells": _nearest(databases.shells, lambda count: 7168 * count, 3000),
    "jacks": _nearest(databases.jacks, lambda size: 36 * size**3, 100),
    "lattice": _nearest(databases.lattice, lambda size: 32 * (size + 1) ** 3 + 48 * (size + 1) ** 2, 100),
    "tree": _nearest(databases.tree, lambda level: 6 * (3 ** (level + 1) - 1) + 2, 15),
    "sponge": _nearest(databases.sponge, lambda level: 4 * 20**level + 8 * 8**level, 6),
}
"""By name; each is called with about how many triangles it shall have."""
