"""Closest hits against embreex (robust): every disagreement decided in rational arithmetic.

`python -m tests.native.truth_report [--list] [MESH ...]` from the root of the repository prints the table.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass

import bihtree
import numpy as np
from numpy.typing import NDArray

from tests import rays as make
from tests.agreement import faults
from tests.meshes import Triangles, shared_mesh
from tests.oracle import Oracle
from tests.rays import Rays

MESHES = ("stanford-bunny", "dragon-res3", "cube-40k", "legocar", "thingi-79741", "delft-city", "offset1")
COLUMNS = ("rays", "hits", "disagreements", "ties", "ours_right", "embree_right", "checked")


@dataclass
class Comparison:
    """Counts of one mesh; `lines` names each disagreement, `wrong` each answer of ours that is not the truth.

    ties: disagreements in which two triangles or more are at the same t; checked: agreed rays put to the oracle too.
    """

    mesh: str
    rays: int
    hits: int
    disagreements: int
    ties: int
    ours_right: int
    embree_right: int
    checked: int
    lines: list[str]
    wrong: list[str]

    def counts(self) -> dict[str, int]:
        return {name: asdict(self)[name] for name in COLUMNS}


def hundred_thousand(mesh: Triangles, seed: int = 1) -> Rays:
    """49,304 camera rays, on lattices so that some run through vertices of a regular mesh; 50,696 random ones."""
    rng = np.random.default_rng(seed)
    cameras = make.joined(
        make.pinhole(mesh, 241, 121), make.pinhole(mesh, 61, 61, axis=0), make.parallel(mesh, 161, 102, axis=1)
    )
    count = 100_000 - len(cameras.origins)
    return make.joined(cameras, make.around(mesh, count - 5_000, rng), make.at_features(mesh, 5_000, rng))


def embree_triangles(mesh: Triangles, rays: Rays) -> NDArray[np.int32]:
    """The closest triangle of each ray as embreex has it; -1 for a miss. float32 throughout."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, mesh.vertices, mesh.triangles)
    return np.asarray(scene.run(rays.origins, rays.directions, query="INTERSECT"), np.int32)


def compare(name: str, sample: int = 1000) -> Comparison:
    """100,000 rays on the mesh as float32, all that embreex can see; `sample` agreed rays are decided as well."""
    mesh = shared_mesh(name).astype(np.float32)
    rays = hundred_thousand(mesh)
    oracle = Oracle(*mesh)
    ours = bihtree.Tree(*mesh).intersect(*rays)
    embree = embree_triangles(mesh, rays)
    differ = np.flatnonzero(ours.triangle != embree)
    same = np.random.default_rng(2).choice(np.flatnonzero(ours.triangle == embree), sample, replace=False)
    chosen = np.concatenate([differ, same])
    truth = oracle.decide(rays.origins[chosen], rays.directions[chosen])
    answer, count = truth.triangle[: len(differ)], truth.ties[: len(differ)]
    lines = [
        f"{name} ray {ray}: ours {ours.triangle[ray]}, embree {embree[ray]}, truth {answer[place]} of {count[place]}"
        for place, ray in enumerate(differ.tolist())
    ]
    right, peer_right = (int((triangle[differ] == answer).sum()) for triangle in (ours.triangle, embree))
    wrong = faults(_rows(ours, chosen), truth)
    hit_count = int(ours.hit.sum())
    ties = int((count > 1).sum())
    return Comparison(name, len(embree), hit_count, len(differ), ties, right, peer_right, sample, lines, wrong)


@dataclass
class _Answers:
    """Some rays' rows of Hits."""

    t: NDArray[np.floating]
    triangle: NDArray[np.int32]
    u: NDArray[np.floating]
    v: NDArray[np.floating]
    instance: NDArray[np.int32]


def _rows(hits: bihtree.Hits, rows: NDArray[np.intp]) -> _Answers:
    return _Answers(*(getattr(hits, name)[rows] for name in ("t", "triangle", "u", "v", "instance")))


def main(arguments: list[str]) -> int:
    names = [argument for argument in arguments if argument != "--list"] or MESHES
    print("| mesh |", " | ".join(COLUMNS), "|\n| --- |" + " --- |" * len(COLUMNS))
    wrong = 0
    for name in names:
        result = compare(name)
        print(f"| {name} |", " | ".join(f"{value:,}" for value in result.counts().values()), "|", flush=True)
        for line in result.lines if "--list" in arguments else result.wrong:
            print("   ", line)
        wrong += len(result.wrong)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
