"""Ratios, bounds and the page, from results that are made up; nothing is measured here."""

from __future__ import annotations

import itertools
from copy import deepcopy
from pathlib import Path

import pytest

from benchmarks import bars, page, sides, tables
from benchmarks.bars import Row
from benchmarks.harness import Result
from benchmarks.plan import KINDS, PRECISION_KINDS, PRECISION_SCENES, SCENES, Job, jobs
from benchmarks.results import Results
from benchmarks.store import Store

TRIANGLES = 1_000_000


def made_up(job: Job, ours: float = 2.0) -> Result:
    """Every peer takes a second and holds 100 bytes a triangle; ours is `ours` times as fast and as small."""

    def seconds(side: str) -> float:
        return 1 / ours if side.startswith("bih/") else 1.0

    builds = {
        side: {
            "seconds": seconds(side),
            "tree_bytes": 100 * TRIANGLES * seconds(side),
            "held_bytes": 100 * TRIANGLES * seconds(side),
            "peak_bytes": 120 * TRIANGLES * seconds(side),
        }
        for side in sides.BUILDS
    }
    named = {call for kind in KINDS for call in (*sides.traces(kind), *sides.traces_alone(kind))}
    named |= set(sides.PRECISIONS)
    calls = {call: {"rays": 1e6, "rays_a_second": 1e6 / seconds(call), "missed": 1} for call in named}
    costs = {f"{side}@cost": {"nodes_a_ray": 10.0, "triangles_a_ray": 5.0} for side in sides.COSTS}
    return {
        "triangles": TRIANGLES,
        "threads": job.threads,
        "instruction_set": "avx2",
        "embree": 40400,
        "build": builds,
        "trace": {kind: deepcopy({**calls, **costs}) for kind in {*KINDS, *PRECISION_KINDS}},
        "image": {str(count): {side: {"seconds": seconds(side)} for side in sides.IMAGES} for count in (1, 4, 16)},
        "peers": {
            "bihtree": {
                "build_seconds": 0.5,
                **{f"{kind}_rays_a_second": 1e6 for kind in ("primary", "random")},
                **{f"{kind}_differing": 0 for kind in ("primary", "random")},
            }
        },
    }


def all_of_them(ours: float) -> Results:
    return Results({job: made_up(job, ours) for job in jobs()})


def test_a_bar_is_a_ratio_and_a_bound() -> None:
    assert Row("a", "b", 6, 10, "≤", 0.6).is_met is True
    assert Row("a", "b", 7, 10, "≤", 0.6).is_met is False
    assert Row("a", "b", 12, 10, "≥", 1.2).is_met is True
    assert Row("a", "b", 11, 10, "≥", 1.2).is_met is False
    assert Row("a", "b", None, 10, "≥", 1.2).is_met is None
    assert Row("a", "b", 1, None, "≥", 1.2).ratio is None


def test_who_is_five_times_as_good_meets_every_bar_and_who_is_half_as_good_none_but_those_against_itself() -> None:
    assert all(row.is_met for row in bars.rows(all_of_them(5)))
    against_itself = ("nodes a ray", "time to build a triangle")
    missed = [row for row in bars.rows(all_of_them(0.5)) if not row.bar.startswith(against_itself)]
    assert missed
    assert not any(row.is_met for row in missed)


def test_every_bar_of_the_table_is_there() -> None:
    rows = bars.rows(all_of_them(2))
    counts = {bar: sum(1 for row in rows if row.bar == bar) for bar in {row.bar for row in rows}}
    scenes, kinds = len(SCENES), len(KINDS)
    assert counts == {
        "eager build against Embree LOW": scenes,
        "eager build against Embree MEDIUM": scenes,
        "primary rays, against MEDIUM's best": scenes,
        "shadow rays, against MEDIUM's best": scenes,
        "bounce rays, default heuristic, against MEDIUM's best": scenes,
        "bounce rays, sah, against MEDIUM's best": scenes,
        "random rays, default heuristic, against MEDIUM's best": scenes,
        "random rays, sah, against MEDIUM's best": scenes,
        "sah build against Embree MEDIUM": scenes,
        "one ray at a time, sah, against rtcIntersect1: each": scenes * kinds,
        "one ray at a time, sah, against rtcIntersect1: geometric mean": 1,
        "time to image, 1 sample, against the fastest Embree": scenes,
        "bytes a triangle, wide, against MEDIUM": scenes,
        "bytes a triangle, compact": scenes,
        "peak memory while building beyond mesh and result, bytes a triangle": scenes,
        **{f"{kind} rays, compact, against COMPACT": scenes for kind in KINDS},
        "time to build a triangle, 10^7 against 10^5": 3,
        "nodes a ray, against our own sah": 9,
        "nodes a ray in the stadium, scale ratio 10^-9 against 1": 1,
    }


def test_what_being_right_costs_is_a_ratio_of_times_on_the_same_rays() -> None:
    results = all_of_them(2)
    unmeasured = bars.precision_rows(Results({}))
    assert len(unmeasured) == 2 * 2 * len(PRECISION_SCENES) * len(PRECISION_KINDS)
    assert all(row.is_met is None for row in unmeasured)
    for job, result in results.by_job.items():
        if job.part == "precision":
            rates = {"fast": 3e6, "watertight": 2e6, "exact": 1e6}
            ways = ("", "/sah")
            calls = {f"bih/wide/{name}{way}@flight": {"rays_a_second": rates[name]} for name in rates for way in ways}
            result["trace"] = dict.fromkeys(PRECISION_KINDS, calls)
    rows = bars.precision_rows(results)
    assert sorted({round(row.ratio or 0, 6) for row in rows}) == [1.5, 3]
    assert {row.scene.split(", ")[1] for row in rows if row.is_met} == {"vertices", "axis"}


def test_embree_is_held_to_its_fastest_call() -> None:
    results = all_of_them(2)
    for job, result in results.by_job.items():
        if job.table == "trace" and job.scene == "soup":
            result["trace"]["primary"][f"{sides.MEDIUM}@16c"]["rays_a_second"] = 9e6
    assert results.best_rate("soup", "primary", sides.MEDIUM) == 9e6
    assert results.best_rate("soup", "bounce", sides.MEDIUM) == 1e6
    assert results.best_rate("soup", "primary", sides.LOW) == 1e6


def test_a_page_of_nothing_says_that_nothing_was_measured(tmp_path: Path) -> None:
    page.write(Store(tmp_path / "none"), tmp_path / "page.md", tmp_path / "images")
    text = (tmp_path / "page.md").read_text()
    assert "not measured, 0 of 6" in text
    assert "| met, " not in text
    assert "images/" not in text


def test_a_page_of_everything(tmp_path: Path) -> None:
    store = Store(tmp_path / "results")
    for job in jobs():
        store.put(job, made_up(job))
    assert all(store.is_fresh(job) for job in jobs())
    page.write(store, tmp_path / "page.md", tmp_path / "images")
    text = (tmp_path / "page.md").read_text()
    assert "not measured" not in text
    assert "older sources" not in text
    for scene in SCENES:
        assert f"### {scene}, 1,000,000 triangles" in text
    for picture in (tmp_path / "images").iterdir():
        assert f"(images/{picture.name})" in text
    assert len(list((tmp_path / "images").iterdir())) == 4
    # Every table is one: as many cells in each of its rows.
    for line, following in itertools.pairwise(text.splitlines()):
        if line.startswith("|") and following.startswith("|"):
            assert line.count("|") == following.count("|")


def test_jobs_have_names_of_their_own() -> None:
    names = [job.name for job in jobs()]
    assert len(set(names)) == len(names)
    assert not [name for name in names if "/" in name]


def test_a_result_of_other_sources_is_not_fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store, job = Store(tmp_path), jobs()[0]
    assert not store.is_fresh(job)
    store.put(job, made_up(job))
    assert store.is_fresh(job)
    monkeypatch.setattr("benchmarks.store.sources_stamp", lambda: "other")
    assert not store.is_fresh(job)
    assert store.get(job) == made_up(job)


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0, "0"), (1234.5, "1,234"), (12.34, "12.3"), (0.12345, "0.123"), (100, "100"), (1.0, "1.00")],
)
def test_numbers(value: float | None, text: str) -> None:
    assert tables.number(value) == text
