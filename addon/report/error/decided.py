"""What it took to decide the tests of rays against triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MEANS = ("single precision", "double precision", "sums of two doubles", "whole numbers", "big integers")
"""As in the columns of `bihtree.Tree.decision_cost`: each leaves something over to the next."""


@dataclass(frozen=True)
class Decided:
    """Of rays of one kind."""

    tests_a_ray: float
    tests: dict[str, float]
    """The share of all tests that each means decided."""
    rays: dict[str, float]
    """The share of rays with a test that came to it."""


def decided(counts: NDArray[np.int32]) -> Decided:
    """Of the counts of some rays, a row each."""
    left = np.append(counts.sum(axis=0, dtype=np.int64), 0)
    # Where single precision has no room for a ray, its tests begin with double precision.
    left[0] = np.where(counts[:, 0] > 0, counts[:, 0], counts[:, 1]).sum(dtype=np.int64)
    tests, rays = max(1, int(left[0])), max(1, len(counts))
    return Decided(
        int(left[0]) / rays,
        {means: int(count) / tests for means, count in zip(MEANS, left[:-1] - left[1:], strict=True)},
        {means: int(count) / rays for means, count in zip(MEANS, (counts > 0).sum(axis=0), strict=True)},
    )
