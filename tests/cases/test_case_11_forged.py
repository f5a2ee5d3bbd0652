"""Case 11: files with the right checksums over anything are a FileFormatError, or a tree that keeps every rule."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.rays import around
from tests.saved_file import FIELDS, SECTIONS, SavedFile, with_entry, with_field
from tests.small_files import SMALL, every_small, saved


def asked(data, folder, rays):
    """A file that loads must hold a tree that keeps every rule and answers every query; else it must be refused."""
    path = folder / "forged"
    path.write_bytes(data)
    try:
        tree = bihtree.Tree.load(path)
    except bihtree.FileFormatError:
        return False
    tree.validate()
    hits = tree.intersect(*rays)
    assert ((hits.triangle >= -1) & (hits.triangle < tree.stats.triangles)).all()
    tree.occluded(*rays)
    tree.traversal_cost(*rays)
    tree.nodes()
    tree.order()
    repr(tree.stats)
    return True


HUGE = [0, 1, 2, 3, 255, 2**8, 2**16, 2**28, 2**30, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63, 2**64 - 1]


@every_small
def test_forged_headers(variant, tmp_path):
    good = saved(variant, tmp_path)
    rays = around(meshes.box(), 60, np.random.default_rng(7))
    assert asked(good, tmp_path, rays)
    for name, (_, kind) in FIELDS.items():
        if kind in ("<d", "<f"):
            values = [np.nan, np.inf, -np.inf, -1.0, 1e30]
        else:
            most = 2 ** (8 * {"<B": 1, "<I": 4, "<Q": 8}[kind])
            values = [value for value in HUGE if value < most]
        for value in values:
            asked(with_field(good, name, value), tmp_path, rays)


@every_small
@pytest.mark.parametrize("section", SECTIONS)
def test_forged_places(variant, section, tmp_path):
    good = saved(variant, tmp_path)
    rays = around(meshes.box(), 60, np.random.default_rng(8))
    for key in ("start", "bytes", "item_bytes"):
        for value in HUGE:
            if value < 2**32 or key != "item_bytes":
                asked(with_entry(good, section, **{key: value}), tmp_path, rays)
    file = SavedFile.of(good)
    data, item = file.sections[section], file.items[section]
    for other in (b"", data[item:], data[:-item], data + data[:item], data + data, data[::-1], data + bytes(item)):
        asked(file.with_section(section, other).data(), tmp_path, rays)


@every_small
@pytest.mark.parametrize("section", SECTIONS)
def test_forged_words(variant, section, tmp_path):
    """Each word of a section in turn is something else."""
    file = SavedFile.of(saved(variant, tmp_path))
    rays = around(meshes.box(), 30, np.random.default_rng(9))
    words = np.frombuffer(file.sections[section].ljust(-(-len(file.sections[section]) // 4) * 4, b"\0"), "<u4")
    nan, infinity = (int(value.view(np.uint32)) for value in np.array([np.nan, np.inf], np.float32))
    others = [0, 1, 3, 2**28, 2**30, 2**31, 2**32 - 1, nan, infinity, 0x70000000, 0x80000000]
    rng = np.random.default_rng(10)
    for place in range(len(words)):
        for value in {int(other) for other in rng.choice(others, 3)} | {int(words[place]) ^ 1 << int(rng.integers(32))}:
            bad = words.copy()
            bad[place] = value
            data = bad.tobytes()[: len(file.sections[section])]
            asked(file.with_section(section, data).data(), tmp_path, rays)


def test_records_that_share_children(tmp_path):
    """A chain of records of which each has the next one eight times: 8^n ways down, and not one leaf."""
    file = SavedFile.of(saved(SMALL[0], tmp_path))
    records = []
    for number in range(60):
        record = np.frombuffer(file.sections["nodes"][:256], "<u4").copy()
        record[:24], record[24:48] = np.array([-np.inf, np.inf], "<f4").view("<u4")
        record[48:56] = number + 1
        records.append(record)
    bad = file.with_section("nodes", b"".join(record.tobytes() for record in records)).data()
    assert not asked(bad, tmp_path, around(meshes.box(), 5, np.random.default_rng(11)))


def test_kd_nodes_that_share_children(tmp_path):
    """The same with empty leaves: a Fibonacci number of ways down."""
    file = SavedFile.of(saved(SMALL[3], tmp_path))
    nodes = np.array([[number + 1 << 2 | number % 3, 0] for number in range(60)] + [[3, 0], [3, 0]], "<u4")
    bad = file.with_section("nodes", nodes.tobytes()).data()
    assert not asked(bad, tmp_path, around(meshes.box(), 5, np.random.default_rng(12)))
