"""A thread of its own for long work, which never touches bpy: what it needs was read before."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, TypeVar

from ..pipeline.errors import UserError

if TYPE_CHECKING:  # it imports bihtree, which may be missing
    from ..pipeline.built import Told

Result = TypeVar("Result")


class Worker(Generic[Result]):
    """Starts at once. `line` and `share` say how far it has come; after `is_done`, `error`, or `result`, or neither
    where it was cancelled."""

    def __init__(self, name: str, job: Callable[[Told], Result]) -> None:
        self.line, self.share = "", 0.0
        self.error = ""
        self.result: Result | None = None
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(job,), name=name)
        self._thread.start()

    @property
    def is_done(self) -> bool:
        return not self._thread.is_alive()

    def cancel(self) -> None:
        self._cancelled.set()

    def wait(self) -> None:
        self._thread.join()

    def _run(self, job: Callable[[Told], Result]) -> None:
        from bihtree import Cancelled

        try:
            self.result = job(self._told)
        except Cancelled:
            self.line = "cancelled"
        except (UserError, MemoryError) as error:
            self.error = str(error) or "not enough memory; hide some objects, or choose the compact layout"
        except Exception as error:
            self.error = f"{type(error).__name__}: {error}"
            raise

    def _told(self, line: str, share: float) -> bool:
        self.line, self.share = line, share
        return not self._cancelled.is_set()
