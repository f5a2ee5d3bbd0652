"""Everything a person can choose, in one object, checked once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from .errors import UserError

STRUCTURES = ("bih", "bvh", "kd_tree")
LAYOUTS = ("wide", "compact", "classic")
HEURISTICS = ("global", "local", "sah")
PRECISIONS = ("watertight", "exact", "fast")
LARGEST_SIDE = 65536
"""Most pixels a side of a picture, as bihtree.Camera has it."""
DEFAULT_PASSES = ("combined", "depth", "normal", "position", "triangle", "cost")
PASSES = (*DEFAULT_PASSES, "instance", "object_index", "material_index")
"""New ones are put last: Blender saves the choice by their places."""
SHADINGS = ("lights", "headlight")
SHADING = ("shading", "shadows", "soft_shadows", "ambient_occlusion", "ambient_occlusion_distance", "smooth")
"""The settings that say how what is seen is lit."""
PARTS = (
    *("bucket sort", "on demand", "double precision", "normals", "smooth normals", "materials"),
    *("shadow rays", "ambient occlusion", "lights without power"),
    *("objects out of reach", "instances", "tree", "threads", "world transform"),
    *(f"{name} pass" for name in PASSES),
)
"""What a scene may do without; addon/pipeline/needs.py decides."""
GOES_WITH: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "bih": {"layout": LAYOUTS, "heuristic": HEURISTICS},
    "bvh": {"layout": ("wide", "compact"), "heuristic": ("sah",)},
    "kd_tree": {"layout": ("classic",), "heuristic": ("sah",)},
}
"""The choices that each structure has, its own first."""


@dataclass(frozen=True)
class Settings:
    """The measured reason of each default is in docs/decisions."""

    structure: str = "bih"
    layout: str = "wide"
    heuristic: str = "global"
    precision: str = "watertight"
    leaf_size: int | None = None
    threads: int = 0
    passes: tuple[str, ...] = DEFAULT_PASSES
    samples: int = 1
    seed: int = 0
    shading: str = "lights"
    """The scene's own lights, or a headlight; a scene without lights has a headlight."""
    shadows: bool = True
    soft_shadows: bool = False
    ambient_occlusion: bool = False
    ambient_occlusion_distance: float | None = None
    """In units of the scene; None: without end."""
    smooth: bool = True
    """Whether normals between those of the corners are shaded by, where a mesh has them."""
    overlay_depth: int = 6
    parts: Mapping[str, bool] = field(default_factory=lambda: MappingProxyType({}))
    """True keeps a part, False leaves it out wherever the picture stays the same; others are decided by the scene."""

    def __post_init__(self) -> None:
        _one_of("structure", self.structure, STRUCTURES)
        _one_of("layout", self.layout, LAYOUTS)
        _one_of("heuristic", self.heuristic, HEURISTICS)
        _one_of("precision", self.precision, PRECISIONS)
        _one_of("shading", self.shading, SHADINGS)
        if self.ambient_occlusion_distance is not None and not self.ambient_occlusion_distance > 0:
            what = f"ambient occlusion distance is {self.ambient_occlusion_distance}; it must be above 0"
            raise UserError(what, exit_status=2)
        for name in self.passes:
            _one_of("pass", name, PASSES)
        if not self.passes:
            raise UserError(f"no pass asked for; choose from {', '.join(PASSES)}", exit_status=2)
        for name in self.parts:
            _one_of("part", name, PARTS)
        self._check_what_goes_together()
        _at_least("leaf size", 1 if self.leaf_size is None else self.leaf_size, 1)
        _at_least("threads", self.threads, 0)
        _at_least("samples", self.samples, 1)
        _at_least("seed", self.seed, 0)
        _at_least("overlay depth", self.overlay_depth, 0)

    def _check_what_goes_together(self) -> None:
        for name, known in GOES_WITH[self.structure].items():
            if getattr(self, name) not in known:
                _apart(f"structure {self.structure}", f"{name} {getattr(self, name)}", f"choose {' or '.join(known)}")
        if self.structure != "bih" and self.parts.get("on demand"):
            _apart(f"structure {self.structure}", "build on demand", "only a bih is built where rays go")
        if self.heuristic != "global" and self.parts.get("bucket sort"):
            _apart(f"heuristic {self.heuristic}", "the bucket sort", "it sorts by the cells of the global heuristic")
        if self.structure == "kd_tree" and self.leaf_size is not None:
            _apart("structure kd_tree", "a leaf size", "its heuristic ends where no split is cheaper")


def _one_of(what: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise UserError(f"unknown {what} {value!r}; choose from {', '.join(known)}", exit_status=2)


def _apart(one: str, other: str, what: str) -> None:
    raise UserError(f"{one} does not go with {other}: {what}", exit_status=2)


def _at_least(what: str, value: int, least: int) -> None:
    if value < least:
        raise UserError(f"{what} is {value}; it must be at least {least}", exit_status=2)
