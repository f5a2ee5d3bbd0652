"""The report's other sections: sweeps, the picture, and what was left out."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from addon.pipeline import image
from addon.pipeline.camera import framing_view
from addon.pipeline.mesh import Mesh, bounds_of
from addon.pipeline.scene import SceneData
from addon.pipeline.settings import PRECISIONS, Settings
from addon.report.error import report, stability, stability_page, svg_plot
from addon.report.error.image_error import flip
from addon.report.error.methods import FAST, WATERTIGHT, Naive, Ours
from addon.report.error.options import Options
from addon.report.error.stability import Row, Stability, broken_at, chosen_ks
from addon.report.error.subject import Subject
from addon.report.sweeps import SWEEPS
from tests import meshes

OPTIONS = Options(
    rays=200,
    rounds=1,
    width=40,
    samples=4,
    steps=2,
    sweep_rays=40,
    pairs=2,
    sections=("image", "stability", "left out"),
)


@pytest.fixture(scope="module")
def results():
    ball = meshes.icosphere(3)
    view = framing_view(bounds_of(ball.vertices), 80, 60)
    subject = Subject(SceneData.of_mesh(Mesh("ball", *ball), view), Settings(), "ball")
    methods = [Ours(FAST, {"precision": "fast"}), Ours(WATERTIGHT), Naive()]
    return report.measured(subject, OPTIONS, methods, lambda line, share: None)


def test_every_sweep_has_its_ends_for_every_method_and_ours_is_right(results):
    rows = results.stability.rows
    for sweep in SWEEPS.values():
        for name in (FAST, WATERTIGHT, Naive().name):
            ks = [row.k for row in results.stability.of(sweep.name, name)]
            assert ks == sorted({sweep.ks[0], 0, sweep.ks[-1]})
    # A thousand million sizes away single precision has made a point of the mesh.
    hits = {k: row.hits for row in results.stability.of("offset", WATERTIGHT) if (k := row.k) in (0, 9)}
    assert hits[0] > 10 and hits[9] == 0
    for row in rows:
        assert row.rays > 0 and row.nanoseconds_a_ray.count == 1
        if row.name == WATERTIGHT:
            assert row.wrong_a_million == 0
            assert row.t_error_max is None or row.t_error_max <= 1
    assert any(row.wrong_a_million for row in rows if row.name == FAST)
    assert results.stability.breaks["magnitude"][FAST] == (-140, 120)
    assert all(WATERTIGHT not in found for found in results.stability.breaks.values())


def test_ks_are_spread_and_have_the_ends():
    assert chosen_ks(SWEEPS["direction"], 4) == (0, 15, 30, 45)
    assert chosen_ks(SWEEPS["offset"], 16) == tuple(range(10))


def test_a_break_is_the_least_stiff_of_those_that_are_far_worse():
    def row(k: int, wrong: int, neighbours: int = 0) -> Row:
        return Row("a", "b", k, 100, 0, wrong, neighbours, None, None, None, None)

    assert broken_at([row(0, 0), row(1, 1), row(2, 2), row(3, 50)]) == (2,)
    assert broken_at([row(0, 10), row(1, 40), row(2, 41)]) == (2,)
    assert broken_at([row(0, 0), row(1, 60, 60)]) == ()
    assert broken_at([row(-9, 50), row(-1, 3), row(1, 0), row(0, 0)]) == (-1,)
    assert broken_at([row(-9, 50), row(-1, 3), row(0, 0), row(2, 0), row(5, 9), row(7, 9)]) == (-1, 5)
    assert broken_at([]) == ()


def test_curves_mark_the_break(results):
    plots = stability_page.plots(results.stability)
    assert len(plots) == 4 * len(SWEEPS)
    plot = next(plot for plot in plots if plot.name == "stability-magnitude-wrong")
    marked = {series.name for series in plot.series for point in series.points if point.is_marked}
    assert FAST in marked and WATERTIGHT not in marked
    assert stability_page.plots(Stability()) == []
    assert stability.measure.__doc__


def test_more_samples_have_less_error(results):
    found = results.image
    assert [(row.samples, row.name) for row in found.rows] == [(n, name) for n in (1, 2, 4) for name in PRECISIONS]
    assert (found.size, found.reference_samples) == ("40 x 30", 32)
    errors = {(row.name, row.samples): row for row in found.rows}
    for name in PRECISIONS:
        one, two = errors[name, 1], errors[name, 4]
        assert 0 < two.rmse < one.rmse < 0.2
        assert two.psnr > one.psnr
        assert (two.flip is None) == isinstance(flip(), str)
        assert one.flip is None or 0 < two.flip < 1
        assert one.build_seconds < one.seconds.median
    if image.version():
        assert len(found.pictures) == 3
        assert all(png.startswith(b"\x89PNG") for png in found.pictures.values())


def test_what_is_left_out_is_forced_on(results):
    rows = {row.name: row for row in results.left_out.rows}
    assert not rows["world transform"].kept and rows["world transform"].forced.count == OPTIONS.pairs
    assert rows["combined pass"].kept and rows["combined pass"].forced is None
    for row in rows.values():
        assert (row.forced is None) == (row.without is None) == (row.ratio is None)
    assert rows["all of them"].ratio.least > 0


def test_all_of_it_is_in_the_files(results, tmp_path):
    report.write(results, tmp_path)
    read = json.loads((tmp_path / "results.json").read_text())
    assert len(read["stability"]["rows"]) == len(results.stability.rows)
    with (tmp_path / "results.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert {"image", "stability", "left out"} == {line["section"] for line in lines}
    ks = {int(line["k"]) for line in lines if line["name"] == f"magnitude: {FAST}"}
    assert ks == {-140, 0, 120}
    page = (tmp_path / "index.html").read_text()
    for title in ("Image", "Stability", "What was left out"):
        assert f"<h2>{title}</h2>" in page
    if not svg_plot.why_missing():
        # pygal draws what is finite.
        assert "nan" not in page.lower().replace("nanosec", "")
    assert Path(tmp_path / "index.html").stat().st_size < 3_000_000


def test_flip_is_nothing_for_the_same_picture():
    difference = flip()
    if isinstance(difference, str):
        pytest.skip(difference)
    picture = np.random.default_rng(1).random((16, 16, 3)).astype(np.float32)
    assert difference(picture, picture) == 0
