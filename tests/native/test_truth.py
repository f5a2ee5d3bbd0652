"""100,000 rays a mesh against embreex (robust): disagreements are decided by fractions, and ours is wrong in none."""

import os

import bihtree
import numpy as np
import pytest

from tests import rays as make
from tests.agreement import assert_true
from tests.meshes import shared_mesh, shared_mesh_path
from tests.native.truth_report import MESHES, compare
from tests.variants import every_tree


@pytest.mark.parametrize("name", MESHES)
def test_closest_hits_against_embree(name, record_property):
    if not os.environ.get("CI"):
        pytest.importorskip("embreex", reason="embreex, the peer, is not installed: python -m pip install embreex")
    result = compare(name)
    for column, count in result.counts().items():
        record_property(column, count)
    print(f"{name}: {result.counts()}")
    assert result.rays == 100_000
    assert result.hits > 1000
    assert result.ours_right == result.disagreements, "\n".join(result.wrong[:20])
    assert not result.wrong, "\n".join(result.wrong[:20])


@every_tree
@pytest.mark.parametrize("name", ["delft-city", "offset1", "generic-twin-7863", "sliver-tet"])
def test_float64_meshes_far_from_the_origin(variant, name):
    """embreex has no float64: these are put to the oracle, as they are."""
    mesh = shared_mesh(name)
    assert mesh.vertices.dtype == np.float64
    rng = np.random.default_rng(1)
    rays = make.joined(
        make.around(mesh, 60, rng, np.float64),
        make.at_features(mesh, 60, rng, np.float64),
        make.parallel(mesh, 8, 8, dtype=np.float64),
    )
    hits = assert_true(variant.tree(*mesh), mesh, *rays)
    assert hits.t.dtype == np.float64 and hits.hit.sum() > 40


@every_tree
@pytest.mark.parametrize("name", ["stanford-bunny", "gebco-55cl", "fandisk", "self-intersect-a", "octagonal-pocket"])
def test_float32_meshes_with_float64_rays(variant, name):
    mesh = shared_mesh(name)
    rng = np.random.default_rng(1)
    rays = make.joined(make.around(mesh, 40, rng, np.float64), make.at_features(mesh, 40, rng, np.float64))
    assert assert_true(variant.tree(*mesh), mesh, *rays).hit.sum() > 30


def test_a_tree_of_every_shared_mesh_is_sound():
    """Built and validated, within its bound; nothing is asked of the rays."""
    first = shared_mesh_path("stanford-bunny")
    names = sorted(path.stem for path in first.parent.glob("*.npz") if not path.stem.endswith(".instanced"))
    for name in names:
        tree = bihtree.Tree(*shared_mesh(name))
        tree.validate()
        assert tree.stats.tree_bytes <= tree.stats.bound_bytes, name
