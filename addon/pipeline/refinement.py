"""A picture that gets better while somebody looks: coarse first, then fine, then more samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .camera import CameraView

COARSEST = 8
"""The first picture has an eighth of the pixels a side: a 64th of the rays."""


@dataclass(frozen=True)
class Step:
    """One picture to trace: with 1 / divisor of the pixels a side, by the sample of that number in each."""

    divisor: int
    sample: int = 0


def steps(samples: int, finest: int = 1) -> Iterator[Step]:
    """From an eighth of the resolution to a `finest`-th (or from that one, where it is coarser), then so many samples
    there in all."""
    divisor = COARSEST
    while divisor > finest:
        yield Step(divisor)
        divisor //= 2
    yield from (Step(finest, sample) for sample in range(samples))


def view_of(view: CameraView, step: Step) -> CameraView:
    """The view that `step` is traced with: all of `view` in fewer pixels."""
    width, height = (-(-side // step.divisor) for side in (view.width, view.height))
    return replace(view, width=width, height=height)


class Mean:
    """The mean of the samples of one view; a step of another resolution begins anew."""

    def __init__(self) -> None:
        self._sum: NDArray[np.float64] = np.zeros(0)
        self._divisor = 0

    def with_step(self, step: Step, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
        """(H, W, C): what there is to see after `step`, whose own picture is `pixels`."""
        if step.divisor != self._divisor:
            self._divisor, self._sum = step.divisor, pixels.astype(np.float64)
            return pixels
        self._sum += pixels
        return (self._sum / (step.sample + 1)).astype(np.float32)
