"""Options that are not there yet, or never will be, are ValueErrors that name the argument; trees are not pickled."""

import copy
import pickle

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.variants import OWN

BOX = meshes.box()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("structure", "octree"),
        ("structure", "kd-tree"),
        ("structure", "BVH"),
        ("structure", "BIH"),
        ("structure", ""),
        ("layout", "tall"),
        ("layout", "Compact"),
        ("build", "later"),
        ("build", "on demand"),
        ("heuristic", "SAH"),
        ("heuristic", "none"),
        ("precision", "Exact"),
        ("precision", "double"),
        ("leaf_size", 0),
        ("leaf_size", -1),
        ("threads", -1),
    ],
)
def test_a_value_that_is_not_offered(name, value):
    with pytest.raises(ValueError, match=name) as caught:
        bihtree.Tree(*BOX, **{name: value})
    assert str(value) in str(caught.value)
    assert not isinstance(caught.value, bihtree.GeometryError)


@pytest.mark.parametrize(
    ("name", "value"), [("structure", 3), ("leaf_size", "4"), ("leaf_size", 1.5), ("threads", None), ("progress", 7)]
)
def test_a_value_of_the_wrong_type(name, value):
    with pytest.raises((TypeError, ValueError), match=name):
        bihtree.Tree(*BOX, **{name: value})


@pytest.mark.parametrize("heuristic", ["local", "sah"])
def test_the_bucket_sort_is_of_the_global_heuristic(heuristic):
    with pytest.raises(ValueError, match=r"presort.*heuristic"):
        bihtree.Tree(*BOX, presort=True, heuristic=heuristic)
    for presort in (None, False):
        assert not bihtree.Tree(*BOX, presort=presort, heuristic=heuristic).stats.presorted


@pytest.mark.parametrize(
    ("structure", "name", "value"),
    [
        ("kd_tree", "layout", "wide"),
        ("kd_tree", "layout", "compact"),
        ("kd_tree", "heuristic", "global"),
        ("kd_tree", "heuristic", "local"),
        ("kd_tree", "presort", True),
        ("kd_tree", "leaf_size", 4),
        ("bvh", "layout", "classic"),
        ("bvh", "heuristic", "global"),
        ("bvh", "heuristic", "local"),
        ("bvh", "presort", True),
    ],
)
def test_options_that_do_not_go_together_are_both_named(structure, name, value):
    with pytest.raises(ValueError, match=f"structure.*{structure}.*{name}.*{value}") as caught:
        bihtree.Tree(*BOX, structure=structure, **{name: value})
    assert not isinstance(caught.value, bihtree.GeometryError)


@pytest.mark.parametrize(
    ("structure", "layouts", "heuristics"),
    [
        ("bih", ("classic", "wide", "compact"), ("global", "local", "sah")),
        ("kd_tree", ("classic",), ("sah",)),
        ("bvh", ("wide", "compact"), ("sah",)),
    ],
)
def test_options_that_go_together(structure, layouts, heuristics):
    """What is not given is the structure's own."""
    for layout in (None, *layouts):
        for heuristic in (None, *heuristics):
            given = {"layout": layout, "heuristic": heuristic}
            options = {name: value for name, value in given.items() if value is not None}
            stats = bihtree.Tree(*BOX, structure=structure, presort=False, **options).stats
            expected = (structure, layout or OWN[structure][0], heuristic or OWN[structure][1])
            assert (stats.structure, stats.layout, stats.heuristic) == expected


def test_an_unknown_option():
    with pytest.raises(TypeError, match="colour"):
        bihtree.Tree(*BOX, colour="red")


def test_options_are_keywords():
    with pytest.raises(TypeError):
        bihtree.Tree(*BOX, "bih")


def test_what_is_offered():
    tree = bihtree.Tree(
        *BOX, structure="bih", layout="wide", build="eager", heuristic="global", presort=False,
        precision="watertight", leaf_size=None, threads=0, copy=True, progress=None,
    )  # fmt: skip
    assert tree.nodes().tobytes() == bihtree.Tree(*BOX, presort=None).nodes().tobytes()


def test_more_threads_than_cores():
    assert bihtree.Tree(*BOX, threads=64).intersect([[0.5, 0.25, 0.5]], [[1.0, 0, 0]]).triangle.tolist() == [3]


def test_errors_are_what_a_caller_expects():
    assert issubclass(bihtree.BihError, Exception)
    assert issubclass(bihtree.GeometryError, bihtree.BihError) and issubclass(bihtree.GeometryError, ValueError)
    assert issubclass(bihtree.FileFormatError, bihtree.BihError) and issubclass(bihtree.FileFormatError, ValueError)
    assert issubclass(bihtree.Cancelled, bihtree.BihError) and not issubclass(bihtree.Cancelled, ValueError)


def test_pickling_is_refused():
    tree = bihtree.Tree(*BOX)
    hits = tree.intersect(np.zeros((1, 3)), np.ones((1, 3)))
    for value in (tree, hits, tree.stats):
        with pytest.raises(TypeError, match=type(value).__name__):
            pickle.dumps(value)
    with pytest.raises(TypeError, match="Tree"):
        copy.copy(tree)


def test_final_classes():
    for base in (bihtree.Tree, bihtree.Hits, bihtree.Stats, bihtree.Camera):
        with pytest.raises(TypeError):
            type("Derived", (base,), {})


def test_version():
    assert bihtree.__version__.split(".")[0].isdigit()
