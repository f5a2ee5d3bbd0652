"""How soon the viewport shows something: `python -m benchmarks.viewport [--size 1920x1080] [terrain@1000000 …]`.

From the moment at which the exported scene or the view is known to the first picture, an eighth of the resolution a
side, being there to draw. Each of the 100 changes comes while the picture of the one before is still being traced, as
when somebody moves about. The last column is for machines that others use too: processor time of all threads for each
change alone, from what is known to its first picture. The table is for docs/decisions/viewport.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from addon.pipeline.mesh import Mesh
from addon.pipeline.prepared import prepare
from addon.pipeline.refinement import steps, view_of
from addon.pipeline.scene import LIGHT_DTYPE, SUN, SceneData
from addon.pipeline.session import VIEWED, Session
from addon.pipeline.settings import Settings
from addon.pipeline.tree_cache import TreeCache
from addon.report.view import Scene, camera_of

from .meshes import Unavailable, scene

CHANGES = 100
GOAL = 0.1
"""Seconds; 95 of 100 changes are to be shown sooner."""
PATIENCE = 120.0


def orbits(viewed: Scene) -> Iterator[Scene]:
    """All around the scene, in steps of a turn's hundredth."""
    mesh, view = viewed
    eye, target, up = (np.asarray(point, np.float64) for point in (view.eye, view.target, view.up))
    up /= np.linalg.norm(up)
    arm = eye - target
    for number in range(CHANGES):
        turn = 2 * np.pi * (number + 1) / CHANGES
        along = up * (arm @ up)
        turned = along + (arm - along) * np.cos(turn) + np.cross(up, arm) * np.sin(turn)
        x, y, z = (target + turned).tolist()
        yield Scene(mesh, view._replace(eye=(x, y, z)))


def measured(name: str, size: tuple[int, int]) -> tuple[dict[str, list[float]], dict[str, float]]:
    """Seconds of each change by the clock, by its kind, and what `worked` says."""
    viewed = scene(name)
    sun = np.zeros(1, LIGHT_DTYPE)
    sun["kind"], sun["direction"], sun["colour"] = SUN, -np.asarray(viewed.view.up) - 0.3, 3.0
    mesh = Mesh(name, viewed.mesh.vertices, viewed.mesh.triangles.astype(np.int32))
    shown = replace(SceneData.of_mesh(mesh), lights=sun)
    session, settings, seconds = Session(), Settings(), dict[str, list[float]]()

    for number, (kind, what, view) in enumerate(changes(shown, viewed)):
        session.show(what, settings, camera_of(view, *size), samples=16)
        if not session.wait(PATIENCE) or session.shown is None:
            raise SystemExit(f"{name}: {session.problem or 'no picture came'}")
        seconds.setdefault(kind, []).append(session.shown.seconds)
        if what is shown:
            time.sleep(0.005 * (number % 10))
    session.stop()
    return seconds, worked(shown, viewed, settings, size)


def changes(shown: SceneData, viewed: Scene) -> Iterator[tuple[str, SceneData, Scene]]:
    """What each is, the scene then, and how it is looked at."""
    (mesh,) = shown.meshes
    yield "the scene is opened", shown, viewed
    for view in orbits(viewed):
        yield "the view changes", shown, view
    for number in range(20):
        matrix = np.eye(4)
        matrix[0, 3] = 0.01 * (number + 1)
        yield "the object is moved", replace(shown, instance_matrix=matrix[None]), viewed
    for number in range(5):
        edited = replace(mesh, vertices=mesh.vertices * np.float32(1 + 0.01 * (number + 1)))
        yield "the mesh is edited", replace(shown, meshes=[edited]), viewed


def worked(shown: SceneData, viewed: Scene, settings: Settings, size: tuple[int, int]) -> dict[str, float]:
    """Seconds of all processors for each kind of change, the median; what a session does, in its order."""
    settings = replace(settings, passes=("combined",), parts=VIEWED)
    trees, ready, former, seconds = TreeCache(), None, None, dict[str, list[float]]()
    for kind, what, seen in changes(shown, viewed):
        view = view_of(camera_of(seen, *size), next(steps(1)))
        started = time.process_time()
        if ready is None or what is not former:
            ready = prepare(replace(what, camera=view), settings, ("combined",), tree_shown=False, trees=trees)
        ready.picture(view, samples=1)
        seconds.setdefault(kind, []).append(time.process_time() - started)
        former = what
    return {kind: float(np.median(values)) for kind, values in seconds.items()}


def rows(name: str, seconds: dict[str, list[float]], processor: dict[str, float]) -> Iterator[str]:
    for kind, values in seconds.items():
        in_time = sum(value < GOAL for value in values)
        median, most, worst = (1e3 * np.quantile(values, share) for share in (0.5, 0.95, 1.0))
        yield (
            f"| {name} | {kind} | {in_time} of {len(values)} | {median:.0f} | {most:.0f} | {worst:.0f} "
            f"| {1e3 * processor[kind]:.0f} |"
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="1920x1080", help="of the viewport, in pixels")
    parser.add_argument("scenes", nargs="*", default=["terrain@1000000", "city@1000000", "soup@1000000"])
    arguments = parser.parse_args()
    size = tuple(int(side) for side in arguments.size.split("x"))
    print(f"{arguments.size}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")
    print("| scene | change | within 100 ms | median, ms | 95 of 100, ms | worst, ms | processor, ms |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in arguments.scenes:
        try:
            for row in rows(name, *measured(name, (size[0], size[1]))):
                print(row, flush=True)
        except Unavailable as error:
            print(f"{name} is left out: {error}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
