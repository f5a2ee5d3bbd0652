"""Run tests/blender on Blender as a module, one version after another: each has an environment of its own.

    python tools/hosts.py [--short] [VERSION…]      4.2, 4.5, 5.0 or 5.2; all of them by default

Blender 5.0 is that of build/venv, which runs this; of the others tests/hosts says what goes into them. bihtree's wheel
comes from build/wheels, where `make` has put it. A host whose Python is not on this machine is named and left out.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent
LOCKS = PROJECT / "tests" / "hosts"
HOSTS = PROJECT / "build" / "hosts"
TESTS = PROJECT / "tests" / "blender"

REAL_BLENDER = (
    *("test_installed.py", "test_window.py", "test_viewport.py", "test_package.py"),
    *("test_overlay_window.py", "test_many_window.py"),
)
"""These start a Blender of their own, whichever module there is."""
PYTEST = "import os, sys, pytest; code = pytest.main(sys.argv[1:]); sys.stdout.flush(); os._exit(code)"
"""pytest, without the end of Blender: the module 4.2.23 crashes there once it has written a .glb, whoever asks."""
SHORT = ("test_engine.py", "test_export.py", "test_registration.py")


@dataclass(frozen=True)
class Host:
    version: str
    python: str
    """Of which version CPython has to be."""
    is_own: bool = False
    """Whether it is in the environment that runs this."""

    @property
    def lock(self) -> Path:
        return LOCKS / f"blender-{self.version}.lock"

    @property
    def interpreter(self) -> Path:
        return Path(sys.executable) if self.is_own else HOSTS / self.version / "bin" / "python"


ALL = (Host("4.2", "3.11"), Host("4.5", "3.11"), Host("5.0", "3.11", is_own=True), Host("5.2", "3.13"))


def python_of(version: str) -> str | None:
    """An interpreter of this version: the one that runs this, one on PATH, or one that pyenv has."""
    name = f"python{version}"
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
    found = [sys.executable, shutil.which(name) or "", *map(str, sorted(pyenv.glob(f"{version}.*/bin/{name}")))]
    code = "import sys; print('%d.%d' % sys.version_info[:2])"
    for candidate in filter(None, found):
        run = subprocess.run([candidate, "-c", code], capture_output=True, text=True, check=False)
        if run.returncode == 0 and run.stdout.strip() == version:
            return candidate
    return None


def set_up(host: Host, python: str) -> None:
    """The environment as its lock file says, made anew where that has changed; bihtree always as it is now."""
    folder, stamp = HOSTS / host.version, HOSTS / host.version / "lock"
    digest = hashlib.sha256(host.lock.read_bytes()).hexdigest()
    install = [str(host.interpreter), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    if not stamp.exists() or stamp.read_text() != digest:
        print(f"Installing Blender {host.version} as a module into {folder} (once; 400 MB)", flush=True)
        shutil.rmtree(folder, ignore_errors=True)
        subprocess.run([python, "-m", "venv", str(folder)], check=True)
        subprocess.run([*install, "--require-hashes", "--requirement", str(host.lock)], check=True)
        stamp.write_text(digest)
    wheels = sorted((PROJECT / "build" / "wheels").glob("bihtree-*.whl"))
    if not wheels:
        raise SystemExit("hosts.py: build/wheels has no wheel of bihtree; run it as `make test-hosts`")
    subprocess.run([*install, "--no-deps", "--no-index", "--force-reinstall", *map(str, wheels)], check=True)


def test(host: Host, *, short: bool) -> int:
    """The exit status of pytest."""
    tests = SHORT if short else sorted(path.name for path in TESTS.glob("test_*.py") if path.name not in REAL_BLENDER)
    command = [str(host.interpreter), "-c", PYTEST, "--quiet", *(str(TESTS / name) for name in tests)]
    return subprocess.run(command, cwd=PROJECT, check=False).returncode


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="what the engine and the export need, alone")
    parser.add_argument("version", nargs="*", help="all of them by default")
    arguments = parser.parse_args()
    if unknown := set(arguments.version) - {host.version for host in ALL}:
        parser.error(f"unknown version {', '.join(sorted(unknown))}")
    failed = []
    for host in ALL:
        if arguments.version and host.version not in arguments.version:
            continue
        python = python_of(host.python)
        if python is None:
            print(f"Blender {host.version} is left out: it needs Python {host.python}, which is not here")
            if os.environ.get("CI"):
                failed.append(host.version)
            continue
        if not host.is_own:
            set_up(host, python)
        print(f"Blender {host.version}", flush=True)
        if test(host, short=arguments.short):
            failed.append(host.version)
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
