"""A report in a thread of its own, which never touches bpy: what it is about was read before."""

from __future__ import annotations

from pathlib import Path

from ..pipeline.built import Told
from ..report.error import report
from ..report.error.methods import methods
from ..report.error.options import Options
from ..report.error.subject import Subject
from .bvh_tree import BlenderTree
from .worker import Worker


def report_worker(subject: Subject, options: Options, folder: Path) -> Worker[Path]:
    """Measures and writes; the result is the page. Where it is cancelled, what is measured by then is written."""

    def work(told: Told) -> Path:
        report.check(subject, folder)
        blenders = BlenderTree(why_missing="it would hold up Blender's windows; the command line has it")
        results = report.measured(subject, options, [*methods(options.threads), blenders], told)
        return report.write(results, folder)[-1]

    return Worker("BIH report", work)
