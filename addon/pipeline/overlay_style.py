"""What each kind of line and face looks like, for the picture and its legend alike.

Blue, crimson and amber stay apart for the three kinds of colour blindness (Machado, Oliveira, Fernandes 2009: colour
differences of at least 39 in CIELAB); the purple of the overlap does not from blue, so it is hatched. Blue and crimson
through each other give that purple. Green are the boxes of nodes not yet subdivided, on top of all. The deeper a node,
the thinner and paler: the eye reads the tree from the root.
"""

from __future__ import annotations

import numpy as np

from .overlay import Kind

Colour = tuple[float, float, float]

COLOURS: dict[Kind, Colour] = {
    Kind.BOX: (0.10, 0.10, 0.10),
    Kind.LEAF_BOX: (0.85, 0.62, 0.00),
    Kind.RIGHT: (0.85, 0.06, 0.30),
    Kind.LEFT: (0.05, 0.42, 0.90),
    Kind.OVERLAP: (0.45, 0.12, 0.62),
    Kind.UNBUILT_BOX: (0.00, 0.62, 0.45),
}
"""sRGB in [0, 1]. Colours are mixed as sRGB, too: the overlay is a drawing, not light."""

VIEWPORT_COLOURS: dict[Kind, Colour] = {
    Kind.BOX: (0.86, 0.86, 0.86),
    Kind.LEAF_BOX: (1.00, 0.76, 0.10),
    Kind.RIGHT: (1.00, 0.22, 0.42),
    Kind.LEFT: (0.22, 0.60, 1.00),
    Kind.OVERLAP: (0.72, 0.35, 0.95),
    Kind.UNBUILT_BOX: (0.10, 0.85, 0.60),
}
"""The same hues on the dark grey of Blender's 3D viewport, where black lines would not be seen."""

RAY_COLOUR: Colour = (1.0, 1.0, 0.35)
SELECTED_COLOUR: Colour = (1.0, 1.0, 1.0)

LEAST_OPACITY = 0.4
"""Of a line in a viewport: there, deep levels are looked at alone."""

PAPER = 0.9
"""Scene-linear grey behind the traced picture where nothing was hit."""

FADE = 0.3
"""How much white the traced picture is mixed with, so that black lines are seen on black surfaces."""

LEVELS = 12
"""Nodes at depth LEVELS - 1 and deeper look the same."""

HIDDEN = 0.22
"""Opacity of a line behind the surface, relative to one in front of it."""

DESIGN_SIZE = (960, 720)
"""Widths are in pixels of a picture of this width and height."""

HATCH_PERIOD, HATCH_WIDTH, LEAST_HATCH_PERIOD = 6.0, 2.5, 4.0
"""The last in pixels of any picture: finer stripes would be a tint."""

FACE_OPACITY = {
    Kind.LEFT: 0.16 * 0.5 ** np.arange(LEVELS),
    Kind.RIGHT: 0.16 * 0.5 ** np.arange(LEVELS),
    Kind.OVERLAP: 0.5 * 0.5 ** np.arange(LEVELS),
}
"""Of one face, by depth."""

FACE_LEVELS = 8
"""Faces of nodes at this depth and deeper are not filled: 8 bits a channel show no opacity below 1/510."""


def line_width(kind: Kind, depth: int) -> float:
    """Pixels of a picture of DESIGN_SIZE."""
    if kind is Kind.UNBUILT_BOX:
        return 2.0
    width = max(2.4 * 0.78**depth, 0.5)
    return width if kind in (Kind.LEFT, Kind.RIGHT) else 0.75 * width


def line_rank(kind: Kind, depth: int) -> int:
    """Lines of a lower rank lie on top: those nearer the root, and at one depth the clip planes.

    All edges of a box but the root's lie on edges of clip planes above it. Leaves go before the planes two levels up,
    or they would never be seen. Nodes not yet subdivided lie on top of all: they are what is missing.
    """
    if kind is Kind.UNBUILT_BOX:
        return -1
    ahead = {Kind.LEFT: 0, Kind.RIGHT: 1, Kind.BOX: 2, Kind.LEAF_BOX: -8}
    return 4 * depth + ahead[kind]


def line_opacity(kind: Kind, depth: int) -> float:
    """Leaves fade less: they are where the triangles are, and the last to be reached; the unbuilt do not fade."""
    if kind is Kind.UNBUILT_BOX:
        return 0.95
    return max(0.95 * 0.8**depth, 0.35 if kind is Kind.LEAF_BOX else 0.15)
