"""Every kind of tree that a test of "a tree" runs over."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import bihtree
import pytest
from numpy.typing import ArrayLike

OWN = {"bih": ("wide", "global"), "kd_tree": ("classic", "sah"), "bvh": ("wide", "sah")}
"""The layout and the heuristic of each structure where none is chosen."""


@dataclass(frozen=True)
class Variant:
    """Options of bihtree.Tree under one name."""

    name: str
    options: dict[str, Any] = field(default_factory=dict)

    def tree(self, vertices: ArrayLike, triangles: ArrayLike | None = None, **options: Any) -> bihtree.Tree:
        """A tree with this variant's options, and the test's own on top."""
        return bihtree.Tree(vertices, triangles, **{**self.options, **options})

    @property
    def structure(self) -> str:
        return str(self.options.get("structure", "bih"))

    @property
    def layout(self) -> str:
        return str(self.options.get("layout", OWN[self.structure][0]))

    @property
    def heuristic(self) -> str:
        return str(self.options.get("heuristic", OWN[self.structure][1]))

    @property
    def precision(self) -> str:
        return str(self.options.get("precision", "watertight"))

    def __str__(self) -> str:
        return self.name


VARIANTS = (
    Variant("default"),
    Variant("one-thread", {"threads": 1}),
    Variant("presorted", {"presort": True, "threads": 5}),
    Variant("classic", {"layout": "classic", "threads": 2}),
    Variant("classic-leaf-1", {"layout": "classic", "leaf_size": 1, "threads": 1}),
    Variant("classic-local", {"layout": "classic", "heuristic": "local", "threads": 2}),
    Variant("classic-leaf-64", {"layout": "classic", "leaf_size": 64}),
    Variant("compact", {"layout": "compact", "threads": 2}),
    Variant("leaf-3-sah", {"leaf_size": 3, "heuristic": "sah", "threads": 3}),
    Variant("on-demand", {"build": "on_demand"}),
    Variant("on-demand-classic-sah", {"layout": "classic", "build": "on_demand", "heuristic": "sah", "threads": 3}),
    Variant("on-demand-compact-local", {"layout": "compact", "build": "on_demand", "heuristic": "local"}),
    Variant("kd_tree", {"structure": "kd_tree", "threads": 2}),
    Variant("bvh", {"structure": "bvh"}),
    Variant("bvh-compact-leaf-3", {"structure": "bvh", "layout": "compact", "leaf_size": 3, "threads": 3}),
    Variant("exact", {"precision": "exact"}),
    Variant("exact-classic-leaf-1", {"precision": "exact", "layout": "classic", "leaf_size": 1, "threads": 1}),
    Variant("exact-leaf-3-sah", {"precision": "exact", "leaf_size": 3, "heuristic": "sah", "threads": 3}),
    Variant("exact-compact-local", {"precision": "exact", "layout": "compact", "heuristic": "local", "threads": 2}),
    Variant("exact-on-demand", {"precision": "exact", "build": "on_demand", "threads": 2}),
    Variant("exact-kd_tree", {"precision": "exact", "structure": "kd_tree"}),
    Variant("exact-bvh", {"precision": "exact", "structure": "bvh", "threads": 2}),
)

# Their answers are float32's: they have tests of their own, and those that compare them with themselves.
FAST_VARIANTS = (
    Variant("fast", {"precision": "fast"}),
    Variant("fast-leaf-3", {"precision": "fast", "leaf_size": 3, "threads": 3}),
    Variant("fast-on-demand", {"precision": "fast", "build": "on_demand"}),
    Variant("fast-classic", {"layout": "classic", "precision": "fast"}),
    Variant("fast-kd_tree", {"structure": "kd_tree", "precision": "fast"}),
    Variant("fast-bvh", {"structure": "bvh", "precision": "fast", "threads": 2}),
)

STRESS = bool(os.environ.get("BIHTREE_STRESS"))
"""Set by `make stress`: all that is short otherwise is long."""

# Each structure, presorted and on demand, in each precision that is true; one thread and many.
SOME = {"one-thread", "presorted", "on-demand", "kd_tree", "bvh"}
SOME |= {"exact", "exact-classic-leaf-1", "exact-on-demand", "exact-kd_tree", "exact-bvh"}
MANY_RAYS_VARIANTS = VARIANTS if STRESS else tuple(variant for variant in VARIANTS if variant.name in SOME)

HIERARCHIES = tuple(variant for variant in VARIANTS if variant.structure == "bih")
EXACT = tuple(variant for variant in VARIANTS if variant.precision == "exact")
GLOBAL = tuple(variant for variant in HIERARCHIES if variant.heuristic == "global")
KD_TREES = tuple(variant for variant in VARIANTS if variant.structure == "kd_tree")
BVHS = tuple(variant for variant in VARIANTS if variant.structure == "bvh")

# A kd-tree may refer to a triangle several times, and its size is not known before.
ONE_REFERENCE = HIERARCHIES + BVHS

every_tree = pytest.mark.parametrize("variant", VARIANTS, ids=str)
every_hierarchy = pytest.mark.parametrize("variant", HIERARCHIES, ids=str)
every_kd_tree = pytest.mark.parametrize("variant", KD_TREES, ids=str)
every_bvh = pytest.mark.parametrize("variant", BVHS, ids=str)
every_tree_of_one_reference = pytest.mark.parametrize("variant", ONE_REFERENCE, ids=str)
every_tree_of_many_rays = pytest.mark.parametrize("variant", MANY_RAYS_VARIANTS, ids=str)
every_precision = pytest.mark.parametrize("variant", VARIANTS + FAST_VARIANTS, ids=str)
every_exact_tree = pytest.mark.parametrize("variant", EXACT, ids=str)
every_fast_tree = pytest.mark.parametrize("variant", FAST_VARIANTS, ids=str)
