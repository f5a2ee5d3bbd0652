"""The report: what it counts, what it writes, and how it ends."""

from __future__ import annotations

import csv
import json
import re
from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path
from time import sleep

import bihtree
import numpy as np
import pytest

from addon.pipeline.camera import framing_view
from addon.pipeline.errors import UserError
from addon.pipeline.mesh import Mesh, bounds_of
from addon.pipeline.scene import SceneData
from addon.pipeline.settings import Settings
from addon.report import error_arguments
from addon.report.error import command, hits_page, html_page, page, png_plot, report, svg_plot
from addon.report.error.comparison import compared, leaks, neighbours, ulp
from addon.report.error.decided import MEANS, Decided, decided
from addon.report.error.hits import Hits, Row, Span
from addon.report.error.methods import EXACT, WATERTIGHT, Answers, Embree, Naive, Ours
from addon.report.error.options import Options
from addon.report.error.pareto import front
from addon.report.error.rays import SHARES, Rays
from addon.report.error.subject import Subject, built_in
from addon.report.error.truth import Truth
from tests import meshes
from tests.rays import at_features

SMALL = Options(rays=300, rounds=1, sections=("hits",))


def subject_of(mesh: meshes.Triangles, name: str = "ball") -> Subject:
    view = framing_view(bounds_of(mesh.vertices), 64, 48)
    return Subject(SceneData.of_mesh(Mesh(name, *mesh), view), Settings(), name)


def silent(line: str, share: float) -> None:
    pass


class Wrong:
    """A method that misses every hit of even triangles, and says what the tree says of the others."""

    name, note = "wrong", "on purpose"

    def missing(self) -> str:
        return ""

    def every(self, mesh: Mesh, rays: int) -> int:
        return 1

    def build(self, mesh: Mesh) -> Wrong:
        self.tree = bihtree.Tree(mesh.vertices, mesh.triangles)
        return self

    def trace(self, rays: Rays) -> Answers:
        hits = self.tree.intersect(*rays)
        keep = hits.triangle % 2 == 1
        return Answers(np.where(keep, hits.triangle, -1), np.where(keep, hits.t, np.inf))

    def bytes(self) -> None:
        return None

    def nodes(self, rays: Rays) -> None:
        return None


class Missing(Wrong):
    name = "elsewhere"

    def missing(self) -> str:
        return "it is not installed"


@pytest.fixture(scope="module")
def results():
    methods = [
        Ours(WATERTIGHT),
        Ours(EXACT, {"precision": "exact"}),
        Wrong(),
        Missing(),
        Embree("embreex", True),
        Naive(),
    ]
    return report.measured(subject_of(meshes.icosphere(2)), SMALL, methods, silent)


def test_ours_is_never_wrong_and_the_wrong_one_is_found_out(results):
    ours, wrong = results.hits.row(WATERTIGHT), results.hits.row("wrong")
    assert (ours.wrong, ours.leaks) == (0, 0)
    assert 0 < ours.t_error_max <= 1
    hit = sum(kind["hit"] for kind in results.hits.rays.values())
    assert wrong.wrong == wrong.missed > hit / 3
    assert wrong.wrong_a_million == 1e6 * wrong.missed / wrong.rays
    # From inside a closed ball every aimed ray hits.
    assert wrong.leaks == wrong.wrong_by_kind["at vertices"] + wrong.wrong_by_kind["at edges"] > 0


def test_tests_are_decided_by_one_means_each(results):
    assert list(results.hits.decided) == list(SHARES)
    for found in results.hits.decided.values():
        assert list(found.tests) == list(found.rays) == list(MEANS)
        assert found.tests_a_ray > 1 and sum(found.tests.values()) == pytest.approx(1)
        shares = list(found.rays.values())
        assert shares == sorted(shares, reverse=True) and 0 <= min(found.tests.values())
    assert (
        results.hits.decided["at vertices"].rays["double precision"]
        > results.hits.decided["camera"].rays["double precision"]
    )
    # The first ray has no room in single precision; of the second one test is left over to big integers.
    found = decided(np.int32([[0, 4, 0, 0, 0], [6, 3, 2, 1, 1]]))
    assert found.tests_a_ray == 5
    assert list(found.tests.values()) == [0.3, 0.5, 0.1, 0, 0.1]
    assert list(found.rays.values()) == [0.5, 1, 0.5, 0.5, 0.5]


def test_rays_are_of_every_kind(results):
    assert list(results.hits.rays) == list(SHARES)
    for kind, share in SHARES.items():
        assert results.hits.rays[kind]["rays"] == pytest.approx(share * SMALL.rays, rel=0.15)
    for kind in ("at vertices", "at edges"):
        assert results.hits.rays[kind]["hit"] == results.hits.rays[kind]["rays"]
    assert sum(kind["ties"] for kind in results.hits.rays.values()) > 0


def test_the_naive_one_is_given_few_rays_and_a_missing_one_none(results):
    naive = next(row for row in results.hits.rows if row.name == Naive().name)
    assert naive.every == 1 and Naive().every(Mesh("", np.eye(3), np.zeros((10**6, 3), np.int32)), 1000) == 100
    missing = next(row for row in results.hits.rows if row.name == "elsewhere")
    assert missing.missing == "it is not installed" and not missing.rays


def test_a_slow_method_is_given_fewer_rays():
    class Slow(Wrong):
        name = "slow"

        def trace(self, rays: Rays) -> Answers:
            sleep(0.001 * len(rays.origins))
            return super().trace(rays)

    options = replace(SMALL, rays=1000, patience=0.1)
    found = report.measured(subject_of(meshes.icosphere(1)), options, [Slow(), Ours(WATERTIGHT)], silent)
    slow, ours = found.hits.row("slow"), found.hits.row(WATERTIGHT)
    assert slow.every >= 5 and slow.rays * slow.every == pytest.approx(1000, rel=0.3)
    assert ours.wrong == 0 and slow.missed > 0
    assert ours.rays * ours.every == pytest.approx(1000, rel=0.3)
    for ray in found.hits.beside:
        assert ray["worst_of"] == ["slow"]
        assert ray["answers"]["slow"]["triangle"] == -1 and ray["truth"]["triangle"] >= 0
        assert ray["answers"]["slow"]["is_wrong"] and not ray["answers"][WATERTIGHT]["is_wrong"]
        assert ray["answers"][WATERTIGHT]["t"] == pytest.approx(ray["truth"]["t"])
    assert found.hits.beside


@pytest.mark.parametrize(("seconds", "calls"), [(0.2, (2, 7)), (0.01, range(1, 21))])
def test_a_method_that_had_to_wait_at_first_is_given_all_rays(seconds, calls):
    class Held(Wrong):
        call = 0

        def trace(self, rays: Rays) -> Answers:
            self.call += 1
            sleep(seconds if self.call in calls else 0)
            return super().trace(rays)

    options = replace(SMALL, rays=1000, patience=1.0)
    found = report.measured(subject_of(meshes.icosphere(1)), options, [Held()], silent)
    assert found.hits.row("wrong").every == 1


def test_methods_that_are_worst_at_one_ray_are_all_named():
    class Twin(Wrong):
        name = "twin"

    found = report.measured(subject_of(meshes.icosphere(1)), SMALL, [Wrong(), Twin(), Ours(WATERTIGHT)], silent)
    assert found.hits.beside and all(ray["worst_of"] == ["wrong", "twin"] for ray in found.hits.beside)
    assert "<th>worst of wrong, twin; " in page.text(found)


def test_the_front_is_marked(results):
    ours, wrong = results.hits.row(WATERTIGHT), results.hits.row("wrong")
    assert "nodes" in ours.fronts or "bytes" in ours.fronts or "seconds" in ours.fronts
    assert "bytes" not in wrong.fronts and "nodes" not in wrong.fronts
    marked = {
        plot.name: {point.label for series in plot.series for point in series.points if point.is_marked}
        for plot in hits_page.plots(results.hits)
    }
    assert all(marked.values())
    # Nobody's t is nearer to the truth.
    assert EXACT in marked["hits-precision"] and ("nodes" in ours.fronts) == (WATERTIGHT in marked["hits-nodes"])


def test_few_rays_are_counted_and_not_made_millions():
    found = Hits(rows=[Row("few", "", every=100, rays=20, aimed=4, total=Span(1.0, 1.0, 1.0, 1))])
    found.rows[0].wrong_by_kind, found.rays = (
        {"camera": 0},
        {"camera": {"rays": 20, "hit": 1, "ties": 0, "in whole numbers": 0}},
    )
    found.decided = {"camera": Decided(1e6, {MEANS[0]: 1 - 2e-6, MEANS[1]: 2e-6}, dict.fromkeys(MEANS, 0.0))}
    assert "few, 20 rays" in {series.name for plot in hits_page.plots(found) for series in plot.series}
    text = "".join(hits_page.section(found))
    assert text.count("one ray in 100") == 2 and text.count("of 20 rays") == 2
    assert "99.9998 %" in text and "100.000 %" not in text


def test_fronts():
    assert front({"a": (1, 5), "b": (2, 3), "c": (3, 3), "d": (4, 0), "e": (5, 1)}) == {"a", "b", "d"}
    assert front({"a": (1, 1), "b": (1, 1)}) == {"a", "b"}
    assert front({}) == set()


def test_every_number_is_in_the_files_and_the_page_needs_nothing_else(results, tmp_path):
    written = report.write(results, tmp_path)
    assert written[-1] == tmp_path / "index.html"
    read = json.loads((tmp_path / "results.json").read_text())
    assert read["schema"] == 2 and read["incomplete"] == ""
    assert {"scene", "source", "triangles", "options", "machine", "notes", "hits", "seconds"} <= set(read)
    assert read["triangles"] == 320 and read["machine"]["processor"]
    row = next(row for row in read["hits"]["rows"] if row["name"] == WATERTIGHT)
    assert {"missed", "false_hits", "other_triangle", "leaks", "t_error_max", "t_error_999", "bytes_a_triangle"} <= set(
        row
    )
    assert row["total"]["least"] <= row["total"]["median"] <= row["total"]["most"] and row["total"]["count"] == 1
    with (tmp_path / "results.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert {"hits"} == {line["section"] for line in lines}
    assert [line["value"] for line in lines if line["name"] == "wrong" and line["quantity"] == "missed"] == [
        str(results.hits.row("wrong").missed)
    ]
    text = (tmp_path / "index.html").read_text()
    assert text.count("<svg") == (0 if svg_plot.why_missing() else 4)
    assert len([path for path in written if path.suffix == ".png"]) == (0 if png_plot.why_missing() else 4)
    assert not re.findall(r"<(?:script|link|iframe|object)", text)
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:|#)[^"']*|url\((?!data:|#)[^)]*|@import""", text)
    assert "@media print" in text and "elsewhere: left out, it is not installed" in text


def test_a_number_stays_on_its_line():
    assert html_page.table(["t"], [["9.3e-10"], ["a-1, e-mail"]]).count("<td>9.3e−10</td>") == 1
    assert "a-1, e-mail" in html_page.table(["t"], [["a-1, e-mail"]])


def test_what_stopped_half_way_is_kept(tmp_path):
    told = []

    def stop(line, share):
        told.append(share)
        if "Wrong" in line or "wrong" in line:
            raise KeyboardInterrupt

    found = report.measured(subject_of(meshes.icosphere(1)), SMALL, [Ours(WATERTIGHT), Wrong()], stop)
    assert found.incomplete == "interrupted"
    assert found.hits.row(WATERTIGHT).rays and not found.hits.row("wrong")
    report.write(found, tmp_path)
    assert "Incomplete: interrupted" in (tmp_path / "index.html").read_text()
    assert told == sorted(told)
    cancelled = report.measured(subject_of(meshes.icosphere(1)), SMALL, [Ours(WATERTIGHT)], lambda line, share: False)
    assert cancelled.incomplete == "cancelled"
    report.write(cancelled, tmp_path)


def parsed(*words: object) -> Namespace:
    parser = ArgumentParser()
    error_arguments.add(parser)
    return parser.parse_args([str(word) for word in words])


def read_ball(arguments: Namespace) -> Subject:
    return subject_of(meshes.icosphere(1))


def run(*words: object, methods=()) -> command.Outcome:
    return command.run(
        parsed("--mesh", "ball", "--rays", 200, "--rounds", 1, "--only", "hits", *words), read_ball, silent, methods
    )


def test_bars_and_exit_statuses(tmp_path):
    done = run("--output", tmp_path / "new", "--max-wrong", 0, "--max-leaks", 0, methods=[Wrong()])
    assert (done.status, done.errors) == (0, [])
    assert done.lines[-1] == str(tmp_path / "new" / "index.html")

    class Broken(Wrong):
        name = WATERTIGHT

    rows = report.measured(subject_of(meshes.icosphere(1)), SMALL, [Broken()], silent)
    for name in ("max_wrong", "max_leaks"):
        line = report.missed_bar(rows, Options(**{name: 1}))
        assert re.fullmatch(rf"{WATERTIGHT}: \d+ (wrong answers|leaks) of \d+ rays; at most 1 were allowed", line)
    assert report.missed_bar(rows, Options()) == ""


@pytest.mark.parametrize("bar", ["--max-wrong", "--max-leaks"])
def test_a_missed_bar_is_exit_status_3(bar, tmp_path, monkeypatch):
    class Broken(Wrong):
        name = WATERTIGHT

    monkeypatch.setattr(command, "methods", lambda threads: [Broken()])
    done = run("--output", tmp_path, bar, 1)
    assert done.status == 3 and len(done.errors) == 1 and "at most 1 were allowed" in done.errors[0]
    assert (tmp_path / "index.html").exists()
    assert run("--output", tmp_path, bar, 10**6).status == 0


def test_wrong_usage_and_folders_that_take_nothing(tmp_path):
    for words in (
        *(("--rays", 5), ("--only", "roof"), ("--max-wrong", -1), ("--threads", -1)),
        *(("--only", "left-out", "--max-leaks", 0), ("--only", "image,stability", "--max-wrong", 0)),
    ):
        with pytest.raises(UserError) as raised:
            run("--output", tmp_path / "never", *words)
        assert raised.value.exit_status == 2
    assert not (tmp_path / "never").exists()
    for folder in (tmp_path / "none" / "deeper", Path("/proc/self/fd")):
        with pytest.raises(UserError, match="cannot write into"):
            run("--output", folder)
    with pytest.raises(UserError, match="unknown scene 'roof'"):
        built_in("roof", 100)


def test_an_empty_scene_is_one_line(tmp_path):
    empty = SceneData([], np.zeros(0, np.int32), np.zeros((0, 4, 4)))
    with pytest.raises(UserError, match="no triangles"):
        report.measured(Subject(empty, Settings(), "empty.blend"), SMALL, [], silent)
    with pytest.raises(UserError, match="no triangles"):
        command.run(
            parsed("--mesh", "empty", "--output", tmp_path / "never"),
            lambda arguments: Subject(empty, Settings(), "empty.blend"),
            silent,
        )
    assert not (tmp_path / "never").exists()


def test_a_camera_that_sees_nothing(tmp_path):
    ball = meshes.icosphere(2)
    elsewhere = framing_view(bounds_of(ball.vertices + 100), 64, 48)
    subject = Subject(SceneData.of_mesh(Mesh("ball", *ball), elsewhere), Settings(), "ball")
    options = replace(SMALL, width=32, samples=2, sections=("hits", "image"))
    found = report.measured(subject, options, [Ours(WATERTIGHT)], silent)
    assert (found.hits.rays["camera"]["hit"], found.hits.rays["bounce"]["rays"]) == (0, 0)
    assert found.hits.row(WATERTIGHT).nodes_a_ray > 0
    assert all((row.rmse, row.psnr) == (0, None) for row in found.image.rows)
    report.write(found, tmp_path)
    assert "nan" not in (tmp_path / "results.json").read_text().lower()


def test_a_scene_is_moved_with_its_camera():
    ball = subject_of(meshes.icosphere(1))
    moved = ball.moved(1e6)
    assert moved.mesh.vertices.dtype == np.float64
    assert np.abs(moved.mesh.vertices).max() > 1e6
    before, after = ball.camera.project(ball.mesh.vertices), moved.camera.project(moved.mesh.vertices)
    assert np.allclose(before[:, :2], after[:, :2], atol=1e-3)
    assert ball.moved(0) is ball


def test_a_comparison_counts_each_kind_of_error():
    mesh = meshes.icosphere(1)
    rays = at_features(mesh, 60, np.random.default_rng(1))
    truth = Truth(*mesh).nearest(*rays)
    hits = bihtree.Tree(*mesh).intersect(*rays)
    right = compared(Answers(hits.triangle, hits.t), truth)
    assert not right.wrong.any()
    rows, t = hits.triangle.copy(), hits.t.copy()
    first, second = np.flatnonzero(truth.hit)[:2]
    miss = np.flatnonzero(~truth.hit)[0]
    rows[first], t[first] = -1, np.inf
    rows[second], t[second] = (rows[second] + 40) % 80, 9
    rows[miss], t[miss] = 3, 1
    changed = compared(Answers(rows, t), truth)
    counted = (changed.missed, changed.other_triangle, changed.false_hit)
    assert [np.flatnonzero(flags).tolist() for flags in counted] == [[first], [second], [miss]]
    touches = neighbours(Answers(rows, t), truth, changed, mesh.vertices[mesh.triangles])
    assert not touches[second]
    slipped = leaks(Answers(rows, t), truth, changed, touches)
    corners = set(mesh.triangles[hits.triangle[second]])
    rows[second] = next(row for row in range(80) if len(corners & set(mesh.triangles[row])) == 2)
    touches = neighbours(Answers(rows, t), truth, changed, mesh.vertices[mesh.triangles])
    assert np.flatnonzero(touches).tolist() == [second]
    assert not leaks(Answers(rows, t), truth, changed, touches)[second]
    assert slipped[first] and not slipped[miss]
    assert ulp(np.array([1.0, 1.5, 2.0, 0.0])).tolist() == [2.0**-23, 2.0**-23, 2.0**-22, 2.0**-149]
