"""The program in benchmarks/harness: built, asked and run."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import shlex
import subprocess
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

PROJECT = Path(__file__).resolve().parent.parent
PACKAGE = PROJECT / "benchmarks" / "harness"
TARGET = PROJECT / "build" / "bench" / "target"

Result = dict[str, Any]


class Failed(Exception):
    """The harness could not be built or run; the message says what it said."""


def embree_libraries() -> Path | None:
    """The folder of shared libraries that the wheel of embreex carries."""
    spec = importlib.util.find_spec("embreex")
    if spec is None or spec.origin is None:
        return None
    folder = Path(spec.origin).parent.parent / "embreex.libs"
    return folder if folder.is_dir() else None


SCENES = tuple(f"addon/report/{name}.py" for name in ("airframe", "building", "databases", "scenes", "shapes", "view"))
SOURCES = ("native/bih-core", "native/Cargo.toml", "benchmarks/harness", *SCENES)


@cache
def sources_stamp(*parts: str) -> str:
    """Changes whenever these files or folders do; by default the core, the harness and the scenes."""
    files: list[Path] = []
    for root in (PROJECT / part for part in parts or SOURCES):
        found = root.rglob("*") if root.is_dir() else [root]
        inside = (path for path in found if "target" not in path.relative_to(PROJECT).parts)
        files += [path for path in inside if path.suffix in {".rs", ".py", ".toml", ".lock"}]
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@dataclass(frozen=True)
class Harness:
    """The built program, and the command that runs it, for example `taskset --cpu-list 0,1`."""

    program: Path
    wrap: str = ""

    @classmethod
    def built(cls, wrap: str = "") -> Harness:
        """Built now, if anything has changed. Raises Failed."""
        command = ["cargo", "build", "--release", "--locked", "--manifest-path", str(PACKAGE / "Cargo.toml")]
        done = subprocess.run([*command, "--target-dir", str(TARGET)], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise Failed(done.stderr)
        return cls(TARGET / "release" / "bih-harness", wrap)

    def known(self, sides: list[str]) -> set[str]:
        """Those that there are."""
        done = subprocess.run([self.program, "--knows", ",".join(sides)], capture_output=True, text=True, check=True)
        known = set(done.stdout.split())
        return known if embree_libraries() else {side for side in known if not side.startswith("embree/")}

    def run(self, mesh: Path, options: dict[str, str]) -> Result:
        """What it measured. Raises Failed."""
        libraries = embree_libraries()
        if libraries is not None:
            options = {"embree-libs": str(libraries), **options}
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "results.json"
            command = [*shlex.split(self.wrap), str(self.program), "--mesh", str(mesh), "--json", str(output)]
            command += [word for name, value in options.items() for word in (f"--{name}", value)]
            done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
            if done.returncode != 0:
                raise Failed(f"{shlex.join(command)}\n{done.stderr}")
            result: Result = json.loads(output.read_text())
            return result
