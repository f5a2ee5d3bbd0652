"""Error of the picture as seconds pass: the preview render with more and more samples beside a converged one."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...pipeline import image, preview
from ...pipeline.errors import UserError
from ...pipeline.settings import PRECISIONS
from ..markdown import number
from .hits import SLOW, Span, span
from .pace import PATIENT, Pace, fitting, tried, why_less, widths
from .progress import Progress, TellsOfPicture
from .subject import Subject

Picture = NDArray[np.float32]
"""(H, W, 3) sRGB from 0 to 1, over black."""
REFERENCE = 8
"""Times as many samples as the best picture has."""
FEWEST = 4
"""Samples of the best picture, so that a curve has three points, before pictures get narrower."""


@dataclass
class Row:
    """A precision with so many samples a pixel: seconds from the arrays to the finished picture, build included."""

    name: str
    samples: int
    seconds: Span | None
    build_seconds: float
    rmse: float
    psnr: float | None
    """In dB; None where the pictures are the same."""
    flip: float | None


@dataclass
class Image:
    """The section, filled row by row."""

    rows: list[Row] = field(default_factory=list)
    size: str = ""
    reference_samples: int = 0
    notes: list[str] = field(default_factory=list)
    pictures: dict[str, bytes] = field(default_factory=dict)
    """PNG files by what they show; not in results.json."""


@dataclass(frozen=True)
class Plan:
    """How large the pictures are, how many samples the best of them has, and how long they take, about."""

    width: int
    samples: int
    reference: float
    """Seconds, as all here."""
    pictures: tuple[tuple[str, int, float], ...]
    """Precision, samples, and how long all rounds of it take."""

    @property
    def seconds(self) -> float:
        return self.reference + sum(seconds for *_, seconds in self.pictures)


def planned(paces: Mapping[str, Pace], width: int, most: int, rounds: int, limit: float) -> Plan:
    """The widest pictures that fit the limit, and of those the most samples. `paces` are those of precisions, for
    pictures of the whole width with one sample."""

    def plan(wide: int, best: int) -> Plan:
        share = (wide / width) ** 2
        each = [
            (name, n, paces[name].of(n * share)) for n in (2**k for k in range(best.bit_length())) for name in paces
        ]
        pictures = tuple((name, n, one * (1 if one > SLOW else rounds)) for name, n, one in each)
        return Plan(wide, best, paces[PRECISIONS[0]].of(REFERENCE * best * share), pictures)

    bests = [best for halved in range(most.bit_length()) if (best := most >> halved) >= min(most, FEWEST)]
    return fitting((plan(wide, best) for wide in widths(width) for best in bests), lambda plan: plan.seconds, limit)


def measure(
    section: Image, subject: Subject, width: int, most: int, rounds: int, patience: float, progress: Progress
) -> None:
    """Samples 1, 2, 4, … up to `most`, or what the patience allows; the reference has eight times as many, at other
    places. Raises Cancelled and KeyboardInterrupt; what was measured before stays in the section."""
    progress.begin("image")
    subject = subject.in_width(width)
    asked = subject.camera.width
    paces = {name: tried(subject, partial(_preview, precision=name), patience) for name in PRECISIONS}
    plan = planned(paces, asked, most, rounds, PATIENT * patience)
    subject = subject.in_width(plan.width)
    section.size = subject.size
    section.reference_samples = REFERENCE * plan.samples
    if (plan.width, plan.samples) != (asked, most):
        what = f"Pictures of {section.size} and at most {plan.samples} samples a pixel"
        instead = f"{asked} across and {most} samples"
        long = ", ".join(f"{number(pace.of(1.0))} s in {name}" for name, pace in paces.items())
        whole = f"one of that width with 1 sample takes {long}"
        section.notes.append(why_less(what, instead, PATIENT * patience, whole))
    difference = flip()
    if isinstance(difference, str):
        section.notes.append(difference)
    progress.expect(plan.seconds)
    told = progress.of_picture("the reference", 0.0, plan.reference / plan.seconds)
    seed = subject.settings.seed
    reference, _ = _traced(subject, PRECISIONS[0], section.reference_samples, seed + 1, told)
    _show(section, f"the reference, {section.reference_samples} samples a pixel", reference)
    done = plan.reference
    for precision, samples, expected in plan.pictures:
        what = f"{precision}, {samples} sample" + ("s" if samples > 1 else "")
        progress.tell(what, done / plan.seconds)
        seconds: list[float] = []
        while len(seconds) < rounds and not (seconds and seconds[-1] > SLOW):
            shares = [(done + expected * count / rounds) / plan.seconds for count in (len(seconds), len(seconds) + 1)]
            started = perf_counter()
            picture, build = _traced(subject, precision, samples, seed, progress.of_picture(what, *shares))
            seconds.append(perf_counter() - started)
        done += expected
        rmse = float(np.sqrt(((picture.astype(np.float64) - reference) ** 2).mean()))
        flipped = None if isinstance(difference, str) else difference(reference, picture)
        psnr = -20 * float(np.log10(rmse)) if rmse else None
        section.rows.append(Row(precision, samples, span(seconds), build, rmse, psnr, flipped))
        if len(section.rows) == 1:
            _show(section, f"{precision}, 1 sample a pixel", picture)
            _show(section, "its error, four times as bright", np.minimum(4 * np.abs(picture - reference), 1))


def _preview(
    subject: Subject, precision: str, samples: int = 1, seed: int = 0, told: TellsOfPicture | None = None
) -> preview.Preview:
    settings = replace(subject.settings, precision=precision, samples=samples, seed=seed, passes=("combined",))
    return preview.trace(subject.scene, settings, outputs=preview.Outputs(), progress=told)


def _traced(subject: Subject, precision: str, samples: int, seed: int, told: TellsOfPicture) -> tuple[Picture, float]:
    traced = _preview(subject, precision, samples, seed, told)
    colours = image.encode_srgb(traced.passes["combined"][..., :3]).astype(np.float32)
    return np.ascontiguousarray(colours), traced.report["build_seconds"]


def flip() -> Callable[[Picture, Picture], float] | str:
    """The mean FLIP (Andersson and others 2020) of two pictures by its authors' package, or why there is none."""
    try:
        package: Any = import_module("flip_evaluator")
    except ImportError:
        return "FLIP is left out: the Python module flip_evaluator is not installed"
    return lambda reference, test: float(package.evaluate(reference, test, "LDR", True, False)[1])


def _show(section: Image, what: str, picture: Picture) -> None:
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "picture.png"
            image.write_srgb8(path, (picture * 255 + 0.5).astype(np.uint8))
            section.pictures[what] = path.read_bytes()
    except (UserError, OSError) as error:
        section.notes.append(f"the picture of {what} is left out: {error}")
