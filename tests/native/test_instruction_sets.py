"""Every instruction set gives the same bits, and BIHTREE_ISA chooses one."""

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[2]
LIST = "import bihtree; print(*bihtree.cpu_features())"
HASH = """
import hashlib
import numpy as np
import bihtree
from tests import meshes
from tests.native.test_render import CAMERAS, PASSES
from tests.rays import around, at_features, joined
from tests.variants import FAST_VARIANTS, VARIANTS

digest = hashlib.sha256()
for dtype in (np.float32, np.float64):
    mesh = meshes.terrain(40).astype(dtype)
    rng = np.random.default_rng(1)
    rays = joined(around(mesh, 500, rng, dtype), at_features(mesh, 500, rng, dtype))
    for variant in VARIANTS + FAST_VARIANTS:
        tree = variant.tree(*mesh)
        hits = tree.intersect(*rays)
        for part in (hits.t, hits.triangle, hits.u, hits.v, tree.occluded(*rays), *tree.traversal_cost(*rays)):
            digest.update(part.tobytes())
        for matrix in CAMERAS.values():
            picture = bihtree.render(tree, bihtree.Camera(matrix, 35, 25), passes=PASSES, samples=2)
            for name in PASSES:
                digest.update(picture[name].tobytes())
print(bihtree.cpu_features()[0], digest.hexdigest())
"""


def python(code: str, instruction_set: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "BIHTREE_ISA": instruction_set}
    command = [sys.executable, "-c", code]
    return subprocess.run(command, env=environment, cwd=PROJECT, capture_output=True, text=True, check=False)


AVAILABLE = python(LIST, "").stdout.split()
"""What this processor has, whatever the tests themselves run in."""


@cache
def used_and_digest(instruction_set: str) -> list[str]:
    done = python(HASH, instruction_set)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.parametrize("name", AVAILABLE)
def test_same_bits_as_scalar(name: str) -> None:
    _, expected = used_and_digest("scalar")
    assert used_and_digest(name) == [name, expected]


def test_one_that_is_named_leaves_itself_and_scalar() -> None:
    for name in AVAILABLE[:-1]:
        assert python(LIST, name).stdout.split() == [name, "scalar"]
    assert python(LIST, "scalar").stdout.split() == ["scalar"]


@pytest.mark.parametrize("name", ["abacus", "AVX2", " scalar"])
def test_an_unknown_name_is_an_error_at_import_with_the_choices(name: str) -> None:
    last = python(LIST, name).stderr.splitlines()[-1]
    expected = f'BIHTREE_ISA: "{name}" is no instruction set of this processor, which has {", ".join(AVAILABLE)}'
    assert last == f"ImportError: {expected}"


@pytest.mark.skipif(not Path("/proc/cpuinfo").exists(), reason="only Linux lists the features of a processor")
def test_what_the_processor_has_is_found() -> None:
    """By the names that the kernel gives to features; valgrind and emulators may have fewer than the kernel says."""
    flags = set(Path("/proc/cpuinfo").read_text(encoding="utf-8").split())
    avx2 = {"avx2", "fma", "bmi1", "bmi2", "abm", "popcnt"}
    wanted = {"avx512": avx2 | {"avx512f", "avx512vl", "avx512dq", "avx512bw"}, "avx2": avx2, "neon": {"asimd"}}
    assert [*(name for name, parts in wanted.items() if parts <= flags), "scalar"] == AVAILABLE
