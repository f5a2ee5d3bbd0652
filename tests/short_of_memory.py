"""Work under ever less of a limit on memory, in a process of its own: `python -m tests.short_of_memory WORK... FOLDER`.

Each work is tried with ever more memory beside what the process has, until it gets through. Whatever comes before must
be an error that says how much was needed; then, with the limit gone, all answers are what they were. Prints how often
each work was refused. A word before it gives it another subject, anew each time: `first-` a tree
on demand, `new-` a tree, `placed-` and `crowd-` a scene. What `true-` answers in the end is proved by the oracle.
"""

from __future__ import annotations

import os
import re
import resource
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import bihtree
import numpy as np
from numpy.typing import NDArray

from tests import meshes
from tests.agreement import Rows, assert_answers, truth_of
from tests.many_rays import BATCH, FEWER_RAYS, at_weak_places
from tests.rays import Rays, around
from tests.variants import FAST_VARIANTS, VARIANTS, Variant

UNLIMITED = resource.getrlimit(resource.RLIMIT_AS)
FIRST, FACTOR, TRIES = 1 << 20, 1.5, 25
# Ours, NumPy's, the system's.
SAID = re.compile(
    r"\d+ bytes (for|of memory)|Unable to allocate [\d.]+ .iB|threads: (\d+|none) could|Cannot allocate memory"
)

Subject = bihtree.Tree | bihtree.Scene
Work = Callable[[Any], Any]


def size() -> int:
    """Addresses that the process has."""
    fields = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(fields["VmSize"].split()[0]) << 10


def refusal(spare: int, work: Work, subject: Subject) -> str:
    """The error of work that has so many bytes, or nothing."""
    resource.setrlimit(resource.RLIMIT_AS, (size() + spare, UNLIMITED[1]))
    try:
        work(subject)
    except (MemoryError, bihtree.BihError, OSError) as error:
        return f"{type(error).__name__}: {error}"
    finally:
        resource.setrlimit(resource.RLIMIT_AS, UNLIMITED)
    return ""


def refusals(name: str, work: Work, made: Callable[[], Subject], check: Work) -> int:
    """How often work is refused; each try has a subject of its own."""
    work(made())
    for count in range(TRIES):
        subject = made()
        text = refusal(int(FIRST * FACTOR**count), work, subject)
        if not text:
            return count
        assert SAID.search(text), (name, text)
        assert "\n" not in text, (name, text)
        check(subject)
    raise AssertionError(f"{name}: never enough")


def _built(variant: Variant, mesh: meshes.Triangles, _: bihtree.Tree) -> bihtree.Tree:
    return variant.tree(*mesh)


@dataclass
class Hard:
    """Rays that the oracle decides: what a new tree answers when it gets through has to be the truth."""

    mesh: meshes.Triangles
    rays: Rays
    answers: bihtree.Hits | None = None

    def ask(self, variant: Variant, _: bihtree.Tree) -> None:
        self.answers = variant.tree(*self.mesh).intersect(*self.rays)

    def prove(self, precision: str) -> None:
        assert self.answers
        every = BATCH // FEWER_RAYS
        found = self.answers
        weights = found.u[::every], found.v[::every]
        some = Rows(found.t[::every], found.triangle[::every], *weights, found.instance[::every])
        rays = (part[::every] for part in self.rays)
        truth = truth_of(self.mesh, *rays, np.zeros(FEWER_RAYS), np.full(FEWER_RAYS, np.inf))
        assert_answers(some, truth, precision)
        self.answers = None


def places(side: int) -> NDArray[np.float64]:
    """(side ** 2, 4, 4): next to each other, all within the unit square."""
    matrices = np.tile(np.diag([1 / side, 1 / side, 0.5, 1.0]), (side * side, 1, 1))
    matrices[:, :2, 3] = np.stack(np.divmod(np.arange(side * side), side), axis=1) / side
    return matrices


def main(names: list[str], folder: Path) -> None:
    mesh = meshes.terrain(220)
    eager = bihtree.Tree(*mesh, threads=2)
    rays = around(mesh, 120_000, np.random.default_rng(1))
    camera = bihtree.Camera(np.diag([2.0, 2.0, 2.0, 1.0]), 1000, 800)
    path = folder / "tree"
    eager.save(path)
    sheets = bihtree.Tree(*meshes.sheets(100_000), threads=2)
    placed_sheets = bihtree.Scene([sheets], np.zeros(1, np.int32), np.eye(4)[None], threads=2)
    one = np.array([[0.25, 0.25, -1]], np.float32), np.array([[0, 0, 1]], np.float32)
    passes = ["combined", "depth", "normal", "position", "cost", "triangle"]
    passes += ["instance", "object_index", "material_index"]
    few, many = places(10), places(100)
    hard = Hard(small := meshes.icosphere(1), at_weak_places(small, BATCH))
    moved = mesh.vertices + np.float32(0.25)

    works: dict[str, Work] = {
        "intersect": lambda tree: tree.intersect(*rays),
        "occluded": lambda tree: tree.occluded(*rays),
        "all": lambda tree: tree.intersect_all(*rays),
        "all_of_one": lambda _: sheets.intersect_all(*one),
        "all_of_one_placed": lambda _: placed_sheets.intersect_all(*one),
        "count": lambda tree: tree.count(*rays),
        "contains": lambda tree: tree.contains(rays.origins),
        "cost": lambda tree: tree.traversal_cost(*rays),
        "render": lambda tree: bihtree.render(tree, camera, passes=passes),
        "load": lambda _: bihtree.Tree.load(path),
        "read": lambda _: bihtree.Tree.load(path, mmap=False),
        "save": lambda tree: tree.save(path),
        "nodes": lambda tree: tree.nodes(),
        "order": lambda tree: tree.order(),
        "validate": lambda tree: tree.validate(),
        "rays": lambda _: camera.rays(),
        "build_all": lambda tree: tree.build_all(),
        "refit": lambda tree: tree.refit(moved),
        "set_matrices": lambda scene: scene.set_matrices(many[::-1]),
        "instances": lambda _: scene(many),
    }

    def scene(matrices: NDArray[np.float64]) -> bihtree.Scene:
        return bihtree.Scene([eager], np.zeros(len(matrices), np.int32), matrices, threads=2)

    def answers(subject: Subject) -> bytes:
        hits = subject.intersect(rays.origins[:100], rays.directions[:100])
        numbers = [hits.t, hits.triangle, hits.u, hits.v]
        numbers += [hits.instance] if isinstance(subject, bihtree.Scene) else []
        return b"".join(array.tobytes() for array in numbers)

    before = {subject.stats.triangles: answers(subject) for subject in (eager, scene(few), scene(many))}

    def check(subject: Subject) -> None:
        if isinstance(subject, bihtree.Tree):
            subject.validate()
        assert answers(subject) == before[subject.stats.triangles]
        assert os.listdir(folder) == ["tree"]

    for variant in VARIANTS + FAST_VARIANTS:
        works[f"build-{variant}"] = partial(_built, variant, mesh)
        works[f"true-{variant}"] = partial(hard.ask, variant)
    proved = {f"true-{variant}": variant.precision for variant in VARIANTS}
    subjects: dict[str, Callable[[], Subject]] = {
        "": lambda: eager,
        "first": lambda: bihtree.Tree(*mesh, build="on_demand", threads=2),
        "new": lambda: bihtree.Tree(*mesh, threads=2),
        "placed": lambda: scene(few),
        "crowd": lambda: scene(many),
    }
    for name in names:
        kind, _, rest = name.rpartition("-") if name.split("-")[0] in subjects else ("", "", name)
        print(name, refusals(name, works[rest], subjects[kind], check))
        if name in proved:
            hard.prove(proved[name])
    check(bihtree.Tree.load(path))


if __name__ == "__main__":
    *works, folder = sys.argv[1:]
    main(works, Path(folder))
