"""The Pareto front: what no other beats in both axes."""

from __future__ import annotations

from collections.abc import Mapping


def front(points: Mapping[str, tuple[float, float]]) -> set[str]:
    """Names of those that no other is as good as in both numbers and better than in one; less is better."""

    def is_beaten(name: str) -> bool:
        x, y = points[name]
        return any(a <= x and b <= y and (a < x or b < y) for a, b in points.values())

    return {name for name in points if not is_beaten(name)}
