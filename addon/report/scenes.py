"""Scenes by formula, of any size; the same arrays in every run."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .shapes import Shape, quads, shape, soup_of

Point = tuple[float, float, float]


class View(NamedTuple):
    """Where a picture is taken from; `angle` is the vertical one, in degrees; `light` is a point light."""

    eye: Point
    target: Point
    up: Point
    angle: float
    light: Point


class Scene(NamedTuple):
    """A mesh and how it is looked at."""

    mesh: Shape
    view: View


def _value_noise(x: NDArray[np.float64], y: NDArray[np.float64], seed: int) -> NDArray[np.float64]:
    """Smooth noise from 0 to 1 whose lattice has spacing 1."""
    table = np.random.default_rng(seed).random((256, 256))
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = x - column, y - row
    u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
    here, right = table[row % 256, column % 256], table[row % 256, (column + 1) % 256]
    above, across = table[(row + 1) % 256, column % 256], table[(row + 1) % 256, (column + 1) % 256]
    lower, upper = here + u * (right - here), above + u * (across - above)
    return lower + v * (upper - lower)


def terrain(triangles: int) -> Scene:
    """A fractal landscape of 2 n² triangles: nine octaves of noise."""
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
    """Random triangles in the unit cube that share nothing, as large as fills it alike at every count."""
    rng = np.random.default_rng(7)
    size = 0.012 * (1e6 / triangles) ** (1 / 3)
    centres = rng.random((triangles, 1, 3), np.float32)
    corners = centres + np.float32(size) * (rng.random((triangles, 3, 3), np.float32) - np.float32(0.5))
    return Scene(soup_of(corners), View((0.5, 0.6, -1.3), (0.5, 0.5, 0.5), (0, 1, 0), 45, (3.0, 4.0, -3.0)))


SCENES: dict[str, Callable[[int], Scene]] = {"terrain": terrain, "soup": soup}
