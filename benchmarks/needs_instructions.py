"""Instructions retired instead of a clock, for a machine that is not idle: `python -m benchmarks.needs --instructions`.

Valgrind's callgrind counts them, on one thread. A call of getpgid, which nothing else makes, ends each count.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from .harness import PROJECT, Failed

Work = tuple[str, Callable[[], object]]


def run(work: Sequence[Work]) -> None:
    """In the counted process: do each once to warm up, then once between two marks; print its name."""
    for name, do in work:
        do()
        os.getpgid(0)
        do()
        os.getpgid(0)
        print(name, flush=True)


def counts(arguments: Sequence[str]) -> dict[str, int]:
    """Run `python -m …` with these arguments, which calls `run`; the instructions of each piece of work by its name."""
    with tempfile.TemporaryDirectory() as folder:
        command = ["valgrind", "--tool=callgrind", "--dump-before=getpgid", f"--callgrind-out-file={folder}/out"]
        environment = {**os.environ, "RAYON_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
        try:
            done = subprocess.run(
                [*command, sys.executable, "-m", *arguments],
                cwd=PROJECT,
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
        except FileNotFoundError:
            raise Failed("valgrind is not installed: (Debian 12) apt-get install valgrind") from None
        if done.returncode != 0:
            raise Failed(done.stderr)
        names = done.stdout.splitlines()
        dumps = sorted(Path(folder).glob("out.*"), key=lambda path: int(path.suffix[1:]))
        if len(dumps) != 2 * len(names):
            raise Failed(f"callgrind wrote {len(dumps)} counts of {len(names)} pieces of work")
        return {name: _total(dump) for name, dump in zip(names, dumps[1::2], strict=True)}


def _total(dump: Path) -> int:
    found = re.search(r"^totals: (\d+)$", dump.read_text(), re.MULTILINE)
    assert found, dump
    return int(found[1])
