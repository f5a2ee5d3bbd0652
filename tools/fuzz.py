"""Run the fuzz targets of native/fuzz: python tools/fuzz.py [SECONDS].

Where this machine lacks something it says so; with CI set it fails instead.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FUZZ = ROOT / "native" / "fuzz"
TARGETS = ("queries", "saved")


def lacking() -> list[str]:
    """What is missing, and how to install it."""
    missing = []
    rustup = shutil.which("rustup")
    listed = subprocess.run([rustup, "toolchain", "list"], capture_output=True, text=True).stdout if rustup else ""
    if "nightly" not in listed:
        missing.append("a development version of Rust: rustup toolchain install nightly")
    if shutil.which("cargo-fuzz") is None:
        missing.append("cargo-fuzz: cargo install cargo-fuzz --locked")
    return missing


def fuzz(target: str, seconds: int) -> int:
    """Fuzz one target from the corpus that is kept; new inputs go to build/fuzz. Answers the exit status."""
    found = ROOT / "build" / "fuzz" / target
    found.mkdir(parents=True, exist_ok=True)
    command = ["cargo", "+nightly", "fuzz", "run", target, str(found), str(FUZZ / "corpus" / target)]
    limits = [f"-max_total_time={seconds}", "-timeout=20", "-rss_limit_mb=2048", "-max_len=4096"]
    return subprocess.run([*command, "--", *limits], cwd=FUZZ.parent).returncode


def main() -> int:
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    if missing := lacking():
        print("Not fuzzed; this machine lacks " + "; ".join(missing), file=sys.stderr)
        return 1 if os.environ.get("CI") else 0
    return max(fuzz(target, seconds) for target in TARGETS)


if __name__ == "__main__":
    sys.exit(main())
