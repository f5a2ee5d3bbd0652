"""Case 13: matrices that are singular, mirrored, sheared, of 10^30: no NaN, and the hits of the transformed mesh."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.instances import KINDS, assert_scene_true, flattened, moved
from tests.rays import Rays, around, at_features, joined, parallel

SPHERE = meshes.icosphere(1)
WITH_AN_INSIDE = [kind for kind in KINDS if not kind.startswith(("scale 0", "onto", "nearly"))]


def rays_at(mesh, count=40):
    rng = np.random.default_rng(13)
    parts = around(mesh, count, rng, np.float64), at_features(mesh, count, rng, np.float64)
    return joined(*parts, parallel(mesh, 5, 5, 0, np.float64), parallel(mesh, 5, 5, 2, np.float64))


@pytest.mark.parametrize(("precision", "dtype"), [("watertight", np.float32), ("fast", np.float64)])
@pytest.mark.parametrize("kind", KINDS)
def test_hits_are_those_of_the_transformed_mesh(kind, dtype, precision):
    mesh, matrices = SPHERE.astype(dtype), KINDS[kind][None]
    scene = bihtree.Scene([bihtree.Tree(*mesh, precision=precision)], [0], matrices)
    rays = rays_at(flattened([mesh], matrices))
    truth = assert_scene_true(scene, [mesh], matrices, rays)
    assert (truth.triangle >= 0).any() == (kind not in ("onto a line", "onto a point"))
    hits = scene.intersect(*rays)
    for array in (hits.t, hits.u, hits.v, scene.bounds):
        assert not np.isnan(array).any()


@pytest.mark.parametrize("kind", WITH_AN_INSIDE)
def test_no_ray_passes_between_images_of_triangles(kind):
    """From inside of a closed mesh every ray hits something, at vertices and edges above all."""
    matrix = KINDS[kind]
    scene = bihtree.Scene([bihtree.Tree(*SPHERE)], [0], matrix[None])
    mesh = flattened([SPHERE], matrix[None])
    middle = mesh.vertices.mean(axis=0)
    edges = (mesh.vertices[mesh.triangles[:, 0]] + mesh.vertices[mesh.triangles[:, 1]]) / 2
    targets = np.concatenate([mesh.vertices, edges, mesh.vertices[mesh.triangles].mean(axis=1)])
    assert scene.occluded(np.tile(middle, (len(targets), 1)), targets - middle).all()


def test_a_mirror_keeps_the_weights_at_their_vertices():
    mesh = meshes.from_corners([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    scene = bihtree.Scene([bihtree.Tree(*mesh)], [0], [moved((-1, 1, 1))])
    hits = scene.intersect([[-0.5, 0.125, 1]], [[0, 0, -1.0]])
    assert (hits.t[0], hits.u[0], hits.v[0]) == (1, 0.5, 0.125)


def test_images_without_area_are_not_hit_and_counted():
    """A plate seen from its side is a line: its triangles are rejected as degenerate ones are, the others are not."""
    box = meshes.box()
    scene = bihtree.Scene([bihtree.Tree(*box)], [0], [moved((1, 1, 0))])
    hits = scene.intersect([[0.25, 0.5, 1], [0.5, 0.25, -1]], [[0, 0, -1.0], [0, 0, 1.0]])
    assert hits.t.tolist() == [1, 1]
    assert hits.triangle.tolist() == [8, 9]  # of two images in one plane the lower row
    flat = bihtree.Scene([bihtree.Tree(*box)], [0, 0], [moved((1, 0, 0)), moved((0, 0, 0))])
    assert not flat.occluded(*rays_at(box)).any()
    assert (flat.stats.references, flat.stats.rejected) == (0, 2)
    assert flat.bounds.tolist() == [[np.inf] * 3, [-np.inf] * 3]


def test_instances_of_every_kind_in_one_scene():
    shown = [SPHERE if row % 2 else meshes.box() for row in range(len(KINDS))]
    matrices = np.array(list(KINDS.values()))
    scene = bihtree.Scene([bihtree.Tree(*shown[0]), bihtree.Tree(*shown[1])], np.arange(len(KINDS)) % 2, matrices)
    rng = np.random.default_rng(1)
    origins = rng.normal(size=(60, 3)) * 10.0 ** rng.integers(-3, 4, (60, 1))
    targets = rng.normal(size=(60, 3))
    assert_scene_true(scene, shown, matrices, Rays(origins, targets - origins))
    assert "inverse" in scene.stats.left_out


@pytest.mark.parametrize("scale", [1e-300, 1e-200, 1e200, 1e300])
def test_rays_of_any_size_find_what_is_there(scale):
    """The inverse of such a direction or distance is no double: then no box is left out."""
    scene = bihtree.Scene([bihtree.Tree(*SPHERE)], [0], [KINDS["sheared"]])
    mesh = flattened([SPHERE], KINDS["sheared"][None])
    near = around(mesh, 30, np.random.default_rng(2), np.float64)
    assert_scene_true(scene, [SPHERE], KINDS["sheared"][None], Rays(near.origins, near.directions * scale))
