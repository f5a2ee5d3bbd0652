"""Results as files in build/bench, so that an interrupted run goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path

from .harness import PROJECT, Result, sources_stamp
from .plan import Job

FOLDER = PROJECT / "build" / "bench" / "results"


@dataclass(frozen=True)
class Store:
    """One JSON file a job: when it ran, of what sources, and what came of it."""

    folder: Path = FOLDER

    def _path(self, job: Job) -> Path:
        return self.folder / f"{job.name}.json"

    def _stamp(self, job: Job) -> str:
        words = json.dumps(asdict(job), sort_keys=True) + sources_stamp()
        return hashlib.sha256(words.encode()).hexdigest()[:16]

    def is_fresh(self, job: Job) -> bool:
        """Whether the job ran on the sources as they are."""
        path = self._path(job)
        return path.exists() and json.loads(path.read_text())["stamp"] == self._stamp(job)

    def put(self, job: Job, result: Result) -> None:
        """Never half written."""
        self.folder.mkdir(parents=True, exist_ok=True)
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        text = json.dumps({"stamp": self._stamp(job), "date": now, "result": result}, indent=1)
        temporary = self._path(job).with_suffix(".part")
        temporary.write_text(text + "\n")
        temporary.replace(self._path(job))

    def get(self, job: Job) -> Result | None:
        """What came of it, of whatever sources; none if it never ran."""
        path = self._path(job)
        if not path.exists():
            return None
        result: Result = json.loads(path.read_text())["result"]
        return result

    def date(self, job: Job) -> str | None:
        """When it ran, as ISO 8601."""
        path = self._path(job)
        return str(json.loads(path.read_text())["date"]) if path.exists() else None
