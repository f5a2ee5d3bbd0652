"""A room of few triangles, as Shirley's sixth scene is one: walls, blocks and balls."""

from __future__ import annotations

import numpy as np

from .shapes import Shape, box, joined, scaled, shape, sphere
from .view import Scene, View


def _rectangle(*corners: tuple[float, float, float]) -> Shape:
    """2 triangles over four corners in their order around."""
    return shape(corners, [(0, 1, 2), (0, 2, 3)])


def room() -> Scene:
    """804 triangles: five walls, twelve blocks of 12, five balls of 128, and five pictures."""
    walls = [
        _rectangle((-2, 0, -2), (2, 0, -2), (2, 0, 2), (-2, 0, 2)),
        _rectangle((-2, 3, -2), (2, 3, -2), (2, 3, 2), (-2, 3, 2)),
        _rectangle((-2, 0, -2), (2, 0, -2), (2, 3, -2), (-2, 3, -2)),
        _rectangle((-2, 0, -2), (-2, 0, 2), (-2, 3, 2), (-2, 3, -2)),
        _rectangle((2, 0, -2), (2, 0, 2), (2, 3, 2), (2, 3, -2)),
    ]
    legs = [(x, 0.35, z) for x in (-0.9, 0.9) for z in (-0.6, 0.6)]
    stacked = [(-1.4, 0.2 + 0.4 * step, -1.4) for step in range(4)]
    places = np.array([(0, 0.75, 0), *legs, *stacked, (1.4, 0.3, -1.3), (1.3, 0.15, 1.0), (-1.2, 0.15, 1.2)])
    single = [(0.3, 0.3, 0.3), (0.2, 0.15, 0.3), (0.3, 0.15, 0.2)]
    sizes = [(1, 0.05, 0.7), *[(0.05, 0.35, 0.05)] * 4, *[(0.25, 0.2, 0.25)] * 4, *single]
    blocks = scaled(box(), sizes, places)
    balls = scaled(
        sphere(2),
        [0.2, 0.15, 0.1, 0.3, 0.2],
        [(-0.5, 1.0, 0), (0.2, 0.95, 0.2), (0.6, 0.9, -0.2), (1.4, 0.9, -1.3), (-1.2, 0.5, 1.2)],
    )
    pictures = [
        _rectangle((x, 1.2, -1.99), (x + 0.6, 1.2, -1.99), (x + 0.6, 2.2, -1.99), (x, 2.2, -1.99))
        for x in (-1.8, -1.05, -0.3, 0.45, 1.2)
    ]
    view = View((0, 1.6, 4.5), (0, 1.1, 0), (0, 1, 0), 45, (0.0, 2.8, 0.0))
    return Scene(joined(*walls, blocks, balls, *pictures), view)
