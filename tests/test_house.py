"""The rules of the house that a machine can check: where Blender is imported, how long a file is, what is banned."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parent.parent
BLENDER_MODULES = {"bpy", "bpy_extras", "gpu", "gpu_extras", "mathutils", "blf", "bmesh", "aud", "idprop", "imbuf"}
NOT_OURS = {"build", "target", "__pycache__"}


def files(*patterns: str, under: str = ".") -> list[Path]:
    """Files of the project below a folder, without what is built and without hidden folders (but for .ci)."""

    def is_ours(path: Path) -> bool:
        parts = path.relative_to(PROJECT).parts
        return not any(part in NOT_OURS or (part.startswith(".") and part != ".ci") for part in parts[:-1])

    found = {path for pattern in patterns for path in (PROJECT / under).rglob(pattern)}
    return sorted(path for path in found if path.is_file() and is_ours(path))


def shown(path: Path) -> str:
    return str(path.relative_to(PROJECT))


ADDON = [PROJECT / "__init__.py", *files("*.py", under="addon")]
PIPELINE = [path for path in ADDON if "blender" not in path.relative_to(PROJECT).parts]
SOURCES = files("*.py", "*.pyi", "*.rs", "*.sh", "Makefile", "run")


def imports(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """(module, how many dots before it) of every import, wherever it stands."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, 0) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or "", node.level


def test_the_lists_are_not_empty() -> None:
    assert len(PIPELINE) > 5
    assert len(ADDON) > len(PIPELINE) + 5
    assert any(path.suffix == ".rs" for path in SOURCES)
    assert PROJECT / ".ci" / "run" in SOURCES


@pytest.mark.parametrize("path", PIPELINE, ids=shown)
def test_blender_is_imported_only_in_its_room(path: Path) -> None:
    found = {module.partition(".")[0] for module, level in imports(ast.parse(path.read_text())) if level == 0}
    assert not found & BLENDER_MODULES


@pytest.mark.parametrize("path", ADDON, ids=shown)
def test_the_extension_imports_itself_relatively(path: Path) -> None:
    """Installed, the package is called bl_ext.….bih: nothing named `addon` can be imported."""
    absolute = {module.partition(".")[0] for module, level in imports(ast.parse(path.read_text())) if level == 0}
    assert "addon" not in absolute


def test_the_rooms_without_blender_import_without_it() -> None:
    modules = [".".join(path.relative_to(PROJECT).with_suffix("").parts) for path in PIPELINE[1:]]
    names = [module.removesuffix(".__init__") for module in modules]
    block = f"import sys; sys.modules.update(dict.fromkeys({sorted(BLENDER_MODULES)!r}))"
    code = "; ".join([block, *(f"import {name}" for name in names), f"print(len({names!r}))"])
    run = subprocess.run([sys.executable, "-c", code], cwd=PROJECT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert int(run.stdout) == len(names)


@pytest.mark.parametrize(
    ("pattern", "reason"),
    [
        (r"\bas_pointer\(", "an address of Blender's own data"),
        (r"\bsys\.path\b", "an edit of the module path"),
        (r"\bimport (pip|ensurepip|subprocess)\b", "an installation at run time, or another program"),
        (r"\bexcept:|\bexcept (Base)?Exception\b[^\n]*:\s*pass", "a swallowed exception"),
        (r"^\s*global \w", "mutable module state"),
        (r"\bbreakpoint\(\)", "a left-over of debugging"),
    ],
)
def test_the_add_on_does_without(pattern: str, reason: str) -> None:
    found = [shown(path) for path in ADDON if re.search(pattern, path.read_text(), re.MULTILINE)]
    assert not found, reason


def test_a_render_engine_has_no_init() -> None:
    """Blender 5.0 breaks on one."""
    engines = [
        node
        for path in ADDON
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef) and any(ast.unparse(base).endswith("RenderEngine") for base in node.bases)
    ]
    assert engines
    assert not [node.name for node in engines if "__init__" in {getattr(part, "name", "") for part in node.body}]


@pytest.mark.parametrize("path", SOURCES, ids=shown)
def test_a_source_file_is_one_noun(path: Path) -> None:
    """Seldom over 300 lines; 400 is never needed."""
    assert len(path.read_text().splitlines()) <= 400


def test_no_file_is_large() -> None:
    """But for the module itself, where maturin has put it beside its Python part."""
    large = [path for path in files("*") if path.stat().st_size > 3_000_000]
    assert not [shown(path) for path in large if path.suffix not in {".so", ".pyd"}]


PINNED = [shown(path.with_suffix("")) for path in files("*.in") if path.with_suffix(".lock").exists()]


@pytest.mark.parametrize("name", PINNED)
def test_every_pin_has_its_reason_and_its_hashes(name: str) -> None:
    lines = PROJECT.joinpath(f"{name}.in").read_text().splitlines()
    pins = [line for line in lines if line and not line.startswith(("#", "-r "))]
    assert pins
    assert not [pin for pin in pins if not re.fullmatch(r"[\w-]+==\S+ +# .+", pin)]
    locked = PROJECT.joinpath(f"{name}.lock").read_text()
    for pin in pins:
        assert re.search(rf"^{re.escape(pin.split()[0])} \\\n    --hash=sha256:", locked, re.MULTILINE)
    assert "://" not in locked
    assert "index" not in locked


def test_unsafe_code_is_denied() -> None:
    native = PROJECT / "native"
    assert "#![deny(unsafe_code)]" in (native / "bih-core" / "src" / "lib.rs").read_text()
    assert "#![forbid(unsafe_code)]" in (native / "bih-python" / "src" / "lib.rs").read_text()


RUST = [path for path in SOURCES if path.suffix == ".rs"]


@pytest.mark.parametrize("path", RUST, ids=shown)
def test_rust_is_finished_and_says_why_it_is_unsafe(path: Path) -> None:
    text = path.read_text()
    assert not re.search(r"\b(todo|unimplemented|dbg)!", text)
    assert not re.search(r"#\[ignore\]", text), 'an ignored test says why: #[ignore = "…"]'
    assert not re.search(r"#!?\[(allow|expect)\((?![^]]*reason)[^]]*\)\]", text), "a lint exception carries its reason"
    for block in re.finditer(r"^(.*\n){0,4}.*\bunsafe (\{|impl)", text, re.MULTILINE):
        assert "SAFETY" in block[0]


FREE = {"MIT", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "Zlib", "Unicode-3.0"}


def allows(licence: str) -> bool:
    """Whether an SPDX expression without AND inside OR allows use in a work under the GPL, version 3 or later."""
    parts = [part.strip(" ()") for part in licence.replace("/", " OR ").split(" AND ")]
    return all(FREE & {choice.strip(" ()") for choice in part.split(" OR ")} for part in parts)


def test_every_crate_may_be_used_under_the_gpl() -> None:
    assert allows("MIT OR GPL-2.0-only")
    assert not allows("MIT AND GPL-2.0-only")
    command = ["cargo", "metadata", "--format-version", "1", "--locked"]
    text = subprocess.check_output(command, cwd=PROJECT / "native", text=True)
    packages = json.loads(text)["packages"]
    crates = {crate["name"]: crate["license"] or "" for crate in packages if crate["source"]}
    assert "rayon" in crates
    assert not {name: licence for name, licence in crates.items() if not allows(licence)}


def test_a_skip_says_why() -> None:
    silent = r"\bpytest\.skip\(\)|\bmark\.(skip|skipif|xfail)\b(?!\()|\bmark\.(skip|xfail)\(\)|\bassert True\b"
    tests = [path for path in files("*.py", under="tests") if path != Path(__file__).resolve()]
    assert not [shown(path) for path in tests if re.search(silent, path.read_text())]
