"""A plot as data: what is drawn as SVG for the page and as PNG beside it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, floor, log10

COLOURS = (
    *("#d62728", "#1f77b4", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#17becf"),
    *("#bcbd22", "#ff7f0e", "#c49c00", "#000000", "#5254a3", "#f768a1", "#637939"),
)
MOST_LABELS = 8
FEW_DECADES = 2
"""An axis of so many has labels between its powers of ten."""


@dataclass(frozen=True)
class Point:
    """Both not negative; 0 is drawn on the axis, at `Plot.floors`."""

    x: float
    y: float
    label: str = ""
    is_marked: bool = False


@dataclass(frozen=True)
class Series:
    name: str
    points: tuple[Point, ...]
    colour: str
    is_line: bool = False


@dataclass(frozen=True)
class Plot:
    """Logarithmic on both axes."""

    name: str
    """Of its file, too."""
    title: str
    x_title: str
    y_title: str
    series: tuple[Series, ...]
    x_labels: tuple[tuple[float, str], ...] = ()
    """Where the axis does not go by decades."""

    @property
    def is_empty(self) -> bool:
        return not any(series.points for series in self.series)

    def axis(self, which: str) -> Axis:
        return axis([getattr(point, which) for series in self.series for point in series.points])


@dataclass(frozen=True)
class Axis:
    """A logarithmic one: from `low` to `high`, and where labels stand. Where there are zeros, `low` stands for them."""

    low: float
    high: float
    labels: tuple[tuple[float, str], ...]

    def place(self, value: float) -> float:
        return min(max(value, self.low), self.high)


def axis(values: Iterable[float]) -> Axis:
    """For finite values that are not negative."""
    known = list(values)
    positive = [value for value in known if value > 0]
    first = floor(log10(min(positive))) if positive else 0
    last = max(ceil(log10(max(positive))), first + 1) if positive else 1
    has_zero = len(positive) < len(known)
    step = max(1, ceil((last - first) / MOST_LABELS))
    parts = (1, 2, 5) if last - first <= FEW_DECADES else (1,)
    places = [(part, power) for power in range(first, last + 1, step) for part in parts if part == 1 or power < last]
    labels = [(part * 10.0**power, _label(part, power)) for part, power in places]
    if not has_zero:
        return Axis(10.0**first, 10.0**last, tuple(labels))
    below = 10.0 ** (first - step)
    return Axis(below, 10.0**last, ((below, "0"), *labels))


def _label(part: int, power: int) -> str:
    return f"{part}e{power}" if abs(power) > 3 else f"{part * 10.0**power:g}"


def scatter(
    name: str, title: str, titles: tuple[str, str], points: Sequence[tuple[str, float | None, float | None, bool]]
) -> Plot:
    """A point a method: (name, x, y, on the front); those without numbers are left out. The front is joined."""
    series = []
    front = []
    for number, (label, x, y, is_front) in enumerate(points):
        if x is None or y is None:
            continue
        point = Point(x, y, label if is_front else "", is_front)
        series.append(Series(label, (point,), COLOURS[number % len(COLOURS)]))
        if is_front:
            front.append(Point(x, y))
    if len(front) > 1:
        series.append(Series("Pareto front", tuple(sorted(front, key=lambda p: (p.x, -p.y))), "#888888", is_line=True))
    return Plot(name, title, *titles, tuple(series))
