"""What is measured: a list of jobs, each a run of the harness or of the Python peers on one scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from . import sides

SCENES = ("bunny", "dragon", "terrain", "soup", "gears", "city")
"""That the bars name."""

OTHERS = ("balls", "shells", "stadium", "jacks", "rings", "airframe", "lattice", "tree", "mount", "tetra", "sponge")

KINDS = ("primary", "bounce", "random", "shadow", "ambient")

PRECISION_SCENES = ("bunny", "terrain", "gears")
PRECISION_KINDS = ("primary", "bounce", "random", "vertices", "axis")
"""The last two are rays that float32 cannot decide: at vertices, and through vertices along an axis."""

GROWING = ("terrain", "soup", "gears")
SIZES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)

STEPS = ("gears", "balls", "shells", "stadium/0@100000", "stadium/9@100000")
"""Where the hierarchy is known to be weak; after the slash, the scale ratio's exponent."""

PARTS = ("build", "trace", "image", "python", "precision", "growth", "steps", "others")


@dataclass(frozen=True)
class Job:
    """One run. `table` says what of it is told: build, trace, image, steps, python."""

    part: str
    scene: str
    threads: int
    table: str
    sides: tuple[str, ...]
    kinds: tuple[str, ...] = ()
    rounds: int = 5
    seconds: float = 10
    samples: tuple[int, ...] = ()
    size: str = "1024x768"
    """Pixels of the picture."""

    @property
    def name(self) -> str:
        """Of its file."""
        words = [self.part, self.scene.replace("/", "-"), self.table, *self.kinds, f"{self.threads}-threads"]
        return "-".join(words if len(self.kinds) == 1 else [*words[:3], words[-1]])

    def options(self, known: set[str]) -> dict[str, str]:
        """For the harness, with the sides that it knows."""
        named = ",".join(side for side in self.sides if sides.side_of(side) in known)
        options = {"threads": str(self.threads), "rounds": str(self.rounds), "seconds": str(self.seconds)}
        options["size"] = self.size
        # Steps are counted beside every trace; one round is enough.
        options["trace" if self.table == "steps" else self.table] = named
        if self.kinds:
            options["rays"] = ",".join(self.kinds)
        if self.samples:
            options["samples"] = ",".join(map(str, self.samples))
        return options


def of_the_bars() -> Iterator[Job]:
    """Every scene that the bars name: building, tracing, pictures, and the peers from Python."""
    for scene in SCENES:
        for threads in (2, 1):
            yield Job("build", scene, threads, "build", sides.BUILDS, rounds=7, seconds=15)
        for kind in KINDS:
            yield Job("trace", scene, 2, "trace", sides.traces(kind), (kind,), 5, 16)
        for kind in KINDS[:4]:
            yield Job("trace", scene, 1, "trace", sides.traces_alone(kind), (kind,), 3, 4)
        yield Job("image", scene, 2, "image", sides.IMAGES, samples=(1, 4, 16), seconds=40)
        yield Job("python", scene, 1, "python", ())


def of_precisions() -> Iterator[Job]:
    """What being right costs: each precision on the same rays."""
    for scene in PRECISION_SCENES:
        yield Job("precision", scene, 1, "trace", sides.PRECISIONS, PRECISION_KINDS, rounds=7, seconds=12)


def of_growth() -> Iterator[Job]:
    """The same scenes from a thousand triangles to ten million."""
    builds = (sides.DEFAULT, sides.SAH, sides.LOCAL, sides.COMPACT, sides.LOW, sides.MEDIUM)
    for scene in GROWING:
        for size in SIZES:
            rounds = 25 if size < 100_000 else 5
            # The first round alone would measure how the system hands out memory.
            seconds = 60 if size > 1_000_000 else 10
            yield Job("growth", f"{scene}@{size}", 2, "build", builds, rounds=rounds, seconds=seconds)
            for kind in ("primary", "bounce"):
                yield Job("growth", f"{scene}@{size}", 2, "trace", sides.traces_alone(kind), (kind,), 3, 3)


def of_steps() -> Iterator[Job]:
    """Nodes and triangles a ray, which no clock disturbs."""
    for scene in STEPS:
        yield Job("steps", scene, 2, "steps", sides.COSTS, ("primary", "bounce", "random"), 1, 0, size="320x240")


def of_other_scenes() -> Iterator[Job]:
    """The rest of the databases: ours beside the best peer."""
    traces = (sides.DEFAULT, sides.SAH, *(f"{sides.MEDIUM}@{call}" for call in ("1", "16", "16c")))
    for scene in OTHERS:
        yield Job("others", scene, 2, "build", (sides.DEFAULT, sides.SAH, sides.LOW, sides.MEDIUM), rounds=3)
        yield Job("others", scene, 2, "trace", traces, KINDS[:4], 2, 3)


def jobs() -> list[Job]:
    """All, those of the bars first."""
    return [*of_the_bars(), *of_precisions(), *of_steps(), *of_growth(), *of_other_scenes()]
