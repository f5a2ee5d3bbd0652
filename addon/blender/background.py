"""A report in a thread of its own, which never touches bpy: what it is about was read before."""

from __future__ import annotations

import threading
from pathlib import Path

from ..pipeline.errors import UserError
from ..report.error import report
from ..report.error.methods import methods
from ..report.error.options import Options
from ..report.error.subject import Subject
from .bvh_tree import BlenderTree


class BackgroundReport:
    """Starts at once. `line` and `share` say how far it has come; after `is_done`, `error` or `page`."""

    def __init__(self, subject: Subject, options: Options, folder: Path) -> None:
        self.line, self.share = "", 0.0
        self.error = ""
        self.page: Path | None = None
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(subject, options, folder), name="BIH report")
        self._thread.start()

    @property
    def is_done(self) -> bool:
        return not self._thread.is_alive()

    def cancel(self) -> None:
        """What is measured by now is still written."""
        self._cancelled.set()

    def wait(self) -> None:
        self._thread.join()

    def _run(self, subject: Subject, options: Options, folder: Path) -> None:
        try:
            report.check_folder(folder)
            blenders = BlenderTree(why_missing="it would hold up Blender's windows; the command line has it")
            results = report.measured(subject, options, [*methods(options.threads), blenders], self._told)
            self.page = report.write(results, folder)[-1]
        except UserError as error:
            self.error = str(error)
        except Exception as error:
            self.error = f"{type(error).__name__}: {error}"
            raise

    def _told(self, line: str, share: float) -> bool:
        self.line, self.share = line, share
        return not self._cancelled.is_set()
