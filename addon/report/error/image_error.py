"""Error of the picture as seconds pass: the preview render with more and more samples beside a converged one."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...pipeline import image, preview
from ...pipeline.errors import UserError
from ...pipeline.settings import PRECISIONS
from .hits import Span, span
from .progress import Progress
from .subject import Subject

Picture = NDArray[np.float32]
"""(H, W, 3) sRGB from 0 to 1, over black."""


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


def measure(section: Image, subject: Subject, width: int, most: int, rounds: int, progress: Progress) -> None:
    """Samples 1, 2, 4, … up to `most`; the reference has eight times as many, at other places. Raises Cancelled and
    KeyboardInterrupt; what was measured before stays in the section."""
    progress.begin("image")
    subject = subject.in_width(width)
    section.size = f"{subject.camera.width} x {subject.camera.height}"
    section.reference_samples = 8 * most
    difference = flip()
    if isinstance(difference, str):
        section.notes.append(difference)
    reference, _ = _traced(subject, PRECISIONS[0], section.reference_samples, seed=subject.settings.seed + 1)
    _show(section, f"the reference, {section.reference_samples} samples a pixel", reference)
    steps = [2**power for power in range(most.bit_length())]
    work = [(samples, precision) for samples in steps for precision in PRECISIONS]
    for number, (samples, precision) in enumerate(work):
        progress.tell(f"{precision}, {samples} samples", 0.3 + 0.7 * number / len(work))
        seconds = []
        for _ in range(rounds):
            started = perf_counter()
            picture, build = _traced(subject, precision, samples, seed=subject.settings.seed)
            seconds.append(perf_counter() - started)
        rmse = float(np.sqrt(((picture.astype(np.float64) - reference) ** 2).mean()))
        flipped = None if isinstance(difference, str) else difference(reference, picture)
        psnr = -20 * float(np.log10(rmse)) if rmse else None
        section.rows.append(Row(precision, samples, span(seconds), build, rmse, psnr, flipped))
        if (samples, precision) == work[0]:
            _show(section, f"{precision}, 1 sample a pixel", picture)
            _show(section, "its error, four times as bright", np.minimum(4 * np.abs(picture - reference), 1))


def _traced(subject: Subject, precision: str, samples: int, seed: int) -> tuple[Picture, float]:
    settings = replace(subject.settings, precision=precision, samples=samples, seed=seed, passes=("combined",))
    traced = preview.trace(subject.scene, settings, outputs=preview.Outputs())
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
