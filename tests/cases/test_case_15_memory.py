"""Case 15: memory runs out: an error that says what was needed, nothing is lost, and the process lives on."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.variants import FAST_VARIANTS, MANY_RAYS_VARIANTS, VARIANTS

ROOT = Path(__file__).resolve().parents[2]

# Memory that is given back goes to the system at once, so that what was held before is no secret reserve; nor are the
# addresses that each thread keeps.
ENVIRONMENT = {"MALLOC_MMAP_THRESHOLD_": "65536", "MALLOC_TRIM_THRESHOLD_": "65536", "MALLOC_ARENA_MAX": "1"}

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="RLIMIT_AS is a limit on Linux alone")


def refusals(works, folder):
    """How often each work was refused before there was enough memory."""
    command = [sys.executable, "-m", "tests.short_of_memory", *works, str(folder)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env={**os.environ, **ENVIRONMENT})
    assert run.returncode == 0, run.stdout + run.stderr
    lines = (line.rsplit(" ", 1) for line in run.stdout.splitlines())
    return {name: int(count) for name, count in lines}


def test_builds(tmp_path):
    works = [f"build-{variant}" for variant in VARIANTS + FAST_VARIANTS]
    counts = refusals(works, tmp_path)
    assert set(counts) == set(works)
    assert all(count > 0 for count in counts.values()), counts


def test_many_rays(tmp_path):
    """Their answers, when there is just enough memory for them, are the oracle's."""
    works = [f"true-{variant}" for variant in MANY_RAYS_VARIANTS]
    counts = refusals(works, tmp_path)
    assert set(counts) == set(works)
    assert all(count > 0 for count in counts.values()), counts


def test_queries(tmp_path):
    works = ["intersect", "occluded", "all", "all_of_one", "count", "contains", "cost", "render", "rays"]
    counts = refusals(works, tmp_path)
    assert set(counts) == set(works)
    assert all(counts[name] > 0 for name in set(works) - {"occluded", "count", "contains"}), counts


def test_trees(tmp_path):
    works = ["load", "read", "save", "nodes", "order", "validate"]
    counts = refusals(works, tmp_path)
    assert set(counts) == set(works)
    assert all(counts[name] > 0 for name in ("load", "read", "nodes")), counts


def test_on_demand(tmp_path):
    works = ["first-intersect", "first-all", "first-render", "first-save", "first-nodes", "first-build_all"]
    counts = refusals(works, tmp_path)
    assert set(counts) == set(works)
    assert all(counts[name] > 0 for name in ("first-intersect", "first-all", "first-render", "first-nodes")), counts


def test_what_moves_stays_where_it_was(tmp_path):
    works = ["new-refit", "crowd-set_matrices", "instances"]
    counts = refusals(works, tmp_path)
    assert set(counts) == set(works)
    assert all(count > 0 for count in counts.values()), counts


def test_scenes(tmp_path):
    # The lists last: what they leave behind in small pieces is a reserve for whatever comes next.
    works = ["placed-intersect", "placed-cost", "placed-render", "placed-all", "all_of_one_placed"]
    counts = refusals(works, tmp_path)
    assert set(counts) == set(works)
    assert all(count > 0 for count in counts.values()), counts
