"""Looking things up in what was measured."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from . import sides
from .harness import Result
from .plan import Job, jobs
from .store import Store


@dataclass(frozen=True)
class Results:
    """Every job's result that there is."""

    by_job: dict[Job, Result]

    @classmethod
    def stored(cls, store: Store) -> Results:
        found = {job: store.get(job) for job in jobs()}
        return cls({job: result for job, result in found.items() if result is not None})

    def _find(self, scene: str, table: str, threads: int, kind: str | None = None) -> Result:
        for job, result in self.by_job.items():
            if (job.scene, job.table, job.threads) == (scene, table, threads) and (kind is None or kind in job.kinds):
                return result
        return {}

    def triangles(self, scene: str) -> int | None:
        """How many the scene has, if anything was measured of it."""
        return next((result["triangles"] for job, result in self.by_job.items() if job.scene == scene), None)

    def built(self, scene: str, side: str, fact: str = "seconds", threads: int = 2) -> float | None:
        """Of a build: seconds, or another fact of it."""
        found: float | None = self._find(scene, "build", threads).get("build", {}).get(side, {}).get(fact)
        return found

    def bytes_a_triangle(self, scene: str, side: str) -> float | None:
        """Of the finished structure, beyond the mesh: by the counting allocator, or by Embree's own monitor."""
        fact = "tree_bytes" if side.startswith("embree/") else "held_bytes"
        count, triangles = self.built(scene, side, fact), self.triangles(scene)
        return None if count is None or not triangles else count / triangles

    def peak_beyond_result(self, scene: str, side: str) -> float | None:
        """Bytes a triangle held at the peak of the build and no longer after it."""
        peak, triangles = self.built(scene, side, "peak_bytes"), self.triangles(scene)
        after = self.bytes_a_triangle(scene, side)
        return None if peak is None or after is None or not triangles else peak / triangles - after

    def traced(self, scene: str, kind: str, call: str, threads: int = 2) -> dict[str, Any]:
        """One call's row of a kind of rays; empty if it was not measured."""
        tables = self._find(scene, "trace", threads, kind).get("trace", {})
        row: dict[str, Any] = tables.get(kind, {}).get(call, {})
        return row

    def rate(self, scene: str, kind: str, call: str, threads: int = 2) -> float | None:
        """Rays a second."""
        found: float | None = self.traced(scene, kind, call, threads).get("rays_a_second")
        return found

    def precise_rate(self, scene: str, kind: str, call: str) -> float | None:
        """Rays a second where precisions are compared with each other, on one thread in flight."""
        for job, result in self.by_job.items():
            if (job.part, job.scene) == ("precision", scene):
                found: float | None = result.get("trace", {}).get(kind, {}).get(call, {}).get("rays_a_second")
                return found
        return None

    def best_rate(self, scene: str, kind: str, side: str, threads: int = 2) -> float | None:
        """Of all ways in which a side is called."""
        calls = [side, *(f"{side}@{call}" for call in sides.ALL_CALLS)]
        return largest(self.rate(scene, kind, call, threads) for call in calls)

    def steps(self, scene: str, kind: str, side: str) -> float | None:
        """Nodes a ray."""
        tables = self._find(scene, "steps", 2).get("trace", {})
        found: float | None = tables.get(kind, {}).get(f"{side}@cost", {}).get("nodes_a_ray")
        return found

    def image(self, scene: str, side: str, samples: int) -> float | None:
        """Seconds from the mesh to the picture."""
        found: float | None = (
            self._find(scene, "image", 2).get("image", {}).get(str(samples), {}).get(side, {}).get("seconds")
        )
        return found

    def python(self, scene: str) -> dict[str, dict[str, float]]:
        """The peers that Python has, by name."""
        found: dict[str, dict[str, float]] = self._find(scene, "python", 1).get("peers", {})
        return found


def largest(values: Iterable[float | None]) -> float | None:
    """Of those that there are."""
    return max((value for value in values if value is not None), default=None)


def least(values: Iterable[float | None]) -> float | None:
    """Of those that there are."""
    return min((value for value in values if value is not None), default=None)
