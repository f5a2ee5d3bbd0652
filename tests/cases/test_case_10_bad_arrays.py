"""Case 10: wrong shapes, dtypes and rows are errors that name the argument; layouts that NumPy allows are not."""

import subprocess
import sys

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.agreement import assert_same
from tests.many_rays import assert_many_true, at_weak_places
from tests.rays import Rays, around
from tests.variants import every_precision, every_tree_of_many_rays

BOX = meshes.box()
ORIGINS, DIRECTIONS = np.zeros((4, 3)), np.ones((4, 3))

BAD_VERTICES = {
    "two columns": np.zeros((6, 2), np.float32),
    "one axis": np.zeros(9, np.float32),
    "three axes": np.zeros((2, 3, 3), np.float32),
    "a number": 3.0,
    "complex": np.zeros((6, 3), np.complex64),
    "objects": np.full((6, 3), None),
    "strings": np.full((6, 3), "1"),
    "text": "vertices",
}


@pytest.mark.parametrize("vertices", BAD_VERTICES.values(), ids=BAD_VERTICES)
def test_vertices(vertices):
    with pytest.raises(bihtree.GeometryError, match="vertices"):
        bihtree.Tree(vertices)
    with pytest.raises(bihtree.GeometryError, match="vertices"):
        bihtree.Tree(vertices, [[0, 1, 2]])


def test_a_soup_whose_length_is_not_a_multiple_of_three():
    with pytest.raises(bihtree.GeometryError, match=r"vertices.*\b7\b"):
        bihtree.Tree(np.zeros((7, 3)))


BAD_TRIANGLES = {
    "four columns": np.zeros((2, 4), np.int32),
    "one axis": np.zeros(6, np.int32),
    "floats": np.zeros((2, 3), np.float64),
    "complex": np.zeros((2, 3), np.complex128),
    "objects": np.full((2, 3), None),
    "strings": np.full((2, 3), "0"),
}


@pytest.mark.parametrize("triangles", BAD_TRIANGLES.values(), ids=BAD_TRIANGLES)
def test_triangles(triangles):
    with pytest.raises(bihtree.GeometryError, match="triangles"):
        bihtree.Tree(BOX.vertices, triangles)


@pytest.mark.parametrize("dtype", [np.int8, np.int16, np.int32, np.int64, np.uint8, np.uint16, np.uint32, np.uint64])
def test_every_integer_dtype_of_rows(dtype):
    tree = bihtree.Tree(BOX.vertices, BOX.triangles.astype(dtype))
    assert tree.intersect([[0.5, 0.25, 0.5]], [[1.0, 0, 0]]).triangle.tolist() == [3]
    rows = BOX.triangles.astype(dtype)
    rows[7, 1] = 8
    with pytest.raises(bihtree.GeometryError, match=r"triangles.*\b7\b.*\b8\b"):
        bihtree.Tree(BOX.vertices, rows)


@pytest.mark.parametrize("value", [-1, -(2**31), 2**31, 2**32, 2**32 + 1, 2**62, -(2**62)])
@pytest.mark.parametrize("copy", [True, False])
def test_rows_out_of_range(value, copy):
    rows = BOX.triangles.astype(np.int64)
    rows[5, 2] = value
    with pytest.raises(bihtree.GeometryError, match=rf"triangles.*\b5\b.*{value}\b"):
        bihtree.Tree(BOX.vertices, rows, copy=copy)


def test_an_unsigned_row_beyond_every_signed_one():
    rows = BOX.triangles.astype(np.uint64)
    rows[0, 0] = 2**64 - 1
    with pytest.raises(bihtree.GeometryError, match=r"triangles.*\b0\b.*18446744073709551615"):
        bihtree.Tree(BOX.vertices, rows)


def test_rows_without_vertices():
    with pytest.raises(bihtree.GeometryError, match=r"triangles.*\b0\b.*\b0\b"):
        bihtree.Tree(np.empty((0, 3), np.float32), [[0, 0, 0]])


BAD_RAYS = {
    "two columns": np.zeros((4, 2)),
    "one axis": np.zeros(4),
    "three axes": np.zeros((4, 3, 1)),
    "complex": np.zeros((4, 3), complex),
    "objects": np.full((4, 3), None),
    "strings": np.full((4, 3), "1"),
}
QUERIES = [bihtree.Tree.intersect, bihtree.Tree.occluded, bihtree.Tree.traversal_cost]
every_query = pytest.mark.parametrize("query", QUERIES, ids=lambda query: query.__name__)


@every_query
@pytest.mark.parametrize("bad", BAD_RAYS.values(), ids=BAD_RAYS)
def test_rays(query, bad):
    tree = bihtree.Tree(*BOX)
    with pytest.raises(bihtree.GeometryError, match="origins"):
        query(tree, bad, DIRECTIONS)
    with pytest.raises(bihtree.GeometryError, match="directions"):
        query(tree, ORIGINS, bad)


@every_query
def test_as_many_directions_as_origins(query):
    tree = bihtree.Tree(*BOX)
    for count in (0, 1, 3, 5):
        with pytest.raises(bihtree.GeometryError, match=rf"directions.*{count}.*4|origins.*4.*{count}"):
            query(tree, ORIGINS, np.ones((count, 3)))


@pytest.mark.parametrize("query", QUERIES[:2], ids=lambda query: query.__name__)
@pytest.mark.parametrize("name", ["t_min", "t_max"])
def test_limits(query, name):
    tree = bihtree.Tree(*BOX)
    for bad in (np.zeros(3), np.zeros(5), np.zeros((4, 1)), np.zeros((1, 4)), np.zeros(0), "1", [None] * 4, 1j):
        with pytest.raises(bihtree.GeometryError, match=name):
            query(tree, ORIGINS, DIRECTIONS, **{name: bad})


def layouts(array):
    """The same values laid out in every way that NumPy allows."""
    frozen = array.copy()
    frozen.flags.writeable = False
    bytes_apart = np.zeros(len(array), [("pad", "i1"), ("point", array.dtype, 3)])
    bytes_apart["point"] = array
    return {
        "plain": array,
        "read-only": frozen,
        "fortran": np.asfortranarray(array),
        "every second row": np.repeat(array, 2, axis=0)[::2],
        "reversed twice": array[::-1].copy()[::-1],
        "columns of a wider array": np.hstack([array, array])[:, :3],
        "unaligned": bytes_apart["point"],
        "big-endian": array.astype(array.dtype.newbyteorder(">")),
        "list": array.tolist(),
    }


@every_precision
def test_layouts_of_rays(variant):
    mesh = meshes.icosphere(2)
    tree = variant.tree(*mesh)
    rays = around(mesh, 64, np.random.default_rng(1))
    limits = np.linspace(0, 3, 64)
    expected = tree.intersect(*rays, t_min=limits)
    assert 10 < expected.hit.sum() < 64
    for origins, directions in zip(layouts(rays.origins).values(), layouts(rays.directions).values(), strict=True):
        assert_same(tree.intersect(origins, directions, t_min=limits), expected)
        assert_same(
            tree.intersect(origins, rays.directions.astype(np.float64), t_min=np.repeat(limits, 3)[::3]), expected
        )
        assert np.array_equal(tree.occluded(origins, directions, t_min=limits.tolist()), expected.hit)


@every_precision
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_layouts_of_meshes(variant, dtype):
    mesh = meshes.icosphere(2, dtype=dtype)
    rays = around(mesh, 64, np.random.default_rng(1))
    expected = variant.tree(*mesh).intersect(*rays)
    for name, vertices in layouts(mesh.vertices).items():
        if name != "list":  # a list of numbers is float64
            assert_same(variant.tree(vertices, mesh.triangles).intersect(*rays), expected)
    for triangles in layouts(mesh.triangles).values():
        assert_same(variant.tree(mesh.vertices, triangles).intersect(*rays), expected)


@every_precision
def test_lists_of_whole_numbers(variant):
    tree = variant.tree([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    assert tree.intersect([[0, 0, 1]], [[0, 0, -1]], t_min=1, t_max=1).hit.tolist() == [True]


@every_precision
def test_a_copy_is_not_changed_by_its_source(variant):
    mesh = meshes.icosphere(2)
    rays = around(mesh, 64, np.random.default_rng(1))
    vertices, triangles = mesh.vertices.copy(), mesh.triangles.copy()
    tree = variant.tree(vertices, triangles)
    expected = tree.intersect(*rays)
    vertices[:] = np.nan
    triangles[:] = -5
    assert_same(tree.intersect(*rays), expected)
    tree.validate()


@every_precision
@pytest.mark.parametrize("dtype", [np.int32, np.uint32])
def test_borrowed_arrays_become_read_only(variant, dtype):
    mesh = meshes.icosphere(2)
    rays = around(mesh, 64, np.random.default_rng(1))
    expected = variant.tree(*mesh).intersect(*rays)
    vertices, triangles = mesh.vertices.copy(), mesh.triangles.astype(dtype)
    tree = variant.tree(vertices, triangles, copy=False)
    assert not vertices.flags.writeable and not triangles.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        vertices[0] = 0
    assert_same(tree.intersect(*rays), expected)
    assert tree.stats.mesh_bytes == 0
    del vertices, triangles
    assert_same(tree.intersect(*rays), expected)


@pytest.mark.parametrize("rows", [[[0, 1, 8]], [[0, 1, -1]], [[0.5, 1, 2]]])
def test_arrays_that_were_refused_stay_as_they_were(rows):
    """An error is raised before anything is changed."""
    vertices, triangles = BOX.vertices.copy(), np.array(rows)
    with pytest.raises(bihtree.GeometryError, match="triangles"):
        bihtree.Tree(vertices, triangles, copy=False)
    assert vertices.flags.writeable and triangles.flags.writeable
    with pytest.raises(ValueError, match="layout"):
        bihtree.Tree(vertices, BOX.triangles.copy(), copy=False, layout="tall")
    assert vertices.flags.writeable


@every_precision
def test_borrowed_arrays_changed_by_force_are_no_crash(variant):
    """The caller may make them writable again: answers are then about nothing, but memory stays sound."""
    mesh = meshes.icosphere(2)
    rays = around(mesh, 64, np.random.default_rng(1))
    vertices, triangles = mesh.vertices.copy(), mesh.triangles.astype(np.uint32)
    tree = variant.tree(vertices, triangles, copy=False)
    vertices.flags.writeable = triangles.flags.writeable = True
    for vertex, row in [(np.nan, 0), (np.inf, 161), (3e38, 2**32 - 1), (0.0, 10**6)]:
        vertices[::3], triangles[::2] = vertex, row
        hits = tree.intersect(*rays)
        assert len(hits) == 64 and (hits.triangle < len(triangles)).all()
        tree.occluded(*rays), tree.traversal_cost(*rays), tree.nodes()
    triangles[:] = 2**32 - 1
    if tree.stats.layout == "classic":  # wide leaves keep their own vertices
        assert not tree.intersect(*rays).hit.any()
    with pytest.raises(bihtree.BihError):
        tree.validate()


HUGE = """
import resource
import sys
import numpy as np
import bihtree

resource.setrlimit(resource.RLIMIT_AS, (12 << 30, 12 << 30))
rows = np.broadcast_to(np.array([[0, 1, 2]], np.{dtype}), (2**31, 3))
points = np.broadcast_to(np.zeros((1, 3), np.float32), (3 * 2**31, 3))
for arguments in ((np.zeros((3, 3), np.float32), rows), (points,)):
    for copy in (True, False):
        try:
            bihtree.Tree(*arguments, copy=copy)
        except bihtree.GeometryError as error:
            print(error)
        else:
            sys.exit("no error")
"""


@pytest.mark.skipif(
    sys.platform != "linux", reason="RLIMIT_AS, which keeps a mistake from taking all memory, is Linux's"
)
@pytest.mark.parametrize("dtype", ["int32", "uint32", "int64"])
def test_two_to_the_31_triangles_announced(dtype):
    """Arrays without memory behind them, refused before anything is copied."""
    done = subprocess.run([sys.executable, "-c", HUGE.format(dtype=dtype)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("2147483648") == 4, done.stdout


@every_tree_of_many_rays
def test_a_hundred_thousand_rays(variant):
    """A third each in arrays that NumPy allows and few send: a tree of the mesh in the same layout answers."""
    mesh = meshes.icosphere(1)
    rays = at_weak_places(mesh)
    for first, name in enumerate(("fortran", "unaligned", "big-endian")):
        vertices = layouts(mesh.vertices)[name]
        some = Rays(layouts(rays.origins[first::3])[name], layouts(rays.directions[first::3])[name])
        assert_many_true(variant, meshes.Triangles(vertices, mesh.triangles), some)
