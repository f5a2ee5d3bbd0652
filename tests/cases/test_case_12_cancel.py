"""Case 12: cancel at any moment of a build or render; memory goes back; Ctrl-C works."""

import signal
import subprocess
import sys
from pathlib import Path

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_same
from tests.many_rays import assert_many_true, at_weak_places
from tests.rays import around
from tests.variants import every_precision, every_tree_of_many_rays

ROOT = Path(__file__).resolve().parents[2]


class Recorder:
    """A progress callback that keeps what it is told and answers `answer` at call number `at`."""

    def __init__(self, at=None, answer=False):
        self.values, self.at, self.answer = [], at, answer

    def __call__(self, fraction):
        self.values.append(fraction)
        if self.at is not None and len(self.values) > self.at:
            if isinstance(self.answer, BaseException):
                raise self.answer
            return self.answer
        return None


def assert_cancelled_at(at, work):
    """At call number `at`. Calls come by the clock, all but the first: work that is faster this time may end before."""
    recorder = Recorder(at)
    try:
        work(recorder)
    except bihtree.Cancelled:
        assert len(recorder.values) == at + 1
    else:
        assert 0 < len(recorder.values) <= at


class OutOfPaper(Exception):
    pass


@every_precision
def test_progress_of_a_build(variant):
    mesh = meshes.terrain(300)
    recorder = Recorder()
    tree = variant.tree(*mesh, progress=recorder)
    assert recorder.values
    assert all(isinstance(value, float) and 0 <= value <= 1 for value in recorder.values)
    assert recorder.values == sorted(recorder.values)
    rays = around(mesh, 100, np.random.default_rng(1))
    assert_same(tree.intersect(*rays), variant.tree(*mesh).intersect(*rays))


@every_precision
def test_cancel_a_build_at_each_call(variant):
    mesh = meshes.terrain(300)
    calls = Recorder()
    variant.tree(*mesh, progress=calls)
    for at in {0, len(calls.values) // 2}:
        assert_cancelled_at(at, lambda recorder: variant.tree(*mesh, progress=recorder))


@every_precision
def test_answers_other_than_false_do_not_cancel(variant):
    for answer in (None, True):
        variant.tree(*meshes.terrain(30), progress=Recorder(0, answer))


@every_precision
def test_an_exception_of_the_callback_comes_out(variant):
    with pytest.raises(OutOfPaper, match="tray 2"):
        variant.tree(*meshes.terrain(300), progress=Recorder(0, OutOfPaper("tray 2")))


def camera(size):
    """An orthographic camera over the unit square, looking down."""
    clip_to_world = np.diag([0.5, 0.5, -2.0, 1.0])
    clip_to_world[:2, 3] = 0.5
    return bihtree.Camera(clip_to_world, size, size)


def test_cancel_a_render():
    tree = bihtree.Tree(*meshes.terrain(100))
    recorder = Recorder()
    whole = bihtree.render(tree, camera(256), samples=2, progress=recorder)
    assert all(0 <= value <= 1 for value in recorder.values) and recorder.values == sorted(recorder.values)
    for at in {0, len(recorder.values) // 2}:
        assert_cancelled_at(at, lambda recorder: bihtree.render(tree, camera(256), samples=2, progress=recorder))
    with pytest.raises(OutOfPaper):
        bihtree.render(tree, camera(256), samples=2, progress=Recorder(0, OutOfPaper()))
    assert np.array_equal(bihtree.render(tree, camera(256), samples=2)["combined"], whole["combined"])


def resident_bytes():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


@pytest.mark.skipif(sys.platform != "linux", reason="resident memory is read from /proc")
def test_memory_goes_back():
    """Forty cancelled builds of 28 MB of nodes and references each leave no more behind than two of them."""
    mesh = meshes.terrain(500)
    used = []
    for _ in range(40):
        with pytest.raises(bihtree.Cancelled):
            bihtree.Tree(*mesh, progress=Recorder(0))
        used.append(resident_bytes())
    assert used[-1] - used[4] < 60e6


INTERRUPTED = """
import sys
import numpy as np
import bihtree
from tests import meshes

mesh = meshes.sheets(1)
tree = bihtree.Tree(mesh.vertices, np.repeat(mesh.triangles, 100_000, axis=0))
origins = np.tile([0.75, 0.75, 1.0], (2_000_000, 1))
directions = np.tile([0, 0, -1.0], (2_000_000, 1))
camera = bihtree.Camera([[0.1, 0, 0, 0.8], [0, 0.1, 0, 0.8], [0, 0, -2, 0], [0, 0, 0, 1]], 8192, 8192)
print("ready", flush=True)
try:
    {work}
except KeyboardInterrupt:
    hits = bihtree.Tree(*mesh).intersect([[0.25, 0.25, 1.0]], [[0, 0, -1.0]])
    print("interrupted", hits.triangle.tolist(), flush=True)
else:
    print("finished", flush=True)
"""
HOURS_OF_WORK = {  # each ray is tested against 100,000 triangles
    "intersect": "tree.intersect(origins, directions)",
    "occluded": "tree.occluded(origins, directions)",
    "traversal_cost": "tree.traversal_cost(origins, directions)",
    "render": "bihtree.render(tree, camera, samples=64)",
}


@pytest.mark.skipif(sys.platform == "win32", reason="a console interrupt cannot be sent to one process there")
@pytest.mark.parametrize("work", HOURS_OF_WORK.values(), ids=HOURS_OF_WORK)
def test_interrupt(work):
    """Only the interrupt ends the work in time; the module is usable after it."""
    code = INTERRUPTED.format(work=work)
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            with pytest.raises(subprocess.TimeoutExpired):
                process.wait(1)
            process.send_signal(signal.SIGINT)
            output, _ = process.communicate(timeout=120)
        finally:
            process.kill()
    assert output == "interrupted [0]\n"
    assert process.returncode == 0


@every_tree_of_many_rays
def test_a_hundred_thousand_rays_after_a_cancelled_build(variant):
    mesh = meshes.icosphere(2)
    with pytest.raises(bihtree.Cancelled):
        variant.tree(*meshes.terrain(300), progress=Recorder(0))
    assert_many_true(variant, mesh, at_weak_places(mesh))
