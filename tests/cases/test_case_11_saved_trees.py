"""Case 11: a saved tree gives the same bits; one that is cut short, damaged, forged, of another version or no tree at
all is a FileFormatError, never a crash or an endless loop."""

import os
import pickle
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.many_rays import FEWER_RAYS, assert_all_true, at_weak_places
from tests.rays import Rays, around
from tests.saved_file import SavedFile, with_field
from tests.small_files import SMALL, every_small, saved, with_rejected
from tests.variants import FAST_VARIANTS, VARIANTS, every_tree, every_tree_of_many_rays

ROOT = Path(__file__).resolve().parents[2]

every_variant = pytest.mark.parametrize("variant", VARIANTS + FAST_VARIANTS, ids=str)

FORMS = ("float32", "float64", "float32-soup", "float64-soup")


def arrays(mesh, form):
    vertices = mesh.vertices.astype(form.split("-")[0])
    return (vertices[mesh.triangles].reshape(-1, 3),) if form.endswith("soup") else (vertices, mesh.triangles)


def assert_same_answers(loaded, tree, rays):
    mine, theirs = loaded.intersect(*rays), tree.intersect(*rays)
    for name in ("t", "triangle", "u", "v", "instance"):
        assert getattr(mine, name).tobytes() == getattr(theirs, name).tobytes(), name
        assert getattr(mine, name).dtype == getattr(theirs, name).dtype
    assert mine.invalid == theirs.invalid
    assert loaded.occluded(*rays).tobytes() == tree.occluded(*rays).tobytes()


@every_variant
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("mmap", [True, False])
def test_same_bits(variant, form, mmap, tmp_path):
    mesh = with_rejected(meshes.terrain(40))
    tree = variant.tree(*arrays(mesh, form))
    tree.save(tmp_path / "tree.bihtree")
    loaded = bihtree.Tree.load(tmp_path / "tree.bihtree", mmap=mmap)
    loaded.validate()
    rays = around(mesh, 500, np.random.default_rng(1))
    assert_same_answers(loaded, tree, rays)
    tree.build_all()
    assert loaded.nodes().tobytes() == tree.nodes().tobytes()
    assert loaded.order().tobytes() == tree.order().tobytes()
    assert loaded.bounds.tobytes() == tree.bounds.tobytes()
    for mine, theirs in zip(loaded.traversal_cost(*rays), tree.traversal_cost(*rays), strict=True):
        if variant.options.get("build") != "on_demand":
            assert mine.tobytes() == theirs.tobytes()


@every_tree_of_many_rays
def test_many_rays(variant, tmp_path):
    """A tree in the memory of its file is asked for half of them, one that was read for the others."""
    mesh = meshes.icosphere(1)
    variant.tree(*mesh).save(tmp_path / "tree")
    origins, directions = at_weak_places(mesh, FEWER_RAYS)
    for first, mmap in enumerate((True, False)):
        tree = bihtree.Tree.load(tmp_path / "tree", mmap=mmap)
        assert_all_true(tree, mesh, Rays(origins[first::2], directions[first::2]))


@every_variant
def test_stats(variant, tmp_path):
    mesh = with_rejected(meshes.terrain(40))
    tree = variant.tree(*mesh)
    tree.save(tmp_path / "tree")
    loaded, saved = bihtree.Tree.load(tmp_path / "tree").stats.to_dict(), tree.stats.to_dict()
    assert loaded.pop("build") == "eager"
    saved.pop("build")
    if variant.options.get("build") == "on_demand":
        # The eager tree was built for the file.
        built_anew = variant.tree(*mesh, build="eager").stats.to_dict()
        for name in ("build_seconds", "peak_build_bytes"):
            loaded.pop(name)
        saved = {name: built_anew[name] for name in loaded}
        loaded["left_out"].pop("unbuilt nodes", None)
    assert loaded == saved
    assert loaded["rejected"] == 2


@every_tree
@pytest.mark.parametrize("triangles", [0, 1, 2])
def test_small(variant, triangles, tmp_path):
    mesh = meshes.box()
    tree = variant.tree(mesh.vertices, mesh.triangles[:triangles])
    tree.save(str(tmp_path / "tree"))
    loaded = bihtree.Tree.load(str(tmp_path / "tree"))
    loaded.validate()
    assert_same_answers(loaded, tree, around(mesh, 100, np.random.default_rng(2)))


def test_a_mesh_of_more_than_one_piece_on_demand(tmp_path):
    mesh = meshes.terrain(150)
    rays = around(mesh, 1000, np.random.default_rng(3))
    eager = bihtree.Tree(*mesh)
    eager.save(tmp_path / "eager")
    for layout in ("wide", "compact", "classic"):
        tree = bihtree.Tree(*mesh, build="on_demand", layout=layout)
        tree.occluded(*(array[:1] for array in rays))
        unbuilt = tree.stats.unbuilt
        tree.save(tmp_path / "tree")
        assert tree.stats.unbuilt == unbuilt > 0
        assert_same_answers(bihtree.Tree.load(tmp_path / "tree"), eager, rays)


def test_render_and_a_second_save(tmp_path):
    mesh = meshes.terrain(30)
    tree = bihtree.Tree(*mesh)
    tree.save(tmp_path / "tree")
    loaded = bihtree.Tree.load(tmp_path / "tree")
    camera = bihtree.Camera(np.diag([2.0, 2.0, 2.0, 1.0]), 16, 12)
    mine, theirs = (bihtree.render(each, camera, passes=["combined", "depth"]) for each in (loaded, tree))
    assert all(mine[name].tobytes() == theirs[name].tobytes() for name in theirs)
    loaded.save(tmp_path / "again")
    assert (tmp_path / "again").read_bytes() == (tmp_path / "tree").read_bytes()
    loaded.save(tmp_path / "tree")
    assert (tmp_path / "again").read_bytes() == (tmp_path / "tree").read_bytes()
    assert_same_answers(loaded, tree, around(mesh, 100, np.random.default_rng(4)))


# Damage


@pytest.fixture
def refused(tmp_path):
    """Says why a file with these bytes is refused, both ways to load it."""
    path = tmp_path / "bad.bihtree"

    def load(data):
        path.write_bytes(data)
        texts = set()
        for mmap in (True, False):
            with pytest.raises(bihtree.FileFormatError) as caught:
                bihtree.Tree.load(path, mmap=mmap)
            texts.add(str(caught.value))
        assert len(texts) == 1
        text = texts.pop()
        assert text.startswith(str(path)) and "\n" not in text
        return text

    return load


@every_small
def test_a_flipped_bit_in_any_byte(variant, refused, tmp_path):
    good = saved(variant, tmp_path)
    for place in range(len(good)):
        bad = bytearray(good)
        bad[place] ^= 1 << (place * 5 % 8)
        refused(bytes(bad))


@every_small
def test_cut_short_at_any_byte(variant, refused, tmp_path):
    good = saved(variant, tmp_path)
    for length in range(len(good)):
        refused(good[:length])


@every_small
def test_longer_than_it_says(variant, refused, tmp_path):
    good = saved(variant, tmp_path)
    for tail in (b"\0", bytes(64), good):
        assert "the header says" in refused(good + tail)


def test_another_version(refused, tmp_path):
    good = saved(SMALL[0], tmp_path)
    for version in (0, 2, 2**32 - 1):
        assert f"version {version} " in refused(with_field(good, "version", version))


def test_another_byte_order(refused, tmp_path):
    good = saved(SMALL[0], tmp_path)
    assert "byte order" in refused(with_field(good, "byte_order", 0x04030201))


def test_other_files(refused, tmp_path):
    np.savez(tmp_path / "mesh.npz", vertices=np.zeros((3, 3)))
    for data in (b"\0", b"text\n", bytes(100_000), (tmp_path / "mesh.npz").read_bytes()):
        assert "not a saved tree" in refused(data)
    assert "empty" in refused(b"")
    assert "cut short" in refused(b"\x89BIH\r\n\x1a\n")


def test_sections_of_two_files(refused, tmp_path):
    """A tree of another mesh."""
    box = SavedFile.of(saved(SMALL[0], tmp_path))
    other = SavedFile.of(saved(SMALL[0], tmp_path, meshes.box(upper=(1, 1, 2))))
    refused(box.with_section("vertices", other.sections["vertices"]).data())
    refused(box.with_section("nodes", other.sections["nodes"]).data())


@pytest.mark.parametrize("mmap", [True, False])
def test_paths(mmap, tmp_path):
    def load(path):
        return bihtree.Tree.load(path, mmap=mmap)

    with pytest.raises(FileNotFoundError, match="missing"):
        load(tmp_path / "missing")
    with pytest.raises(IsADirectoryError, match=tmp_path.name):
        load(tmp_path)
    with pytest.raises(bihtree.FileFormatError, match="not a file"):
        load("/dev/zero")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(bihtree.FileFormatError, match="not a file"):
            load(tmp_path / "pipe")
    with pytest.raises(TypeError):
        load(3)


def test_places_that_cannot_be_written(tmp_path):
    tree = bihtree.Tree(*meshes.box())
    with pytest.raises(FileNotFoundError, match="missing"):
        tree.save(tmp_path / "missing" / "tree")
    with pytest.raises(IsADirectoryError):
        tree.save(tmp_path)
    with pytest.raises(OSError, match="/dev/null"):
        tree.save("/dev/null")
    assert not list(tmp_path.iterdir())


AS_NOBODY = """
import os, sys
import bihtree, numpy as np
tree = bihtree.Tree(np.eye(3))
if os.getuid() == 0:
    os.setuid(65534)
for work in (lambda: tree.save(sys.argv[1] + "/folder/tree"), lambda: bihtree.Tree.load(sys.argv[1] + "/secret")):
    try:
        work()
    except PermissionError as error:
        assert sys.argv[1] in str(error), error
    else:
        raise SystemExit("no error")
assert tree.intersect([[0.3, 0.3, 0.3]], [[1, 1, 1]]).hit.all()
"""


def test_no_permission():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        (folder / "folder").mkdir(mode=0o555)
        bihtree.Tree(*meshes.box()).save(folder / "secret")
        (folder / "secret").chmod(0)
        run = subprocess.run([sys.executable, "-c", AS_NOBODY, name], cwd=ROOT, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        assert not list((folder / "folder").iterdir())


FULL = """
import resource, signal, sys
import bihtree, numpy as np
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
tree = bihtree.Tree(np.random.default_rng(0).random((3000, 3)))
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
try:
    tree.save(sys.argv[1])
except OSError as error:
    assert sys.argv[1] in str(error) and "\\n" not in str(error)
else:
    raise SystemExit("no error")
"""


def test_a_disk_that_is_full_leaves_the_old_file(tmp_path):
    path = tmp_path / "tree"
    bihtree.Tree(*meshes.box()).save(path)
    before = path.read_bytes()
    run = subprocess.run([sys.executable, "-c", FULL, str(path)], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_permissions_are_those_of_any_new_file(tmp_path):
    bihtree.Tree(*meshes.box()).save(tmp_path / "tree")
    (tmp_path / "other").touch()
    assert (tmp_path / "tree").stat().st_mode == (tmp_path / "other").stat().st_mode


# Files that change


def test_two_loads_of_a_file_that_is_deleted(tmp_path):
    mesh = meshes.terrain(40)
    tree = bihtree.Tree(*mesh)
    tree.save(tmp_path / "tree")
    loads = [bihtree.Tree.load(tmp_path / "tree", mmap=mmap) for mmap in (True, True, False)]
    (tmp_path / "tree").unlink()
    rays = around(mesh, 300, np.random.default_rng(5))
    del tree
    for loaded in loads:
        assert_same_answers(loaded, bihtree.Tree(*mesh), rays)


REPLACE = """
import sys, time
import bihtree
trees = [bihtree.Tree.load(path) for path in sys.argv[1:3]]
for number in range(60):
    trees[number % 2].save(sys.argv[3])
"""


def test_loading_while_another_process_replaces_the_file(tmp_path):
    scenes = [meshes.terrain(30), meshes.box()]
    for name, mesh in zip("ab", scenes, strict=True):
        bihtree.Tree(*mesh).save(tmp_path / name)
    path = tmp_path / "tree"
    bihtree.Tree.load(tmp_path / "a").save(path)
    rays = around(scenes[1], 50, np.random.default_rng(6))
    expected = {len(mesh.triangles): bihtree.Tree(*mesh).intersect(*rays).t.tobytes() for mesh in scenes}
    command = [sys.executable, "-c", REPLACE, *(str(tmp_path / name) for name in ("a", "b", "tree"))]
    with subprocess.Popen(command, cwd=ROOT) as process:
        held = []
        while process.poll() is None:
            held = held[-5:] + [bihtree.Tree.load(path, mmap=len(held) % 2 == 0)]
            for loaded in held:
                assert loaded.intersect(*rays).t.tobytes() == expected[loaded.stats.triangles]
    assert process.returncode == 0
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a", "b", "tree"]


def test_threads_save_and_load(tmp_path):
    mesh = meshes.terrain(30)
    tree = bihtree.Tree(*mesh)
    tree.save(tmp_path / "tree")
    good = (tmp_path / "tree").read_bytes()

    def work():
        for _ in range(5):
            tree.save(tmp_path / "tree")
            bihtree.Tree.load(tmp_path / "tree").validate()

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (tmp_path / "tree").read_bytes() == good
    assert [each.name for each in tmp_path.iterdir()] == ["tree"]


def test_no_pickle():
    with pytest.raises(TypeError, match=r"pickle.*save"):
        pickle.dumps(bihtree.Tree(*meshes.box()))
