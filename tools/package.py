"""The extension's zip, with bihtree's wheel and those of requirements-addon.lock inside, made by the builder that
comes with bpy.

build/venv/bin/python tools/package.py                 print the path of the zip in build/
build/venv/bin/python tools/package.py linux-arm64     for that platform, on any Linux that has Rust's library for it
build/venv/bin/python tools/package.py --wheel FOLDER  bihtree's wheel alone
"""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent
WORK = PROJECT / "build" / "package"

# Blender's names of the platforms that it runs on.
PLATFORMS = {
    ("Linux", "x86_64"): "linux-x64",
    ("Linux", "aarch64"): "linux-arm64",
    ("Darwin", "arm64"): "macos-arm64",
    ("Darwin", "x86_64"): "macos-x64",
    ("Windows", "AMD64"): "windows-x64",
}
# What Rust calls those that another one can build for.
TARGETS = {"linux-x64": "x86_64-unknown-linux-gnu", "linux-arm64": "aarch64-unknown-linux-gnu"}
# Blender for Linux asks for glibc 2.28; zig links against that one, where this machine's own linker would ask for
# the glibc of this machine.
LINUX_PORTABLE = ("--zig", "--compatibility", "manylinux_2_28")


def this_platform() -> str:
    """Blender's name of it."""
    return PLATFORMS[platform.system(), platform.machine()]


def build_wheel(blender_platform: str, folder: Path) -> Path:
    """bihtree for any machine of the platform that Blender itself runs on."""
    scripts = Path(sys.executable).parent
    portable = LINUX_PORTABLE if platform.system() == "Linux" else ()
    target = () if blender_platform == this_platform() else ("--target", TARGETS[blender_platform])
    shutil.rmtree(folder, ignore_errors=True)
    _run(
        *(scripts / "maturin", "build", "--manifest-path", PROJECT / "native" / "bih-python" / "Cargo.toml"),
        *("--release", "--locked", *portable, *target, "--out", folder),
    )
    (wheel,) = folder.glob("*.whl")
    return wheel


def pure_wheels(folder: Path) -> list[Path]:
    """Those that are pinned, with their hashes; the package index has them."""
    shutil.rmtree(folder, ignore_errors=True)
    pinned = ("--require-hashes", "--requirement", PROJECT / "requirements-addon.lock")
    _run(
        *(sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"),
        *("--no-deps", "--only-binary", ":all:", *pinned, "--dest", folder),
    )
    return sorted(folder.glob("*-none-any.whl"))


def build_extension(blender_platform: str, wheels: list[Path]) -> Path:
    """Blender's builder twice: it leaves out what the manifest excludes, then puts the wheels in.

    The manifest of the repository cannot name them: a file name says which platform bihtree's was built on.
    """
    source, part = WORK / "source", WORK / "without_wheels.zip"
    shutil.rmtree(source, ignore_errors=True)
    _blender_extension("build", "--source-dir", PROJECT, "--output-filepath", part)
    with zipfile.ZipFile(part) as archive:
        archive.extractall(source)
    (source / "wheels").mkdir()
    for wheel in wheels:
        shutil.copy2(wheel, source / "wheels")

    manifest = source / "blender_manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    names = ", ".join(f'"./wheels/{wheel.name}"' for wheel in wheels)
    added = f'wheels = [{names}]\nplatforms = ["{blender_platform}"]\n'
    manifest.write_text(added + text, encoding="utf-8")

    about = tomllib.loads(text)
    result = PROJECT / "build" / f"{about['id']}-{about['version']}-{blender_platform.replace('-', '_')}.zip"
    _blender_extension("build", "--source-dir", source, "--output-filepath", result)
    _blender_extension("validate", result)
    return result


def _blender_extension(*arguments: str | Path) -> None:
    """What `blender --command extension` runs; it is the same file in Blender and in the bpy wheel."""
    spec = importlib.util.find_spec("bpy")
    assert spec is not None
    assert spec.origin is not None
    (script,) = Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    _run(sys.executable, script, *arguments)


def _run(*command: str | Path) -> None:
    """Run quietly, with this environment's programs first on PATH; say all of it where it fails."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run = subprocess.run(command, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{run.stdout}{run.stderr}")


def main(arguments: list[str]) -> None:
    if arguments[:1] == ["--wheel"]:
        print(build_wheel(this_platform(), Path(arguments[1])))
        return
    print("Building the extension (five minutes or so at first)", file=sys.stderr)
    chosen = arguments[0] if arguments else this_platform()
    if chosen not in {this_platform(), *TARGETS}:
        sys.exit(f"{chosen} cannot be built for here; {', '.join(TARGETS)} can be, on Linux")
    ours = build_wheel(chosen, WORK / "wheels")
    print(build_extension(chosen, [ours, *pure_wheels(WORK / "pure")]))


if __name__ == "__main__":
    main(sys.argv[1:])
