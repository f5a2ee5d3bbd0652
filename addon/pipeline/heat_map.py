"""The cost pass as a picture: a colour for how many nodes and triangles each pixel took, and a legend."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .cost_map import MOST, ramp
from .overlay_legend import SWATCH, fitted, panel_of
from .overlay_picture import freest_corner

STEPS = 5
"""Colours in the legend."""


def draw(cost: NDArray[np.float32], caption: Mapping[str, str]) -> NDArray[np.uint8]:
    """The cost pass (H, W, 2) as sRGB (H, W, 3), its first row at the bottom, with a legend where there is least to
    see. UserError where OpenImageIO is missing."""
    picture = colours(cost)
    height, width = picture.shape[:2]
    panel = fitted(panel_of(_entries(cost, caption)), width, height)[::-1]
    least = cost.sum(axis=2) <= np.median(cost.sum(axis=2))
    picture[freest_corner(~least, panel.shape[0], panel.shape[1])] = panel
    finished: NDArray[np.uint8] = (np.clip(picture, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    return finished


def colours(cost: NDArray[np.float32]) -> NDArray[np.float64]:
    """(H, W, 3) sRGB, from no work to the `most` of `scale`."""
    return ramp(cost.sum(axis=2) / scale(cost))


def scale(cost: NDArray[np.float32]) -> float:
    """The nodes and triangles together that have the last colour: at least 1."""
    return max(1.0, float(np.quantile(cost.sum(axis=2), MOST)))


def legend_texts(cost: NDArray[np.float32], caption: Mapping[str, str]) -> list[str]:
    """The lines of the legend."""
    return [text for _, text in _entries(cost, caption)]


def _entries(cost: NDArray[np.float32], caption: Mapping[str, str]) -> list[tuple[NDArray[np.float32] | None, str]]:
    most = scale(cost)
    shares = np.linspace(0.0, 1.0, STEPS)
    swatches = [np.broadcast_to(ramp(share), (*SWATCH, 3)).astype(np.float32) for share in shares]
    steps = [f"{share * most:,.0f}" for share in shares]
    nodes, tests = (cost[..., channel] for channel in (0, 1))
    return [
        (None, "Work of a camera ray: nodes and triangles"),
        *zip(swatches, [*steps[:-1], f"{steps[-1]} and more"], strict=True),
        (None, f"nodes visited: {nodes.mean():,.1f} on average, {nodes.max():,.0f} at most"),
        (None, f"triangles tested: {tests.mean():,.1f} on average, {tests.max():,.0f} at most"),
        *((None, f"{name}: {value}") for name, value in caption.items()),
    ]
