"""Do the tests see mistakes? Each of these, made in a copy of native/, must turn the tests named beside it red.

python tools/mutations.py [NAME ...]     all of them, or those with one of these words in their names
python tools/mutations.py --places       only whether each is still to be found in the sources
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
NATIVE = ROOT / "native"
COPY = ROOT / "build" / "mutations"
# Tests need no speed, and of the core only what was changed is compiled again.
QUICKLY = {
    "CARGO_INCREMENTAL": "1",
    "CARGO_PROFILE_RELEASE_OPT_LEVEL": "1",
    "CARGO_PROFILE_RELEASE_CODEGEN_UNITS": "64",
    "CARGO_PROFILE_RELEASE_DEBUG": "false",
    "CARGO_TARGET_DIR": str(COPY / "target"),
}
CORE_UNOPTIMISED = ("--config", "profile.release.package.bih-core.opt-level=0")


@dataclass(frozen=True)
class Mutation:
    """`old` stands once in `file` of native/ and becomes `new`; `tests` are pytest's, `unit_tests` a word for cargo."""

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...] = ()
    unit_tests: str = ""

    def place(self) -> str | None:
        """What is wrong with where it is looked for."""
        count = (NATIVE / self.file).read_text(encoding="utf-8").count(self.old)
        return None if count == 1 else f"{self.name}: {count} times in native/{self.file}, not once: {self.old}"


CORE = "bih-core/src"
MUTATIONS = (
    Mutation(
        "tie rule dropped",
        f"{CORE}/traverse/closest.rs",
        ".then_with(|| row(reference).cmp(&row(best.reference)))",
        "",
        tests=("tests/cases/test_case_08_ties_and_limits.py::test_duplicates_give_the_lower_row_in_any_order",),
    ),
    Mutation(
        "double filter bound halved",
        f"{CORE}/intersect/watertight.rs",
        "18.0 * EPSILON",
        "9.0 * EPSILON",
        unit_tests="intersect::watertight",
    ),
    Mutation(
        "bound of pairs a millionth",
        f"{CORE}/intersect/pairs.rs",
        "ERROR * largest + LOST",
        "1e-6 * ERROR * largest",
        unit_tests="intersect::pairs",
    ),
    Mutation(
        "sides by heads alone",
        f"{CORE}/intersect/side.rs",
        ".then(order(left.tail, right.tail))",
        "",
        unit_tests="intersect::side",
    ),
    Mutation(
        "one box not rounded outward",
        f"{CORE}/geometry/bounds.rs",
        "round_up(a[axis].max(b[axis]).max(c[axis]))",
        "(a[axis].max(b[axis]).max(c[axis]) as f32)",
        tests=("tests/cases/test_case_02_in_the_plane.py::test_flat_meshes_between_two_numbers_of_single_precision",),
    ),
    Mutation(
        "last lane of a leaf ignored",
        f"{CORE}/traverse/scene.rs",
        "((1u16 << self.count) - 1) as u8",
        "((1u16 << (self.count - 1)) - 1) as u8",
        tests=("tests/cases/test_case_06_small_and_flat.py::test_one_and_two_triangles",),
    ),
)


def main(arguments: Sequence[str]) -> int:
    lost = [place for mutation in MUTATIONS if (place := mutation.place())]
    for line in lost:
        print(line, file=sys.stderr)
    if lost or "--places" in arguments:
        return 1 if lost else 0
    chosen = [m for m in MUTATIONS if not arguments or any(word in m.name for word in arguments)]
    copy_sources()
    survivors = [run(None, chosen)] if any(m.tests for m in chosen) or any(m.unit_tests for m in chosen) else []
    survivors += [run(mutation, [mutation]) for mutation in chosen]
    return 1 if any(survivors) else 0


def copy_sources() -> None:
    """What is to be changed; compiled parts of the last time stay."""
    for name in ("native", "bihtree"):
        shutil.rmtree(COPY / name, ignore_errors=True)
    ignored = shutil.ignore_patterns("target", "__pycache__", "corpus")
    shutil.copytree(NATIVE, COPY / "native", ignore=ignored)
    shutil.copytree(NATIVE / "bih-python" / "python" / "bihtree", COPY / "bihtree", ignore=ignored)


def run(mutation: Mutation | None, tested: Sequence[Mutation]) -> bool:
    """Whether the tests say what they should not: green with a mutation, red without one."""
    name = mutation.name if mutation else "no mutation"
    print(f"{name}: ", end="", flush=True)
    if mutation:
        target = COPY / "native" / mutation.file
        before = target.read_text(encoding="utf-8")
        target.write_text(before.replace(mutation.old, mutation.new), encoding="utf-8")
    try:
        failed = [unit for m in tested if m.unit_tests and (unit := unit_tests(m.unit_tests))]
        names = [test for m in tested for test in m.tests]
        if names:
            build()
            failed += python_tests(names)
    finally:
        if mutation:
            target.write_text(before, encoding="utf-8")
    is_wrong = bool(failed) == (mutation is None)
    print(("WRONG: " if is_wrong else "") + (", ".join(failed) if failed else "all tests pass"), flush=True)
    return is_wrong


def cargo(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | QUICKLY
    return subprocess.run(
        ["cargo", *CORE_UNOPTIMISED, *arguments],
        cwd=COPY / "native",
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def build() -> None:
    """The module, beside its Python part: what PYTHONPATH names comes before what is installed."""
    built = cargo("build", "--quiet", "--locked", "--release", "--package", "bih-python")
    if built.returncode:
        sys.exit(built.stderr)
    prefix, suffix = ("", ".dll") if os.name == "nt" else ("lib", ".dylib" if sys.platform == "darwin" else ".so")
    library = COPY / "target" / "release" / f"{prefix}bihtree{suffix}"
    module = COPY / "bihtree" / ("_bihtree.pyd" if os.name == "nt" else "_bihtree.abi3.so")
    module.unlink(missing_ok=True)
    shutil.copyfile(library, module)


def unit_tests(words: str) -> str | None:
    """The first that fails; a filter that no test has passed is an error."""
    done = cargo("test", "--locked", "--release", "--package", "bih-core", "--lib", words)
    if "running 0 tests" in done.stdout or "running " not in done.stdout:
        sys.exit(f"No unit test ran for {words}\n{done.stdout}\n{done.stderr}")
    return next((line.split()[1] for line in done.stdout.splitlines() if line.endswith(" ... FAILED")), None)


def python_tests(names: Sequence[str]) -> list[str]:
    """The first that fails of each."""
    failed = []
    for name in dict.fromkeys(names):
        command = [sys.executable, "-m", "pytest", "--quiet", "--exitfirst", "-p", "no:cacheprovider", name]
        environment = os.environ | {"PYTHONPATH": str(COPY)}
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1):
            sys.exit(done.stdout + done.stderr)
        failed += [line.split()[1] for line in done.stdout.splitlines() if line.startswith("FAILED")]
    return failed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
