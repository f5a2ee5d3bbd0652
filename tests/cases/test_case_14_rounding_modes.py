"""Case 14: a host may have set flush-to-zero or another rounding mode on the calling thread: same bits."""

import ctypes
import platform
import sys
from contextlib import contextmanager

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_answers, assert_same, truth_of
from tests.many_rays import RAYS, at_weak_places
from tests.rays import around, at_features, joined
from tests.variants import every_precision, every_tree_of_many_rays

# The control word in glibc's fenv_t: its offset, and the bits of each mode.
WORDS = {
    "x86_64": (28, {"flush-to-zero": 0x8040, "down": 0x2000, "up": 0x4000, "towards-zero": 0x6000}),
    "aarch64": (0, {"flush-to-zero": 1 << 24, "down": 2 << 22, "up": 1 << 22, "towards-zero": 3 << 22}),
}
pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() not in WORDS or platform.libc_ver()[0] != "glibc",
    reason="the floating-point control word is set through glibc's fenv_t",
)
every_mode = pytest.mark.parametrize("mode", ["flush-to-zero", "down", "up", "towards-zero"])


@contextmanager
def floating_point(mode):
    """Run the body with the mode set on this thread."""
    libm = ctypes.CDLL("libm.so.6")
    offset, modes = WORDS[platform.machine()]
    before = ctypes.create_string_buffer(64)
    assert libm.fegetenv(before) == 0
    changed = ctypes.create_string_buffer(before.raw, 64)
    word = int.from_bytes(changed.raw[offset : offset + 4], sys.byteorder) | modes[mode]
    changed[offset : offset + 4] = word.to_bytes(4, sys.byteorder)
    assert libm.fesetenv(changed) == 0
    try:
        yield
    finally:
        assert libm.fesetenv(before) == 0


def rounded(x, y):
    """A sum, a product and a quotient as this thread computes them now."""
    return x + y, x * y, x / y


@every_mode
def test_the_mode_is_really_set(mode):
    least = float.fromhex("0x1p-1022")
    with floating_point(mode):
        changed = (least * 0.5, *rounded(1.0, 3.0**-40), *rounded(-1.0, 3.0**-40))
    assert changed != (least * 0.5, *rounded(1.0, 3.0**-40), *rounded(-1.0, 3.0**-40))


def hard_rays(mesh, dtype):
    """Rays that miss and hit by less than rounding, some with subnormal components and lengths."""
    rng = np.random.default_rng(1)
    rays = joined(around(mesh, 40, rng, dtype), at_features(mesh, 80, rng, dtype))
    tiny = np.finfo(dtype).tiny
    with np.errstate(under="ignore"):
        rays.directions[::5] *= tiny / 8
        rays.directions[1::5, 0] = tiny / 4
        rays.directions[2::5, 1] = -tiny / 1024
    return rays


@every_mode
@every_precision
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_same_bits(variant, mode, dtype):
    small = meshes.icosphere(2, dtype=np.float64)
    small = meshes.Triangles(small.vertices * np.finfo(dtype).tiny, small.triangles)
    for mesh in (meshes.icosphere(3, dtype=dtype), small.astype(dtype)):
        rays = hard_rays(mesh, dtype)
        tree = variant.tree(*mesh)
        hits, occluded, cost = tree.intersect(*rays), tree.occluded(*rays), tree.traversal_cost(*rays)
        # Products of numbers so small are zero in precision fast.
        assert hits.hit.sum() > 40 or (variant.precision == "fast" and mesh.vertices.max() < 1e-30)
        with floating_point(mode):
            again = variant.tree(*mesh)
            hits_again, occluded_again, cost_again = (
                again.intersect(*rays),
                again.occluded(*rays),
                again.traversal_cost(*rays),
            )
        assert_same(hits_again, hits)
        assert np.array_equal(occluded_again, occluded)
        assert np.array_equal(cost_again, cost)
        assert again.nodes().tobytes() == tree.nodes().tobytes()
        assert again.order().tobytes() == tree.order().tobytes()
        assert again.bounds.tobytes() == tree.bounds.tobytes()


@every_mode
def test_same_bits_of_a_picture(mode):
    tree = bihtree.Tree(*meshes.terrain(30))
    clip_to_world = np.array([[0.5, 0, 0, 0.5], [0.1, 0.5, 0, 0.5], [0.3, 0, -2, 0], [0, 0.1, 0, 1]])
    passes = ("combined", "depth", "normal", "position", "triangle", "cost")
    plain = bihtree.render(tree, bihtree.Camera(clip_to_world, 40, 30), passes=passes, samples=2)
    with floating_point(mode):
        again = bihtree.render(tree, bihtree.Camera(clip_to_world, 40, 30), passes=passes, samples=2)
        rays = bihtree.Camera(clip_to_world, 40, 30).rays()
    assert (plain["triangle"] >= 0).any()
    for name in passes:
        assert again[name].tobytes() == plain[name].tobytes(), name
    for ours, expected in zip(rays, bihtree.Camera(clip_to_world, 40, 30).rays(), strict=True):
        assert ours.tobytes() == expected.tobytes()


@every_mode
@every_tree_of_many_rays
def test_a_hundred_thousand_rays(variant, mode):
    """The oracle decides in the standard environment; the tree is built and asked in another."""
    mesh = meshes.icosphere(1)
    rays = at_weak_places(mesh, RAYS // 4)
    truth = truth_of(mesh, *rays, np.zeros(len(rays.origins)), np.full(len(rays.origins), np.inf))
    with floating_point(mode):
        tree = variant.tree(*mesh)
        hits, occluded = tree.intersect(*rays), tree.occluded(*rays)
    assert_answers(hits, truth, tree.stats.precision)
    assert np.array_equal(occluded, truth.triangle >= 0)
