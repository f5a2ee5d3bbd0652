"""What each kind of line and face looks like, for the picture and its legend alike.

Blue, crimson and amber stay apart for the three kinds of colour blindness (Machado, Oliveira, Fernandes 2009: colour
differences of at least 39 in CIELAB); the purple of the overlap does not from blue, so it is hatched. Blue and crimson
through each other give that purple. The deeper a node, the thinner and paler: the eye reads the tree from the root.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .overlay import Kind

Colour = tuple[float, float, float]

COLOURS: dict[Kind, Colour] = {
    Kind.BOX: (0.10, 0.10, 0.10),
    Kind.LEAF_BOX: (0.85, 0.62, 0.00),
    Kind.RIGHT: (0.85, 0.06, 0.30),
    Kind.LEFT: (0.05, 0.42, 0.90),
    Kind.OVERLAP: (0.45, 0.12, 0.62),
}
"""sRGB in [0, 1]. Colours are mixed as sRGB, too: the overlay is a drawing, not light."""

PAPER = 0.9
"""Scene-linear grey behind the traced picture where nothing was hit."""

FADE = 0.3
"""How much white the traced picture is mixed with, so that black lines are seen on black surfaces."""

LEVELS = 12
"""Nodes at depth LEVELS - 1 and deeper look the same."""

HIDDEN = 0.22
"""Opacity of a line behind the surface, relative to one in front of it."""

DESIGN_HEIGHT = 720
"""Widths are in pixels of a picture of this height."""

HATCH_PERIOD, HATCH_WIDTH = 6.0, 2.5

FACE_OPACITY = {Kind.LEFT: 0.16, Kind.RIGHT: 0.16, Kind.OVERLAP: 0.55}


def line_width(kind: Kind, depth: int) -> float:
    """Pixels at DESIGN_HEIGHT."""
    width = max(2.4 * 0.78**depth, 0.5)
    return width if kind in (Kind.LEFT, Kind.RIGHT) else 0.75 * width


def line_opacity(depth: int) -> float:
    return max(0.95 * 0.8**depth, 0.15)


def face_opacity(kind: Kind) -> NDArray[np.float64]:
    """Of one face at each depth below LEVELS; 0 where 8 bits a channel could not show it."""
    opacity = FACE_OPACITY[kind] * 0.5 ** np.arange(LEVELS)
    return np.where(opacity < 0.5 / 255.0, 0.0, opacity)
