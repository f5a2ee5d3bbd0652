"""A building of furnished rooms, seen from within one of them: hardly any of it is needed for the picture."""

from __future__ import annotations

import numpy as np

from .shapes import Shape, box, copies, joined, scaled, sphere, surface
from .view import Scene, View

WIDE, HIGH, DEEP = 4.0, 3.0, 5.0
CORRIDOR = 2.0


def _blocks(*places: tuple[float, float, float, float, float, float]) -> Shape:
    """12 each: boxes from a lower to an upper corner."""
    corners = np.array(places)
    lower, upper = corners[:, :3], corners[:, 3:]
    return scaled(box(), (upper - lower) / 2, (lower + upper) / 2)


def _shell() -> Shape:
    """132: slabs below and above, walls, one with a window and one with a door, at z = 0 and `DEEP`."""
    x, y, z, thick = WIDE, HIGH, DEEP, 0.06
    return _blocks(
        (0, 0, 0, x, thick, z + CORRIDOR / 2),
        (0, y - thick, 0, x, y, z + CORRIDOR / 2),
        (0, 0, 0, thick, y, z),
        (x - thick, 0, 0, x, y, z),
        (0, 0, 0, x, 0.9, thick),
        (0, 2.4, 0, x, y, thick),
        (0, 0.9, 0, 0.8, 2.4, thick),
        (x - 0.8, 0.9, 0, x, 2.4, thick),
        (0, 0, z - thick, 2.8, y, z),
        (3.7, 0, z - thick, x, y, z),
        (2.8, 2.1, z - thick, 3.7, y, z),
    )


def _shelf() -> Shape:
    """1,500: six boards, and 119 books on five of them."""
    rng = np.random.default_rng(31)
    boards = [(0.1, 0.1 + 0.4 * row, 1.0, 0.4, 0.12 + 0.4 * row, 3.4) for row in range(6)]
    books = []
    for row in range(5):
        for place in 1.02 + 0.1 * np.arange(23 if row == 4 else 24):
            deep, high = 0.2 + 0.08 * rng.random(), 0.22 + 0.12 * rng.random()
            books.append((0.12, 0.12 + 0.4 * row, place, 0.12 + deep, 0.12 + 0.4 * row + high, place + 0.09))
    return _blocks(*boards, *books)


def _table() -> Shape:
    """348: a table, four chairs of six blocks."""
    legs = [(x, 0.06, z, x + 0.06, 0.75, z + 0.06) for x in (1.6, 3.14) for z in (1.8, 2.94)]
    chairs = []
    for x, z, back in ((1.8, 1.35, 1.35), (2.6, 1.35, 1.35), (1.8, 3.1, 3.5), (2.6, 3.1, 3.5)):
        chairs += [(x, 0.45, z, x + 0.42, 0.5, z + 0.42), (x, 0.5, back, x + 0.42, 1.0, back + 0.04)]
        chairs += [(x + a, 0.06, z + b, x + a + 0.04, 0.45, z + b + 0.04) for a in (0, 0.38) for b in (0, 0.38)]
    return _blocks((1.5, 0.75, 1.7, 3.3, 0.8, 3.1), *legs, *chairs)


def _curtain() -> Shape:
    """768: waves before the window."""
    place, height = np.linspace(0, 1, 49), np.linspace(0, 1, 9)[:, None]
    x = 0.1 + 0.9 * place + 0 * height
    return surface(np.stack([x, 0.2 + 2.5 * height + 0 * place, 0.2 + 0.06 * np.sin(40 * place) * (1.2 - height)], 2))


def room() -> Shape:
    """5,820 triangles from 0 to `WIDE`, `HIGH` and `DEEP`, and a half of the corridor before it."""
    round_ones = [(sphere(4), 0.16, (2.2, 0.96, 2.3)), (sphere(3), 0.15, (2.0, 2.78, 2.4))]
    balls = [scaled(ball, [radius], [place]) for ball, radius, place in round_ones]
    cushions = [(x + 0.21, 0.53, z + 0.21) for x, z in ((1.8, 1.35), (2.6, 1.35), (1.8, 3.1), (2.6, 3.1))]
    soft = scaled(sphere(2), np.full((4, 3), [0.18, 0.05, 0.18]), cushions)
    return joined(_shell(), _shelf(), _table(), _curtain(), *balls, soft)


def building(triangles: int) -> Scene:
    """5,820 a room: storeys of rooms on both sides of a corridor, seen from within a room in the middle."""
    part = room()
    count = max(1, round(triangles / len(part.triangles)))
    storeys = max(1, round((count / 8) ** 0.5))
    number = np.arange(count)
    storey, along, side = number % storeys, number // storeys // 2, number // storeys % 2
    # Those of the other side are mirrored at the middle of the corridor.
    turns = np.eye(3) * np.stack([np.ones(count), np.ones(count), 1.0 - 2.0 * side], axis=1)[:, None, :]
    places = np.stack([WIDE * along, HIGH * storey, 2 * (DEEP + CORRIDOR / 2) * side], axis=1)
    mesh = copies(part, turns, places)
    x, y, z = places[(storeys // 2 + 2 * storeys * (along[-1] // 2)) % count].tolist()
    eye, target, light = (x + 3.4, y + 1.7, z + 4.6), (x + 1.6, y + 1.0, z + 1.4), (x + 2.0, y + 2.4, z + 2.4)
    return Scene(mesh, View(eye, target, (0, 1, 0), 65, light))
