"""An airliner by formula: small separate parts, most of them out of sight, as in a database of construction drawings.

x points from nose to tail, y up; the fuselage has radius 1 and length 12.
"""

from __future__ import annotations

from itertools import count

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .shapes import Shape, along, box, copies, joined, ring, scaled, shape, sphere, tube
from .view import Scene, View

LENGTH = 12.0
SEATS = 6
"""In a row."""
WING, ENGINES = ((4.0, 1.0), (6.5, 6.5)), ((4.2, -0.75, 2.4), (4.2, -0.75, -2.4))
"""Where a wing starts and ends, in x and z; the centres of the engines' fans."""
RIVET = 8

VIEWS: dict[str, View] = {
    "whole": View((-7.0, 6.0, 13.0), (5.5, 0.0, 0.0), (0, 1, 0), 35, (-10.0, 30.0, 30.0)),
    "cockpit": View((1.5, 0.25, 0.1), (0.6, -0.05, 0.0), (0, 1, 0), 60, (1.5, 0.6, 0.0)),
    "engine": View((3.0, -0.5, 3.3), (4.3, -0.75, 2.4), (0, 1, 0), 40, (0.0, 3.0, 8.0)),
    "cabin": View((2.6, 0.35, 0.0), (6.0, 0.0, 0.1), (0, 1, 0), 60, (4.0, 0.7, 0.0)),
}
"""The four of the slides' table, by name."""


def triangles(size: int) -> int:
    """How many the airframe of that size has: exactly, and `size` less 7 to 0 where that is enough for all parts."""
    bays = _bays(size)
    return _without_rivets(bays) + RIVET * _rivets(size, bays)


def airframe(size: int) -> Scene:
    """As many as `triangles` says, half of them rivets; seen as a whole."""
    bays = _bays(size)
    parts = (_skin(bays), _ribs(bays), _pipes(bays), _cables(bays), _seats(bays), _wings(bays), _engines(bays))
    return Scene(joined(*parts, _cockpit(bays), _riveted(bays, _rivets(size, bays))), VIEWS["whole"])


def _bays(size: int) -> int:
    """Between ribs: as many as leave half of the triangles for rivets, and one at least."""
    return next(bays for bays in count(1) if 2 * _without_rivets(bays + 1) > size)


def _rivets(size: int, bays: int) -> int:
    return max(1, (size - _without_rivets(bays)) // RIVET)


def _without_rivets(bays: int) -> int:
    skin, ribs, pipes, cables = 24 * bays**2, 384 * bays, 32 * bays**2, 96 * bays**2
    seats, wings, cockpit = SEATS * 304 * bays, 32 * bays**2, 12 * bays * (bays + 1)
    engines = 2 * (4 * bays**2 + 12 * (bays + 3) * (bays // 4 + 1) + 288 * bays)
    return skin + ribs + pipes + cables + seats + wings + engines + cockpit


def radius(x: ArrayLike) -> NDArray[np.float64]:
    """Of the fuselage: round at the nose, a cone at the tail."""
    place = np.asarray(x, np.float64)
    nose = np.sqrt(np.maximum(0.0, 1 - np.maximum(0.0, 1 - place / 1.6) ** 2))
    tail = 1 - 0.85 * np.maximum(0.0, (place - 8.5) / (LENGTH - 8.5))
    wide: NDArray[np.float64] = np.maximum(0.02, np.minimum(nose, tail))
    return wide


def _around(x: NDArray[np.float64], angle: NDArray[np.float64], scale: float = 1.0) -> NDArray[np.float64]:
    """Points of the skin, or of a smaller one: (..., 3)."""
    out = scale * radius(x)
    return np.stack([x + 0 * angle, out * np.cos(angle), out * np.sin(angle)], axis=-1)


def _panels(points: NDArray[np.float64]) -> Shape:
    """2 a panel, from a grid (rows + 1, columns + 1, 3): each has its own corners, and stands a little apart."""
    corners = np.stack([points[:-1, :-1], points[:-1, 1:], points[1:, :-1], points[1:, 1:]], axis=2).reshape(-1, 4, 3)
    middle = corners.mean(axis=1, keepdims=True)
    corners = middle + 0.97 * (corners - middle)
    first = 4 * np.arange(len(corners), dtype=np.uint32)[:, None]
    return shape(corners, np.hstack([first, first + 1, first + 2, first + 2, first + 1, first + 3]))


def _skin(bays: int) -> Shape:
    """24 bays²: panels, two a bay and six times as many around."""
    x, angle = np.linspace(0, LENGTH, 2 * bays + 1), np.linspace(0, 2 * np.pi, 6 * bays + 1)
    return _panels(_around(x[:, None], angle[None]))


def _stations(bays: int) -> NDArray[np.float64]:
    """(bays,) the middles of the bays along the fuselage, clear of both ends."""
    return 0.5 + (LENGTH - 1.5) * (np.arange(bays) + 0.5) / bays


def _ribs(bays: int) -> Shape:
    """384 a bay: rings under the skin."""
    x = _stations(bays)
    out = 0.96 * radius(x)
    turned = along([1.0, 0, 0])
    return copies(ring(4, 48, 0.012), out[:, None, None] * turned, np.stack([x, 0 * x, 0 * x], axis=1))


def _pipes(bays: int) -> Shape:
    """32 bays²: straight pieces of eight sides below the floor and above the ceiling, two times `bays` a bay."""
    rng = np.random.default_rng(41)
    x, row = np.repeat(_stations(bays), 2 * bays), np.tile(np.arange(2 * bays), bays)
    side = np.where(row % 2 == 0, -1.0, 1.0)
    fixed = rng.random((2, 2 * bays))
    height = side * (0.62 + 0.22 * fixed[0, row]) * radius(x)
    across = (fixed[1, row] - 0.5) * 0.9 * radius(x)
    thick = np.tile(0.25 / bays * (0.3 + 0.7 * rng.random(2 * bays)), bays)
    length = np.full(len(x), 0.98 * (LENGTH - 1.5) / bays)
    size = np.stack([thick, length, thick], axis=1)
    turned = along([1.0, 0, 0])[0] * size[:, None, :]
    return copies(tube(8), turned, np.stack([x - 0.5 * length, height, across], axis=1))


def _cables(bays: int) -> Shape:
    """96 bays²: each hangs through from one rib to the next, twelve pieces of four sides, `bays` a bay."""
    rng = np.random.default_rng(43)
    x, angle = np.repeat(_stations(bays), bays), rng.random(bays * bays) * 2 * np.pi
    along_it = np.linspace(-0.5, 0.5, 13)
    step = (LENGTH - 1.5) / bays
    places = x[:, None] + step * along_it
    out = 0.9 * radius(places) - 0.25 * step * (0.25 - along_it**2) * (1 + rng.random((bays * bays, 1)))
    spine = np.stack([places, out * np.cos(angle)[:, None], out * np.sin(angle)[:, None]], axis=2)
    thin = 0.08 * step / bays**0.5
    turn = np.arange(5) * np.pi / 2
    around = thin * np.stack([0 * turn, np.cos(turn), np.sin(turn)], axis=1)
    points = spine[:, :, None] + around
    first = (np.arange(bays * bays, dtype=np.uint32) * np.uint32(13 * 5))[:, None, None]
    corner = (np.arange(12, dtype=np.uint32)[:, None] * np.uint32(5) + np.arange(4, dtype=np.uint32)).reshape(-1, 1)
    quad = np.hstack([corner, corner + 1, corner + 5, corner + 5, corner + 1, corner + 6]).astype(np.uint32)
    return shape(points, first + quad)


def _seats(bays: int) -> Shape:
    """304 a seat, six in a row, a row a bay: legs, arms and frame of boxes, two cushions."""
    sizes = [[0.03, 0.1, 0.1], [0.03, 0.1, 0.1], [0.1, 0.015, 0.01], [0.1, 0.015, 0.01]]
    legs = scaled(box(), sizes, [[0, -0.1, 0], [0.1, 0.1, 0], [0, 0.08, -0.11], [0, 0.08, 0.11]])
    cushions = scaled(sphere(2), [[0.11, 0.04, 0.1], [0.035, 0.17, 0.1]], [[0, 0.02, 0], [0.12, 0.2, 0]])
    seat = joined(legs, cushions)
    x = np.repeat(2.8 + 5.7 * (np.arange(bays) + 0.5) / bays, SEATS)
    z = np.tile([-0.72, -0.47, -0.22, 0.22, 0.47, 0.72], bays)
    # Rows closer than a seat is deep have seats that are as much smaller.
    small = min(1.0, 5.7 / bays / 0.3)
    return scaled(seat, np.full(len(x), small), np.stack([x, np.full(len(x), -0.35), z], axis=1))


def _wings(bays: int) -> Shape:
    """32 bays²: panels above and below, on both sides."""
    (front, root), (tip, out) = WING
    along_it, across = np.linspace(0, 1, 2 * bays + 1)[:, None], np.linspace(0, 1, 2 * bays + 1)[None]
    chord = 2.4 - 1.7 * along_it
    x = front + (tip - front) * along_it + chord * across
    thick = 0.13 * chord * np.sqrt(across) * (1 - across) * 2
    parts = []
    for side in (1.0, -1.0):
        z = side * (root - 0.3 + (out - root + 0.3) * along_it) + 0 * across
        parts += [_panels(np.stack([x, -0.35 + 0.12 * abs(z) + up * thick, z], axis=2)) for up in (1.0, -1.0)]
    return joined(*parts)


def _engines(bays: int) -> Shape:
    """2 (4 bays² + 12 (bays + 3) (bays // 4 + 1) + 288 bays): nacelles, stages of blades, and pipes around them."""
    stages, blades = bays // 4 + 1, bays + 3
    x, angle = np.linspace(-0.1, 1.3, bays + 1)[:, None], np.linspace(0, 2 * np.pi, 2 * bays + 1)[None]
    out = 0.42 - 0.12 * np.maximum(0, x - 0.6) + 0 * angle
    nacelle = _panels(np.stack([x + 0 * angle, out * np.cos(angle), out * np.sin(angle)], axis=2))
    turn = np.tile(np.arange(blades) * 2 * np.pi / blades, stages)
    stage = np.repeat(np.arange(stages), blades)
    length = 0.36 * 0.75 ** (stage * 4 / stages)
    outward = np.stack([0 * turn, np.cos(turn), np.sin(turn)], axis=1)
    size = np.stack([np.full(len(turn), 0.3 / blades), 0.4 * length, np.full(len(turn), 0.02)], axis=1)
    place = np.stack([stage / stages, 0 * turn, 0 * turn], axis=1) + 0.55 * length[:, None] * outward
    fan = copies(box(), along(outward) * size[:, None, :], place)
    rings = np.linspace(0.1, 1.2, bays)
    wide = 0.4 - 0.12 * np.maximum(0, rings - 0.6)
    turned = wide[:, None, None] * along([1.0, 0, 0])
    pipes = copies(ring(6, 24, 0.15 / bays), turned, np.stack([rings, 0 * rings, 0 * rings], axis=1))
    engine = joined(nacelle, fan, pipes)
    return copies(engine, np.eye(3), ENGINES)


def _cockpit(bays: int) -> Shape:
    """12 bays (bays + 1): knobs and switches on the panel before the pilots."""
    row, column = (grid.ravel() for grid in np.mgrid[0:bays, 0 : bays + 1])
    height = -0.25 + 0.35 * (row + 0.5) / bays
    place = np.stack([0.75 - 0.25 * height, height, 0.9 * ((column + 0.5) / (bays + 1) - 0.5)], axis=1)
    large = 0.3 * 0.35 / bays
    rng = np.random.default_rng(47)
    return scaled(box(), large * (0.4 + 0.6 * rng.random((len(place), 3))), place)


def _riveted(bays: int, rivets: int) -> Shape:
    """8 a rivet: in rows around the skin."""
    rows = 2 * bays + 1
    row = np.arange(rivets) % rows
    around = max(1, -(-rivets // rows))
    x = LENGTH * (0.04 + 0.95 * row / rows)
    angle = 2 * np.pi * (np.arange(rivets) // rows + 0.5 * (row % 2)) / around
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    # A third of the way to the next one.
    large = min(0.02, np.pi / around / 1.5)
    return scaled(shape(points, faces), np.full(rivets, large), _around(x, angle, 1.002))
