"""The machine and the versions that a measurement is worth nothing without."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import bihtree
import numpy as np

PACKAGES = {"embreex": "embreex", "pygal": "pygal", "matplotlib": "matplotlib", "FLIP": "flip-evaluator", "bpy": "bpy"}


def facts() -> dict[str, str]:
    """What to print, by what it is."""
    found = {
        "processor": _processor(),
        "logical cores": f"{cores()} of {os.cpu_count()} usable",
        "system": f"{platform.system()} {platform.release().partition('-')[0]} on {platform.machine()}",
        "bihtree": f"{bihtree.__version__}, {', '.join(bihtree.cpu_features())}",
        "Python": f"{platform.python_version()}, NumPy {np.__version__}",
    }
    return found | {name: _version(package) for name, package in PACKAGES.items()}


def load() -> str:
    """How busy it is: others at work make every time longer."""
    return f"{os.getloadavg()[0]:.1f}, the mean of a minute" if hasattr(os, "getloadavg") else "not known here"


def cores() -> int:
    """That this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
