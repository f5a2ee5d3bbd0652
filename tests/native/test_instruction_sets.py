"""Every instruction set gives the same bits."""

import os
import subprocess
import sys
from pathlib import Path

import bihtree
import pytest

HASH = """
import hashlib, sys
import numpy as np
import bihtree
from tests import meshes
from tests.rays import around, at_features, joined
from tests.variants import VARIANTS

digest = hashlib.sha256()
for dtype in (np.float32, np.float64):
    mesh = meshes.terrain(40).astype(dtype)
    rng = np.random.default_rng(1)
    rays = joined(around(mesh, 500, rng, dtype), at_features(mesh, 500, rng, dtype))
    for variant in VARIANTS:
        tree = variant.tree(*mesh)
        hits = tree.intersect(*rays)
        for part in (hits.t, hits.triangle, hits.u, hits.v, tree.occluded(*rays), *tree.traversal_cost(*rays)):
            digest.update(part.tobytes())
print(bihtree.cpu_features()[0], digest.hexdigest())
"""


def run(instruction_set: str) -> tuple[str, str]:
    environment = {**os.environ, "BIHTREE_ISA": instruction_set}
    root = Path(__file__).resolve().parents[2]
    command = [sys.executable, "-c", HASH]
    name, digest = subprocess.check_output(command, env=environment, cwd=root, text=True).split()
    return name, digest


@pytest.mark.parametrize("name", [name for name in bihtree.cpu_features() if name != "scalar"])
def test_same_bits_as_scalar(name):
    used, digest = run(name)
    assert used == name
    assert run("scalar") == ("scalar", digest)


def test_an_unknown_name_leaves_scalar():
    assert run("abacus")[0] == "scalar"
