"""Commands that need no Blender: parts of the work kept and left out, and the tables."""

from __future__ import annotations

import numpy as np

from tests.blender.commands import pixels, run
from tests.meshes import icosphere


def test_tables_are_printed_and_written(out):
    done = run("tables", "--quick", "--output", out)
    assert done.returncode == 0
    assert (out / "tables.md").read_text() == done.stdout
    assert "### Bucket sort" in done.stdout
    assert "bucket sort: scan by formula" in done.stderr
    assert [path.name for path in out.iterdir()] == ["tables.md"]
    for wrong in (("--airframe-triangles", "5"), ("--dragon", out / "none.ply"), ("--dragon", out / "none.obj")):
        done = run("tables", "--quick", "--output", out, *wrong)
        assert done.returncode in {1, 2}
        assert len(done.stderr.splitlines()) <= 2 and "Traceback" not in done.stderr


def test_parts_are_kept_and_left_out_as_asked(out, tmp_path):
    """With the same picture; what it cost may differ where double precision or a tree over trees is kept."""
    vertices, triangles = icosphere(3)
    mesh = tmp_path / "ball.npz"
    np.savez(mesh, vertices=vertices, triangles=triangles)
    pictures = []
    for number, choice in enumerate(((), ("--keep", "all"), ("--leave-out", "bucket-sort,threads", "--keep", "tree"))):
        passes = ("--passes", "combined,depth,normal,position,triangle")
        done = run("render", "--mesh", mesh, "--output", out / f"{number}.exr", *passes, *choice)
        assert (done.returncode, done.stderr) == (0, "")
        pictures.append(pixels(out / f"{number}.exr"))
        kept = {line.split("  ")[0]: "kept" in line for line in done.stdout.split("\n\n")[1].splitlines()}
        if choice[:2] == ("--keep", "all"):
            assert kept["bucket sort"] and kept["world transform"]
    assert not kept["threads"]
    assert np.array_equal(pictures[0], pictures[1], equal_nan=True)
    assert np.array_equal(pictures[0], pictures[2], equal_nan=True)
    wrong = run("render", "--mesh", mesh, "--output", out / "a.png", "--keep", "roof")
    assert wrong.returncode == 2
    assert "unknown part 'roof'" in wrong.stderr
