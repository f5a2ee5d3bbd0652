"""What is missing on a machine is named in one line, with what to install."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.blender import real
from tools import check_machine, native_checks, real_blender

PROJECT = Path(__file__).resolve().parent.parent


def test_this_machine_lacks_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert check_machine.main(["--tests"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_machine_without_rust_and_linker(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    assert check_machine.main([]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "cargo" in line
    assert "https://rustup.rs" in line
    assert "apt-get install gcc libc6-dev" in line


def test_a_machine_without_a_library_of_bpy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(check_machine.LIBRARIES, "libNowhere.so.6", "libnowhere6")
    assert check_machine.main([]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "libNowhere.so.6" in line
    assert "apt-get install libnowhere6" in line
    assert check_machine.main(["--debian-packages"]) == 0
    assert capsys.readouterr().out == "libnowhere6\n"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the bpy wheel needs no libraries of the system")
def test_the_libraries_that_bpy_is_linked_with_are_looked_for() -> None:
    """What the module and the wheel's own libraries under it name, but for the C and C++ libraries of any Linux."""
    spec = importlib.util.find_spec("bpy")
    assert spec is not None
    assert spec.origin is not None
    wheel = {path.name: path for path in Path(spec.origin).parent.glob("lib/*.so*")}
    outside: set[str] = set()
    seen: set[Path] = set()
    unread = [Path(spec.origin)]
    while unread:
        binary = unread.pop()
        seen.add(binary)
        dynamic = subprocess.run(["readelf", "--dynamic", binary], capture_output=True, text=True, check=True).stdout
        needed = {line.split("[")[1].rstrip("]") for line in dynamic.splitlines() if "(NEEDED)" in line}
        unread.extend({wheel[name] for name in needed & wheel.keys()} - seen)
        outside |= needed - wheel.keys()
    of_any_linux = r"(lib(c|m|dl|rt|pthread|util|stdc\+\+|gcc_s)|ld-linux.*)\.so\.\d+"
    assert {name for name in outside if not re.fullmatch(of_any_linux, name)} == set(check_machine.LIBRARIES)


@pytest.mark.parametrize("check", ["neon", "address", "miri"])
def test_a_check_of_the_core_that_cannot_run_is_skipped_and_ci_fails(
    check: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run, _ = native_checks.CHECKS[check]
    monkeypatch.setitem(native_checks.CHECKS, check, (run, lambda: iter(["a thing: get one", "another"])))
    monkeypatch.setenv("CI", "")
    native_checks.main(check)
    text = f"The {check} check is skipped. This machine lacks a thing: get one; another"
    assert capsys.readouterr().out.strip() == text
    monkeypatch.setenv("CI", "true")
    with pytest.raises(SystemExit, match=text):
        native_checks.main(check)


def test_a_machine_without_an_emulator(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(native_checks, "library_of", lambda target: tmp_path / target)
    assert "; ".join(native_checks.lacking_neon()).endswith("rustup target add aarch64-unknown-linux-musl")
    assert "apt-get install qemu-user" in "; ".join(native_checks.lacking_neon())
    assert "AddressSanitizer" in "".join(native_checks.lacking_address())


def test_make_without_python() -> None:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}
    done = subprocess.run(
        ["make", "PYTHON=", "preview"], cwd=PROJECT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "lacks Python 3.11" in done.stderr.splitlines()[0]
    assert "Traceback" not in done.stderr


@pytest.fixture
def no_blender(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """The cache folder of a machine that has no Blender, yet."""
    find = shutil.which
    monkeypatch.setattr(shutil, "which", lambda name: None if name == "blender" else find(name))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    real_blender.find.cache_clear()
    yield tmp_path / "bih-for-blender"
    real_blender.find.cache_clear()


@pytest.mark.parametrize(("ci", "outcome"), [("", pytest.skip.Exception), ("true", pytest.fail.Exception)])
def test_without_a_blender_its_tests_skip_and_ci_fails(
    ci: str, outcome: type[BaseException], no_blender: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CI", ci)
    with pytest.raises(outcome, match=r"install 4\.2 or later from https://www\.blender\.org"):
        real.blender()


@pytest.mark.skipif(os.geteuid() != 0 or sys.platform != "linux", reason="only root on Linux sets a Blender up")
def test_a_set_up_that_fails_leaves_nothing_that_looks_complete(
    no_blender: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(real_blender, "SET_UP", 'mkdir -p "$2/usr/bin"; echo the mirror is away; exit 3')
    no_blender.mkdir()
    with pytest.raises(real_blender.Unavailable, match=r"the mirror is away.*set-up\.log"):
        real_blender._make_root()
    assert not real_blender._root().exists()
    with pytest.raises(real_blender.Unavailable):
        real_blender.find()
