"""Who is measured. A side is a structure and how it is built; after @ stands how it is called (benchmarks/README.md).

The place to add one: the harness leaves out what it does not know, so that a name may stand here before it is built.
"""

from __future__ import annotations

DEFAULT = "bih/wide/fast"
LOCAL = "bih/wide/fast/local"
SAH = "bih/wide/fast/sah"
COMPACT = "bih/compact/fast"
CLASSIC = "bih/classic"
BVH = "bvh/wide/fast"
KD_TREE = "kd_tree"
WATERTIGHT = "bih/wide/watertight"
EXACT = "bih/wide/exact"

LOW = "embree/low"
MEDIUM = "embree/medium"
HIGH = "embree/high"
ROBUST = "embree/medium/robust"
SMALL = "embree/medium/compact"

PRECISION_NAMES = ("fast", "watertight", "exact")

OBVHS = ("obvhs/bvh2/fastest", "obvhs/bvh2/medium")

BUILDS = (DEFAULT, LOCAL, SAH, COMPACT, CLASSIC, BVH, LOW, MEDIUM, HIGH, ROBUST, SMALL, *OBVHS)
"""Whose construction is timed. A kd-tree's would leave no time for rounds: it is in the slides' tables."""

ALL_CALLS = ("1", "8", "16", "8c", "16c")

PACKED = (LOW, HIGH, ROBUST, SMALL)
"""Embree's other ways to build, each traced in the two ways that suit the rays best."""


def traces(kind: str) -> tuple[str, ...]:
    """What is traced on two threads. Packets are told to be coherent where they are; elsewhere that slows them down."""
    is_coherent = kind in {"primary", "shadow"}
    packet = "16c" if is_coherent else "16"
    return (
        *(DEFAULT, f"{DEFAULT}@1", LOCAL, SAH, f"{SAH}@1", COMPACT, WATERTIGHT, BVH),
        *(f"{MEDIUM}@{call}" for call in (("1", "16", "8c", "16c") if is_coherent else ("1", "8", "16"))),
        *(f"{side}@{call}" for side in PACKED for call in ("1", packet)),
        "obvhs/bvh2/fastest",
    )


def traces_alone(kind: str) -> tuple[str, ...]:
    """And on one thread."""
    packet = "16c" if kind in {"primary", "shadow"} else "16"
    return (DEFAULT, f"{DEFAULT}@1", SAH, f"{SAH}@1", f"{MEDIUM}@1", f"{MEDIUM}@{packet}")


PRECISIONS = tuple(f"bih/wide/{precision}{way}@flight" for way in ("", "/sah") for precision in PRECISION_NAMES)
"""Each precision, in flight."""

IMAGES = (LOW, MEDIUM, HIGH, DEFAULT, SAH)
"""Who takes pictures; the first one's is what the others are compared with."""

COSTS = (DEFAULT, LOCAL, SAH, COMPACT, CLASSIC, BVH, KD_TREE)
"""Whose steps are counted."""

PEERS = (LOW, MEDIUM, HIGH, ROBUST, SMALL)


def side_of(call: str) -> str:
    """The side of a call, such as embree/medium of embree/medium@16c."""
    return call.partition("@")[0]
