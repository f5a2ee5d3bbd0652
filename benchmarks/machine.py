"""The machine and the versions that a measurement is worth nothing without."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def _processor() -> str:
    """Its name, and the wide instruction sets that it has."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    facts = dict(line.split(":", 1) for line in text.split("\n\n")[0].splitlines() if ":" in line)
    named = {name.strip(): value.strip() for name, value in facts.items()}
    flags = set(named.get("flags", "").split())
    wide = [name for name in ("avx2", "avx512f", "avx512vl") if name in flags]
    where = f"family {named.get('cpu family', '?')}, model {named.get('model', '?')}"
    return f"{named.get('model name', platform.machine())} ({where}; {', '.join(wide) or 'no AVX2'})"


def _memory() -> str:
    pages, size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    return f"{pages * size / 2**30:.0f} GiB"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def facts() -> dict[str, str]:
    """What to print, by what it is."""
    rustc = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=False).stdout.strip()
    kernel = platform.release().partition("-")[0]
    packages = ("bihtree", "embreex", "bpy", "numpy")
    return {
        "processor": f"{_processor()}, {len(os.sched_getaffinity(0))} of {os.cpu_count()} logical cores",
        "memory": _memory(),
        "system": f"{platform.system()} {kernel}, {platform.libc_ver()[0]} {platform.libc_ver()[1]}",
        "Rust": f"{rustc}; release, one codegen unit, no link-time optimisation, target-cpu left at its default",
        "Python": f"{platform.python_version()}; {', '.join(f'{name} {_version(name)}' for name in packages)}",
    }
