"""A real Blender for the tests: the one on PATH where it is 4.2 or later, else Debian 13's 4.3.2 in a chroot.

    python tools/real_blender.py        set it up where it is missing; print the path of an executable that runs it

The chroot is made once, by root on Debian, and kept in the user's cache folder. It has OpenImageIO for Blender's
Python, and what a window needs: an X server without a screen, a window manager, and a way to take its picture.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent
OLDEST = (4, 2)
SUITE = "trixie"
KEYRING = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
WINDOW_PROGRAMS = {"xvfb-run": "xvfb", "xauth": "xauth", "openbox": "openbox", "import": "imagemagick"}
SET_UP_PROGRAMS = {"debootstrap": "debootstrap", "unshare": "util-linux"}
WINDOW_SIZE = (1600, 1000)
PACKAGES = (
    *("blender", "python3-numpy", "python3-openimageio"),
    *(*WINDOW_PROGRAMS.values(), "libgl1-mesa-dri", "libegl1", "libgl1"),
)

# $1 suite, $2 the new root, $3 mirror, $4 keyring; then the packages. A mirror may be https; no service is to start
# inside; Blender looks for /etc/mtab.
SET_UP = """
suite=$1 root=$2 mirror=$3 keyring=$4
shift 4
debootstrap --variant=minbase --include=ca-certificates --force-check-gpg --keyring="$keyring" \\
    "$suite" "$root" "$mirror"
mount --rbind /dev "$root/dev"
mount -t proc proc "$root/proc"
printf '#!/bin/sh\\nexit 101\\n' > "$root/usr/sbin/policy-rc.d"
chmod +x "$root/usr/sbin/policy-rc.d"
ln -sf /proc/self/mounts "$root/etc/mtab"
inside="chroot $root /usr/bin/env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8"
$inside apt-get install --yes --no-install-recommends "$@"
$inside apt-get clean
"""


class Unavailable(Exception):
    """No real Blender here: one line that says why, and what to install."""


@dataclass(frozen=True)
class RealBlender:
    """A Blender of this version; `inside` is what comes before a command so that it runs where this Blender is."""

    version: tuple[int, ...]
    inside: tuple[str, ...] = ()

    def command(self, *arguments: object) -> list[str]:
        """The arguments become text: strings, paths, numbers."""
        return [*self.inside, "blender", *map(str, arguments)]

    def window_command(self, *arguments: object) -> list[str]:
        """The same in a window of WINDOW_SIZE, drawn in software; Blender draws nothing without a window manager."""
        if not self.inside:
            lacking = [package for program, package in WINDOW_PROGRAMS.items() if shutil.which(program) is None]
            if lacking:
                raise Unavailable(f"a window for Blender: apt-get install {' '.join(lacking)}")
        screen = "-screen 0 {}x{}x24".format(*WINDOW_SIZE)
        start = 'openbox & exec "$@"'
        server = ["env", "LIBGL_ALWAYS_SOFTWARE=1", "xvfb-run", "--auto-servernum", "--server-args", screen]
        return [*self.inside, *server, "sh", "-c", start, "sh", "blender", *map(str, arguments)]


@cache
def find() -> RealBlender:
    """The Blender that is there now; Unavailable if there is none."""
    executable = shutil.which("blender")
    version = _version([executable]) if executable else None
    if version and version >= OLDEST:
        return RealBlender(version)
    root = _root()
    if not root.is_dir():
        raise Unavailable(
            "a real Blender: install 4.2 or later from https://www.blender.org/download/ and put it on PATH, "
            "or, on Debian as root, run `make real-blender`"
        )
    if os.geteuid() != 0:
        raise Unavailable(f"a real Blender: only root can enter {root}")
    inside = (str(PROJECT / "tools" / "in_chroot.sh"), str(root), str(PROJECT))
    version = _version([*inside, "blender"])
    if version is None:
        raise Unavailable(f"a real Blender: the one in {root} does not start; delete that folder, `make real-blender`")
    return RealBlender(version, inside)


def set_up() -> RealBlender:
    """The Blender that is there, or a new one; Unavailable if it cannot be made here."""
    try:
        return find()
    except Unavailable:
        if _root().is_dir() or not Path("/etc/debian_version").exists() or os.geteuid() != 0:
            raise
    lacking = [package for program, package in SET_UP_PROGRAMS.items() if shutil.which(program) is None]
    if not KEYRING.exists():
        lacking.append("debian-archive-keyring")
    if lacking:
        raise Unavailable(f"a real Blender: to set one up, apt-get install {' '.join(lacking)}")
    with _locked(_cache_folder()):
        if not _root().is_dir():
            _make_root()
    find.cache_clear()
    return find()


def mirror() -> str:
    """The Debian mirror that this system's own apt sources name."""
    query = ["apt-get", "indextargets", "--format", "$(ORIGIN) $(LABEL) $(REPO_URI)", "Created-By: Packages"]
    for update_first in (False, True):
        if update_first:
            subprocess.run(["apt-get", "update"], stdout=subprocess.DEVNULL, check=False)
        for line in subprocess.run(query, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines():
            origin, label, address = line.split(" ", 2)
            if (origin, label) == ("Debian", "Debian"):
                return address
    raise Unavailable("a real Blender: this system's apt sources name no Debian mirror to set one up from")


def _make_root() -> None:
    """Fill a folder beside the root's place, then move it there: what stands there is complete."""
    folder = _cache_folder()
    for leftover in folder.glob("unfinished-*"):
        shutil.rmtree(leftover)
    unfinished = Path(tempfile.mkdtemp(prefix="unfinished-", dir=folder))
    unfinished.chmod(0o755)  # apt downloads as a user of its own
    log = folder / "set-up.log"
    namespace = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "--propagation", "private"]
    command = [*namespace, "sh", "-euc", SET_UP, "sh", SUITE, str(unfinished), mirror(), str(KEYRING), *PACKAGES]
    print(f"Setting up a Blender from Debian {SUITE} in {folder} (a minute or two; log: {log})", file=sys.stderr)
    with log.open("w") as output:
        made = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, check=False)
    if made.returncode != 0:
        last = log.read_text(errors="replace").strip().splitlines()[-1:]
        raise Unavailable(f"a real Blender: its set-up failed ({''.join(last)}); all of it is in {log}")
    unfinished.rename(_root())


def _root() -> Path:
    """One folder a recipe, so that a change of the recipe makes a new one."""
    digest = hashlib.sha256(" ".join((SUITE, *PACKAGES, SET_UP)).encode()).hexdigest()
    return _cache_folder() / f"{SUITE}-{digest[:8]}"


def _cache_folder() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "bih-for-blender"


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """One set-up at a time, over processes; the lock goes with the process."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _version(command: list[str]) -> tuple[int, ...] | None:
    try:
        output = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    found = re.search(r"^Blender (\d+)\.(\d+)\.(\d+)", output, re.MULTILINE)
    return tuple(int(part) for part in found.groups()) if found else None


def main() -> int:
    try:
        blender = set_up()
    except Unavailable as error:
        print(f"There is no real Blender here, and its tests will be skipped. Missing: {error}", file=sys.stderr)
        return 1
    wrapper = PROJECT / "build" / "blender"
    wrapper.parent.mkdir(exist_ok=True)
    wrapper.write_text(f'#!/bin/sh\nexec {shlex.join(blender.command())} "$@"\n')
    wrapper.chmod(0o755)
    print(wrapper)
    return 0


if __name__ == "__main__":
    sys.exit(main())
