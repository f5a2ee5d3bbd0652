"""What `make package` makes: the add-on and its wheels, and nothing of what builds, tests and explains it."""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path, PurePosixPath

import numpy as np
import pytest

from tests.blender.real import PROJECT, blender, extension, run

ADDON_FILES = {
    path.relative_to(PROJECT).as_posix()
    for path in (PROJECT / "addon").rglob("*")
    if path.is_file() and "__pycache__" not in path.parts
}


@pytest.fixture(scope="module")
def archive() -> zipfile.ZipFile:
    return zipfile.ZipFile(extension())


@pytest.fixture(scope="module")
def manifest(archive: zipfile.ZipFile) -> dict[str, object]:
    return tomllib.loads(archive.read("blender_manifest.toml").decode())


def test_all_of_the_add_on_is_in_it(archive: zipfile.ZipFile) -> None:
    names = set(archive.namelist())
    assert ADDON_FILES
    assert names >= ADDON_FILES | {"__init__.py", "LICENSE"}
    for name in ADDON_FILES:
        assert archive.read(name) == (PROJECT / name).read_bytes()


def test_nothing_else_is_in_it(archive: zipfile.ZipFile) -> None:
    top = {name.partition("/")[0] for name in archive.namelist()}
    assert top <= {"__init__.py", "addon", "wheels", "blender_manifest.toml", "LICENSE", "README.md", "CHANGELOG.md"}
    assert {name for name in archive.namelist() if name.startswith("addon/")} == ADDON_FILES


def ours(archive: zipfile.ZipFile) -> str:
    """bihtree's wheel in it."""
    (name,) = (name for name in archive.namelist() if name.startswith("wheels/bihtree-"))
    return name


def test_the_manifest_names_the_wheels(archive: zipfile.ZipFile, manifest: dict[str, object]) -> None:
    """Ours, and one of pure Python for each pin of requirements-addon.lock, unchanged."""
    wheels = [name for name in archive.namelist() if name.startswith("wheels/")]
    assert sorted(manifest["wheels"]) == sorted(f"./{name}" for name in wheels)
    locked = (PROJECT / "requirements-addon.lock").read_text()
    pins = set(re.findall(r"^([\w-]+)==(\S+)", locked, re.MULTILINE))
    pure = [name for name in wheels if name != ours(archive)]
    assert {tuple(PurePosixPath(name).name.split("-")[:2]) for name in pure} == {
        (name.replace("-", "_"), version) for name, version in pins
    }
    for name in pure:
        assert name.endswith("-py3-none-any.whl")
        assert f"sha256:{hashlib.sha256(archive.read(name)).hexdigest()}" in locked


def test_the_manifest_keeps_to_the_rules(manifest: dict[str, object]) -> None:
    assert manifest["schema_version"] == "1.0.0"
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["blender_version_min"] == "4.2.0"
    assert "blender" not in str(manifest["id"])


def test_one_version_everywhere(archive: zipfile.ZipFile, manifest: dict[str, object]) -> None:
    cargo = tomllib.loads((PROJECT / "native" / "Cargo.toml").read_text())
    wheel = PurePosixPath(ours(archive)).name
    assert manifest["version"] == cargo["workspace"]["package"]["version"] == wheel.split("-")[1]
    assert f"## {manifest['version']}" in (PROJECT / "CHANGELOG.md").read_text()


def test_the_wheel_runs_wherever_blender_does(archive: zipfile.ZipFile, tmp_path: Path) -> None:
    """Any CPython from 3.11 on, and on Linux the glibc 2.28 that Blender's own builds ask for."""
    name = ours(archive)
    python, abi, tag = PurePosixPath(name).stem.split("-")[-3:]
    assert (python, abi) == ("cp311", "abi3")
    if sys.platform != "linux":
        return
    assert tag == "manylinux_2_28_x86_64"
    with zipfile.ZipFile(archive.open(name)) as wheel:
        (module,) = (part for part in wheel.namelist() if part.endswith(".so"))
        wanted = set(re.findall(rb"GLIBC_(\d+)\.(\d+)", wheel.read(module)))
    assert wanted
    assert max((int(major), int(minor)) for major, minor in wanted) <= (2, 28)


def test_the_packaged_wheel_gives_the_same_bits(archive: zipfile.ZipFile, tmp_path: Path) -> None:
    """It is linked by another linker than the module that all other tests run: one picture by both."""
    name = ours(archive)
    with zipfile.ZipFile(archive.open(name)) as wheel:
        wheel.extractall(tmp_path)
    code = (
        "import sys, numpy, bihtree; print(bihtree.__file__); "
        "rng = numpy.random.default_rng(1); v = rng.random((3000, 3)); "
        "h = bihtree.Tree(v).intersect(rng.random((5000, 3)) - 2, rng.random((5000, 3))); "
        "assert h.hit.any(); numpy.savez(sys.argv[1], t=h.t, triangle=h.triangle, u=h.u, v=h.v)"
    )
    answers = []
    for number, environment in enumerate([{}, {"PYTHONPATH": str(tmp_path)}]):
        answer = tmp_path / f"{number}.npz"
        command = [sys.executable, "-c", code, str(answer)]
        done = subprocess.run(command, env=environment, cwd=PROJECT, check=True, capture_output=True, text=True)
        assert Path(done.stdout).is_relative_to(tmp_path) == bool(environment)
        answers.append(np.load(answer))
    for field in ("t", "triangle", "u", "v"):
        assert np.array_equal(answers[0][field], answers[1][field])


def test_blender_finds_it_valid() -> None:
    done = run(blender().command("--command", "extension", "validate", extension()))
    assert done.returncode == 0, done.stdout + done.stderr


def test_blender_builds_the_same_from_the_repository(archive: zipfile.ZipFile, tmp_path: Path) -> None:
    """Without the wheel, which only `make package` puts in."""
    built = tmp_path / "built.zip"
    build = ["--command", "extension", "build", "--source-dir", PROJECT, "--output-filepath", built]
    done = run(blender().command(*build))
    assert done.returncode == 0, done.stdout + done.stderr
    with zipfile.ZipFile(built) as other:
        assert sorted(other.namelist()) == sorted(name for name in archive.namelist() if not name.startswith("wheels/"))
