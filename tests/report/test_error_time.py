"""The report's time: how far it has come, and smaller pictures where a scene takes long. No clock is asked."""

from __future__ import annotations

from types import SimpleNamespace

import bihtree
import pytest

from addon.pipeline.camera import framing_view
from addon.pipeline.mesh import Mesh, bounds_of
from addon.pipeline.scene import SceneData
from addon.pipeline.settings import PRECISIONS, Settings
from addon.report.error import image_error, left_out, page, report
from addon.report.error.options import Options
from addon.report.error.pace import NARROWEST, PATIENT, Pace, fitting, tried, widths
from addon.report.error.progress import Progress
from addon.report.error.subject import Subject
from tests import meshes

STADIUM = {"watertight": Pace(0.05, 540.0), "exact": Pace(0.05, 420.0), "fast": Pace(0.05, 30.0)}
"""About what the stadium takes, 640 across, moved by a million times its size."""


def subject(width: int = 80) -> Subject:
    ball = meshes.icosphere(2)
    view = framing_view(bounds_of(ball.vertices), width, width * 3 // 4)
    return Subject(SceneData.of_mesh(Mesh("ball", *ball), view), Settings(), "ball")


class Clock:
    """Stands until it is moved."""

    seconds = 0.0

    def __call__(self) -> float:
        return self.seconds


def test_time_left_is_that_of_the_parts_to_come_and_of_this_one():
    clock, told = Clock(), []
    progress = Progress(lambda line, share: told.append((line, share)), {"one": 10.0, "two": 30.0}, clock)
    progress.begin("one")
    clock.seconds = 4.0
    progress.tell("first", 0.2)
    # The first part took 20 s, and goes on twice as slowly as it was expected to.
    assert told == [("  0 %  one, about 40 s left", 0.0), ("  8 %  one: first, about 46 s left", 4 / 50)]
    progress.expect_later("one", 99.0)
    progress.expect_later("two", 31.0)
    progress.tell("second", 0.2)
    assert told[-1] == ("  8 %  one: second, about 47 s left", 4 / 50)
    progress.expect_later("two", 30.0)
    progress.begin("two")
    assert told[-1] == (" 12 %  two, about 30 s left", 4 / 34)
    # It turns out to take ten minutes: less is done than was thought, and never less than was told.
    progress.expect(600.0)
    progress.tell("two of a few", 0.01)
    assert told[-1] == (" 12 %  two of a few, about 10 min left", 4 / 34)
    clock.seconds = 304.0
    progress.tell("half", 0.5)
    assert told[-1] == (" 50 %  two: half, about 5 min left", 304 / 604)
    clock.seconds = 604.0
    progress.tell("all", 1.0)
    assert told[-1] == ("100 %  two: all, about 0 s left", 1.0)


def test_a_long_picture_tells_now_and_then_and_can_be_cancelled():
    clock, told = Clock(), []

    def tell(line: str, share: float) -> bool:
        told.append(line)
        return len(told) < 4

    progress = Progress(tell, {"image": 100.0}, clock)
    progress.begin("image")
    of_picture = progress.of_picture("the reference", 0.0, 0.5)
    assert of_picture("trace", 0.1) and len(told) == 1
    clock.seconds = 10.0
    assert of_picture("build", 0.5) and told[-1] == "  9 %  image: the reference, about 2 min left"
    clock.seconds = 20.0
    assert of_picture("trace", 0.4) and told[-1] == " 20 %  image: the reference, about 80 s left"
    clock.seconds = 21.0
    assert not of_picture("trace", 0.5)
    with pytest.raises(bihtree.Cancelled):
        progress.tell("more", 0.5)


def test_pictures_are_tried_small_first():
    sizes: list[int] = []

    def trace(seconds_a_pixel: float):
        def of(small: Subject) -> SimpleNamespace:
            sizes.append(small.camera.width)
            return SimpleNamespace(report={"trace_seconds": seconds_a_pixel * small.camera.width * small.camera.height})

        return of

    whole = 320 * 240
    for seconds_a_pixel, tries in ((1e-6, [20, 80, 320]), (1e-4, [20, 80]), (1.0, [20])):
        sizes.clear()
        pace = tried(subject(320), trace(seconds_a_pixel), 20.0)
        assert sizes == tries
        assert pace.traced == pytest.approx(seconds_a_pixel * whole)


def test_what_fits_is_the_first_or_else_the_last():
    assert fitting([5, 3, 4], float, 4.0) == 3
    assert fitting([5, 3, 4], float, 1.0) == 4
    assert widths(640) == [640, 320, 160, 80, 40, 20, 10] and widths(5) == [5] and widths(16) == [16, NARROWEST]


def test_pictures_of_most_scenes_are_made_as_they_are_asked_for():
    paces = dict.fromkeys(PRECISIONS, Pace(0.1, 0.3))
    options = Options()
    plan = image_error.planned(paces, 640, options.samples, options.rounds, PATIENT * options.patience)
    assert (plan.width, plan.samples) == (640, 32)
    assert left_out.planned(Pace(0.1, 0.3), 640, options.pairs, 12, PATIENT * options.patience) == (640, 11)


def test_the_most_samples_that_fit_of_the_widest_pictures():
    paces = dict.fromkeys(PRECISIONS, Pace(0.0, 1.0))
    every = image_error.planned(paces, 640, 32, 2, 1e9)
    assert (every.width, every.samples, every.reference) == (640, 32, 8 * 32)
    assert [picture[1:] for picture in every.pictures[::3]] == [(1, 2), (2, 4), (4, 8), (8, 8), (16, 16), (32, 32)]
    assert every.seconds == 8 * 32 + 3 * (2 + 4 + 8 + 8 + 16 + 32)
    half = image_error.planned(paces, 640, 32, 2, every.seconds - 1)
    assert (half.width, half.samples) == (640, 16)
    least = image_error.planned(paces, 640, 32, 2, 8 * 4 + 3 * 14)
    assert (least.width, least.samples) == (640, 4)
    narrow = image_error.planned(paces, 640, 32, 2, 8 * 4 + 3 * 14 - 1)
    assert (narrow.width, narrow.samples) == (320, 8)
    assert image_error.planned(paces, 640, 2, 2, 0.0).samples == 2


@pytest.mark.parametrize("options", [Options(), Options(width=160, samples=8, rounds=2, patience=2.0, pairs=3)])
def test_the_moved_stadium_fits(options):
    share = (options.width / 640) ** 2
    paces = {name: Pace(pace.fixed, pace.traced * share) for name, pace in STADIUM.items()}
    limit = PATIENT * options.patience
    plan = image_error.planned(paces, options.width, options.samples, options.rounds, limit)
    assert plan.seconds <= limit and plan.samples >= 4 and plan.width >= NARROWEST
    pace = paces["watertight"]
    width, pairs = left_out.planned(pace, options.width, options.pairs, 12, limit)
    assert pairs >= 3 and width >= NARROWEST
    assert (1 + 12 * (1 + 2 * pairs)) * pace.of((width / options.width) ** 2) <= limit


def test_a_slow_scene_has_fewer_samples_and_smaller_pictures_and_the_page_says_why(monkeypatch):
    for module, long in ((image_error, 500.0), (left_out, 100.0)):
        monkeypatch.setattr(module, "tried", lambda subject, trace, patience, long=long: Pace(0.0, long))
    options = Options(rounds=2, width=80, samples=16, pairs=9, patience=20.0, sections=("image", "left out"))
    found = report.measured(subject(), options, [], lambda line, share: None)
    assert (found.image.size, found.image.reference_samples) == ("10 x 8", 8 * 4)
    names = [(row.samples, row.name) for row in found.image.rows]
    assert names == [(samples, name) for samples in (1, 2, 4) for name in PRECISIONS]
    assert found.image.notes[0] == (
        "Pictures of 10 x 8 and at most 4 samples a pixel, not 80 across and 16 samples: this section may take some "
        "300 s, and one of that width with 1 sample takes 500 s in watertight, 500 s in exact, 500 s in fast."
    )
    assert found.left_out.picture == "10 x 8, 1 sample a pixel"
    assert found.left_out.notes[0].startswith("5 pairs of pictures of 10 x 8, not 9 of 80 across: ")
    assert {row.ratio.count for row in found.left_out.rows if row.ratio} == {5}
    text = page.text(found)
    assert found.image.notes[0] in text and found.left_out.notes[0] in text
