"""Name in one line what this machine lacks, and what to install.

    python check_machine.py                   for `make preview`
    python check_machine.py --tests           for `make test`
    python check_machine.py --debian-packages only the Debian packages, for a script

Runs before anything is installed, and on any Python 3.7 or later, so that it can say that the Python is the wrong one.
"""

from __future__ import annotations

import ctypes
import importlib.util
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

WORKSPACE = Path(__file__).resolve().parent.parent / "native" / "Cargo.toml"

# The shared libraries that bpy 5.0.1 is linked with and does not bring along (readelf -d), and their Debian packages.
LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libGL.so.1": "libgl1",
    "libICE.so.6": "libice6",
    "libSM.so.6": "libsm6",
}


class Lack(NamedTuple):
    what: str
    remedy: str
    """What to do about it, "" where the packages are the answer."""
    packages: list[str]
    """Debian's."""


def lacking_python() -> Iterator[Lack]:
    """Of the Python that runs this."""
    version = platform.python_version()
    if sys.version_info[:2] != (3, 11):
        yield Lack(f"Python 3.11 (this is {version})", "make PYTHON=/path/to/python3.11 …", [])
    elif importlib.util.find_spec("ensurepip") is None or importlib.util.find_spec("venv") is None:
        yield Lack("Python's venv and ensurepip", "", ["python3.11-venv"])


def lacking_libraries() -> Iterator[Lack]:
    """Of bpy's shared libraries; its wheels exist for x86_64 Linux, macOS and Windows."""
    if platform.system() != "Linux":
        return
    if platform.machine() != "x86_64":
        yield Lack(f"an x86_64 processor (no bpy wheel for {platform.machine()})", "nothing: use another machine", [])
    for library, package in LIBRARIES.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            yield Lack(library, "", [package])


def lacking_rust(for_tests: bool) -> Iterator[Lack]:
    """Of Rust and of the linker that rustc calls."""
    if platform.system() != "Windows" and shutil.which("cc") is None:
        yield Lack("a C linker (cc)", "", ["gcc", "libc6-dev"])
    wanted = re.findall(r'^rust-version = "([\d.]+)"', WORKSPACE.read_text(encoding="utf-8"), re.MULTILINE)[0]
    found = re.match(r"rustc (\d+)\.(\d+)", _output("rustc", "--version"))
    if found is None or shutil.which("cargo") is None:
        yield Lack("Rust (cargo)", f"Rust {wanted} or later from https://rustup.rs", [])
    elif tuple(map(int, found.groups())) < tuple(map(int, wanted.split(".")[:2])):
        yield Lack(f"Rust {wanted} or later (this is {found[1]}.{found[2]})", "rustup update stable", [])
    elif for_tests:
        for component, command in (("rustfmt", "fmt"), ("clippy", "clippy")):
            if not _output("cargo", command, "--version"):
                yield Lack(f"cargo {command}", f"rustup component add {component}", [])


def _output(*command: str) -> str:
    """What the command prints, "" where it is missing or fails."""
    try:
        return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True, text=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return ""


def main(arguments: list[str]) -> int:
    lacks = [*lacking_python(), *lacking_libraries(), *lacking_rust("--tests" in arguments)]
    packages = [package for lack in lacks for package in lack.packages]
    if "--debian-packages" in arguments:
        print(" ".join(packages))
        return 0
    if not lacks:
        return 0
    remedies = [lack.remedy for lack in lacks if lack.remedy]
    if packages:
        remedies.append("(Debian, Ubuntu) apt-get install " + " ".join(packages))
    what = ", ".join(lack.what for lack in lacks)
    print(f"This machine lacks {what}. To install: {'; '.join(remedies)}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
