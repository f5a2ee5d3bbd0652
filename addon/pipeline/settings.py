"""Everything a person can choose, in one object, checked once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from .errors import UserError

STRUCTURES = ("bih",)
LAYOUTS = ("wide", "compact", "classic")
PRECISIONS = ("watertight", "exact", "fast")
LARGEST_SIDE = 65536
"""Most pixels a side of a picture, as bihtree.Camera has it."""
PASSES = ("combined", "depth", "normal", "position", "triangle", "cost")
PARTS = (
    *("bucket sort", "on demand", "double precision", "normals", "shadow rays", "lights without power"),
    *("objects out of reach", "tree", "threads", "world transform"),
    *(f"{name} pass" for name in PASSES),
)
"""What a scene may do without; addon/pipeline/needs.py decides."""


@dataclass(frozen=True)
class Settings:
    """The measured reason of each default is in docs/decisions."""

    structure: str = "bih"
    layout: str = "wide"
    precision: str = "watertight"
    leaf_size: int | None = None
    threads: int = 0
    passes: tuple[str, ...] = PASSES
    samples: int = 1
    seed: int = 0
    shadows: bool = True
    overlay_depth: int = 6
    parts: Mapping[str, bool] = field(default_factory=lambda: MappingProxyType({}))
    """True keeps a part, False leaves it out wherever the picture stays the same; others are decided by the scene."""

    def __post_init__(self) -> None:
        _one_of("structure", self.structure, STRUCTURES)
        _one_of("layout", self.layout, LAYOUTS)
        _one_of("precision", self.precision, PRECISIONS)
        for name in self.passes:
            _one_of("pass", name, PASSES)
        if not self.passes:
            raise UserError(f"no pass asked for; choose from {', '.join(PASSES)}", exit_status=2)
        for name in self.parts:
            _one_of("part", name, PARTS)
        _at_least("leaf size", 1 if self.leaf_size is None else self.leaf_size, 1)
        _at_least("threads", self.threads, 0)
        _at_least("samples", self.samples, 1)
        _at_least("seed", self.seed, 0)
        _at_least("overlay depth", self.overlay_depth, 0)


def _one_of(what: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise UserError(f"unknown {what} {value!r}; choose from {', '.join(known)}", exit_status=2)


def _at_least(what: str, value: int, least: int) -> None:
    if value < least:
        raise UserError(f"{what} is {value}; it must be at least {least}", exit_status=2)
