"""Every kind of tree that a test of "a tree" runs over."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bihtree
import pytest
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Variant:
    """Options of bihtree.Tree under one name."""

    name: str
    options: dict[str, Any] = field(default_factory=dict)

    def tree(self, vertices: ArrayLike, triangles: ArrayLike | None = None, **options: Any) -> bihtree.Tree:
        """A tree with this variant's options, and the test's own on top."""
        return bihtree.Tree(vertices, triangles, **{**self.options, **options})

    def __str__(self) -> str:
        return self.name


VARIANTS = (
    Variant("default"),
    Variant("one-thread", {"threads": 1}),
    Variant("leaf-1", {"leaf_size": 1, "threads": 2}),
    Variant("leaf-8-presorted", {"leaf_size": 8, "presort": True, "threads": 5}),
    Variant("local", {"heuristic": "local", "threads": 2}),
    Variant("leaf-64", {"leaf_size": 64, "threads": 1}),
    Variant("wide", {"layout": "wide"}),
    Variant("compact", {"layout": "compact", "threads": 2}),
    Variant("on-demand", {"layout": "wide", "build": "on_demand"}),
    Variant("on-demand-classic-sah", {"build": "on_demand", "heuristic": "sah", "threads": 3}),
    Variant("on-demand-compact-local", {"layout": "compact", "build": "on_demand", "heuristic": "local"}),
    Variant("wide-leaf-3-sah", {"layout": "wide", "leaf_size": 3, "heuristic": "sah", "threads": 3}),
)

# Their answers are float32's: they have tests of their own, and those that compare them with themselves.
FAST_VARIANTS = (
    Variant("fast", {"layout": "wide", "precision": "fast"}),
    Variant("fast-leaf-3", {"layout": "wide", "precision": "fast", "leaf_size": 3, "threads": 3}),
    Variant("fast-on-demand", {"layout": "wide", "precision": "fast", "build": "on_demand"}),
    Variant("fast-classic", {"layout": "classic", "precision": "fast"}),
)

GLOBAL = tuple(variant for variant in VARIANTS if "heuristic" not in variant.options)

every_tree = pytest.mark.parametrize("variant", VARIANTS, ids=str)
every_fast_tree = pytest.mark.parametrize("variant", FAST_VARIANTS, ids=str)
