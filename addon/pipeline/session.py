"""A view that is traced in a thread of its own while somebody looks at it and moves about in it.

The thread knows nothing of Blender: whoever owns the session tells it what to show, and asks it for the newest picture.
"""

from __future__ import annotations

import logging
import threading
import weakref
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
from bihtree import Cancelled
from numpy.typing import NDArray

from . import prepared, refinement
from .camera import CameraView
from .errors import UserError
from .refinement import Step
from .scene import SceneData
from .settings import Settings
from .tree_cache import TreeCache

VIEWED = {"objects out of reach": True, "on demand": True, "instances": True}
"""The camera moves: nothing is out of reach for long, and trees are built where it looks. Objects move: each mesh has a
tree of its own."""

BUILDING = "Building"


@dataclass(frozen=True)
class Shown:
    """`pixels` (H, W, 4) float32, scene-linear, first row at the bottom, over all of `view`."""

    pixels: NDArray[np.float32]
    view: CameraView
    step: Step
    is_last: bool
    seconds: float
    """Since this was asked for."""


@dataclass(frozen=True)
class _Asked:
    """What is to be shown, and since when."""

    scene: SceneData
    settings: Settings
    view: CameraView
    samples: int
    pixel_size: int
    since: float


@dataclass
class _State:
    """What the two threads share, under `changed`."""

    changed: threading.Condition = field(default_factory=threading.Condition)
    asked: _Asked | None = None
    shown: Shown | None = None
    problem: str = ""
    activity: str = ""
    trees_built: int = 0
    is_stopped: bool = False


class Session:
    """One viewport. All of its methods return at once, but for `wait` and `stop`."""

    def __init__(self) -> None:
        self._state = _State()
        self._thread = threading.Thread(target=_work, args=(self._state,), name="BIH viewport", daemon=True)
        self._thread.start()
        # Also where the owner is never told that it ends, and when Python does.
        self._end = weakref.finalize(self, _stop, self._state, self._thread)

    def show(
        self, scene: SceneData, settings: Settings, view: CameraView, *, samples: int, pixel_size: int = 1
    ) -> None:
        """Show this from now on, at the end with one ray a sample in squares of `pixel_size` pixels a side. The same
        scene object with the same settings keeps its trees and what is prepared of them; otherwise meshes that are the
        same objects keep theirs."""
        state = self._state
        first = next(refinement.steps(samples, pixel_size))
        with state.changed:
            former = state.asked
            is_same = former is not None and scene is former.scene and settings == former.settings
            is_built = is_same and state.activity != BUILDING
            state.asked = _Asked(scene, settings, view, samples, pixel_size, perf_counter())
            state.problem, state.activity = "", _words(first) if is_built else BUILDING
            state.changed.notify_all()

    @property
    def shown(self) -> Shown | None:
        """The newest picture, of an earlier view perhaps; None where what was asked for last cannot be shown."""
        return self._state.shown

    @property
    def problem(self) -> str:
        """One line where what was asked for last cannot be shown; empty where it can."""
        return self._state.problem

    @property
    def activity(self) -> str:
        """What the thread does now, in a few words; empty where it is done."""
        return self._state.activity

    @property
    def trees_built(self) -> int:
        return self._state.trees_built

    def wait(self, seconds: float, *, until_last: bool = False) -> bool:
        """Wait for a picture of what was asked for last, or for its last one, or a problem; whether there is one."""
        state = self._state

        def is_there() -> bool:
            if state.problem or state.asked is None:
                return True
            is_current = state.shown is not None and state.shown.view is state.asked.view
            return is_current and (not until_last or not state.activity)

        with state.changed:
            return state.changed.wait_for(is_there, seconds)

    def stop(self) -> None:
        """End the thread and let go of everything; only then does it return."""
        self._end()


def _stop(state: _State, thread: threading.Thread) -> None:
    with state.changed:
        state.is_stopped = True
        state.changed.notify_all()
    thread.join()
    state.asked = state.shown = None


def _work(state: _State) -> None:
    """The thread: whatever was asked for last, step by step, until it is stopped."""
    trees = TreeCache()
    done: _Asked | None = None
    ready: prepared.Prepared | None = None
    while asked := _next(state, done):
        try:
            if ready is None or done is None or asked.scene is not done.scene or asked.settings != done.settings:
                ready = None
                ready = _prepare(asked, trees, state)
            _trace(asked, ready, state)
        except Cancelled:
            pass
        except (UserError, MemoryError) as error:
            _tell(state, str(error) or "out of memory: hide objects, or render in smaller tiles")
        except Exception as error:
            logging.getLogger(__name__).exception("the viewport's picture failed")
            _tell(state, f"{type(error).__name__}: {error}")
        done = asked


def _next(state: _State, done: _Asked | None) -> _Asked | None:
    """Wait for something else than `done` to be asked for; None where the thread is to end."""
    with state.changed:
        state.changed.wait_for(lambda: state.is_stopped or state.asked is not done)
        return None if state.is_stopped else state.asked


def _prepare(asked: _Asked, trees: TreeCache, state: _State) -> prepared.Prepared:
    """A build that was begun is finished, whatever is asked for meanwhile: else nothing would be seen while a mesh is
    edited faster than its tree is built."""
    settings = replace(asked.settings, passes=("combined",), parts={**VIEWED, **asked.settings.parts})
    scene = replace(asked.scene, camera=asked.view)
    ready = prepared.prepare(
        scene,
        settings,
        settings.passes,
        tree_shown=False,
        trees=trees,
        progress=lambda stage, share: not state.is_stopped,
    )
    state.trees_built = trees.built
    return ready


def _trace(asked: _Asked, ready: prepared.Prepared, state: _State) -> None:
    """All steps, or until something else is asked for; the first one always, so that no movement is too fast to see."""
    mean = refinement.Mean()
    all_steps = list(refinement.steps(asked.samples, asked.pixel_size))
    for step in all_steps:
        is_first, is_last = step is all_steps[0], step is all_steps[-1]

        def goes_on(share: float, is_first: bool = is_first) -> bool:
            return not state.is_stopped and (is_first or state.asked is asked)

        view = refinement.view_of(asked.view, step)
        passes = ready.picture(view, samples=1, first_sample=step.sample, progress=goes_on)
        pixels = mean.with_step(step, passes["combined"])
        shown = Shown(pixels, asked.view, step, is_last, perf_counter() - asked.since)
        with state.changed:
            state.shown = shown
            state.activity = "" if is_last else _words(all_steps[all_steps.index(step) + 1])
            state.changed.notify_all()
        if not goes_on(1.0):
            return


def _words(step: Step) -> str:
    return f"1/{step.divisor} of the resolution" if step.divisor > 1 else f"Sample {step.sample + 1}"


def _tell(state: _State, problem: str) -> None:
    with state.changed:
        state.shown, state.problem, state.activity = None, problem, ""
        state.changed.notify_all()
