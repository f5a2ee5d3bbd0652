"""The figures of the slides, as printed there: H. Gründl, "BIH (Bounding Interval Hierarchy) Project",
Bauhaus-Universität Weimar, after Wächter and Keller (EGSR 2006). Pentium 4 HT at 2.8 GHz, 640 x 480; the Boeing 777 on
one core of an Opteron 875 at 2.2 GHz, 1280 x 1024."""

from __future__ import annotations

from typing import NamedTuple


class Sorted(NamedTuple):
    """Construction with and without the bucket sort in ms; frame rate with it, in per cent of that without."""

    mesh: str
    triangles: int
    sorted_ms: int
    plain_ms: int
    frame_rate: int


BUCKET_SORT = (
    Sorted("Stanford Buddha", 1_087_716, 765, 1_703, 94),
    Sorted("Stanford Dragon", 871_414, 657, 1_390, 93),
    Sorted("Stanford Thai Statue", 10_000_000, 7_812, 17_484, 94),
)


class Structure(NamedTuple):
    """One column of the comparison: bytes, frames a second, ms; None where the slides have none."""

    name: str
    triangles: int
    triangle_bytes: int
    tree_bytes: int
    frames: float | None
    image_ms: int


SHIRLEY = (
    Structure("InView", 1_380, 66_240, 115_312, 5.02, 199),
    Structure("kd", 804, 28_944, 55_188, 11.17, 89),
    Structure("BIH", 804, 28_944, 12_828, 11.99, 83),
    Structure("on demand", 804, 28_944, 11_972, None, 87),
)
DRAGON = (
    Structure("InView", 863_334, 41_440_032, 26_207_404, 2.49, 44_500),
    Structure("kd", 871_414, 31_370_904, 24_014_264, 5.92, 3_106),
    Structure("BIH", 871_414, 31_370_904, 13_466_176, 5.98, 1_557),
    Structure("on demand", 871_414, 31_370_904, 5_175_936, None, 1_102),
)


class Boeing(NamedTuple):
    """One view: bytes, frames a second, seconds."""

    view: str
    tree_bytes: int
    frames: float
    total_seconds: int


BOEING_TRIANGLES = 349_569_456
BOEING = (
    Boeing("View 1", 326_447_848, 0.26, 480),
    Boeing("View 2", 12_748_120, 0.13, 133),
    Boeing("View 3", 15_471_692, 0.13, 153),
    Boeing("View 4", 259_261_404, 0.38, 270),
)

INNER_NODES_AN_OBJECT = 6
"""At most, by the slides' conclusion."""
