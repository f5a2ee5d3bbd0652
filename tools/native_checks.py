"""Checks of the Rust core that take more than `cargo test`: another processor, and what memory is read.

python tools/native_checks.py neon      emulated on a 64-bit ARM processor: its lanes, and the same bits as here
python tools/native_checks.py address   the tests in AddressSanitizer
python tools/native_checks.py miri      what Miri can run of them
python tools/native_checks.py loom      every order in which threads can meet at the hand-over of a piece

Where this machine lacks something the check is skipped and says so; with CI set it fails instead.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

NATIVE = Path(__file__).resolve().parent.parent / "native"

HOST = "x86_64-unknown-linux-gnu"
# Its standard library brings a C library along, so that Rust's own linker makes programs that need nothing else.
ARM = "aarch64-unknown-linux-musl"
# Code that is checked runs ten to a thousand times slower: fewer random cases, smaller meshes, and less optimisation,
# which takes longer than it saves.
SHORT = {"PROPTEST_CASES": "8", "CARGO_PROFILE_RELEASE_DEBUG": "0"}
SHORT |= {"CARGO_PROFILE_RELEASE_LTO": "off", "CARGO_PROFILE_RELEASE_CODEGEN_UNITS": "16"}
# Of this workspace alone, so that all else is compiled once.
AVX2 = 'profile.dev.package.bih-core.rustflags=["-Ctarget-feature=+avx2,+fma,+bmi1,+bmi2,+lzcnt,+popcnt"]'
# Beside `tests/memory.rs` and `tests/lanes.rs`, which run all kinds of `unsafe` that Miri knows.
UNSAFE = ("simd", "builders_that_fail")


def neon() -> None:
    """The tests of its lanes, and one number for many answers and pictures that is compared with this machine's."""
    linker = f"CARGO_TARGET_{ARM.upper().replace('-', '_')}"
    environment = {f"{linker}_LINKER": "rust-lld", f"{linker}_RUNNER": "qemu-aarch64"}
    # Unoptimised, as it runs for seconds and would be compiled for minutes.
    there, quiet = ("--package", "bih-core", "--target", ARM), ("--quiet", "--locked")
    cargo("clippy", *quiet, *there, "--", "--deny", "warnings")
    cargo("test", *quiet, *there, "--test", "lanes", environment=environment)
    digest = ("run", *quiet, "--example", "digest")
    theirs = cargo(*digest, *there, environment=environment, output=True)
    # Of no package: what `make test-rust` compiles.
    ours = cargo(*digest, "--profile", "checks", output=True)
    if theirs != ours:
        sys.exit(f"Other bits on ARM: {theirs.strip()} for {ours.strip()}")


def lacking_neon() -> Iterator[str]:
    if platform.system() != "Linux" or platform.machine() != "x86_64":
        yield "an x86-64 Linux that emulates (an ARM processor runs these lanes in `make test-rust`)"
    if shutil.which("qemu-aarch64") is None:
        yield "qemu-aarch64: (Debian, Ubuntu) apt-get install qemu-user"
    if not library_of(ARM).is_dir():
        yield f"Rust's library for ARM: rustup target add {ARM}"


def address() -> None:
    """All tests, in all instruction sets that this processor has."""
    # Every release of Rust has the sanitizer, but only a development version takes the flag: this says it is one.
    environment = SHORT | {"RUSTC_BOOTSTRAP": "1", "RUSTFLAGS": "-Zsanitizer=address"}
    environment["CARGO_TARGET_DIR"] = "target/address"
    what = ("--quiet", "--locked", "--release", "--package", "bih-core", "--target", HOST)
    cargo("test", *what, "--lib", "--tests", environment=environment)


def lacking_address() -> Iterator[str]:
    if not list(library_of(HOST).glob("librustc*_rt.asan.a")):
        yield f"AddressSanitizer for Rust on {HOST}: Rust from https://rustup.rs"


def miri() -> None:
    """The tests of what is unsafe, in scalar code and in AVX2; AVX-512 and NEON it does not know, nor assembly, maps of
    files and the system's advice."""
    # Powers and the like are exact only as far as the C library says, which Miri would make the most of.
    flags = "-Zmiri-disable-isolation -Zmiri-deterministic-floats"
    # The threads of rayon's global pool never end; its queues keep addresses as numbers and follow the newer rules of
    # borrowing only.
    flags += " -Zmiri-ignore-leaks -Zmiri-permissive-provenance -Zmiri-tree-borrows"
    environment = {"PROPTEST_CASES": "1", "MIRIFLAGS": flags}
    # Where there is AVX2, scalar code is tested beside it.
    common = ("+nightly", "miri", "test", "-Zprofile-rustflags", "--config", AVX2)
    what = (*common, "--quiet", "--locked", "--package", "bih-core")
    cargo(*what, "--lib", "--", *UNSAFE, environment=environment)
    cargo(*what, "--test", "memory", "--test", "lanes", environment=environment)


def lacking_miri() -> Iterator[str]:
    if subprocess.run(["cargo", "+nightly", "miri", "--version"], capture_output=True, check=False).returncode != 0:
        yield "Miri: rustup toolchain install nightly --component miri --component rust-src"


def loom() -> None:
    """The hand-over of pieces that are built on demand, by the language's own model of memory."""
    environment = {"RUSTFLAGS": "--cfg loom", "CARGO_TARGET_DIR": "target/loom"}
    cargo("test", "--quiet", "--locked", "--package", "bih-loom", environment=environment)


def lacking_loom() -> Iterator[str]:
    return iter(())


def library_of(target: str) -> Path:
    command = ["rustc", "--print", "target-libdir", "--target", target]
    return Path(subprocess.check_output(command, cwd=NATIVE, text=True).strip())


def cargo(*arguments: str, environment: dict[str, str] | None = None, output: bool = False) -> str:
    """What it prints, where that is asked for."""
    run = subprocess.run(
        ["cargo", *arguments],
        cwd=NATIVE,
        env=os.environ | (environment or {}),
        stdout=subprocess.PIPE if output else None,
        text=True,
        check=False,
    )
    if run.returncode != 0:
        sys.exit(f"failed: cargo {' '.join(arguments)}")
    return run.stdout


CHECKS: dict[str, tuple[Callable[[], None], Callable[[], Iterator[str]]]] = {
    "neon": (neon, lacking_neon),
    "address": (address, lacking_address),
    "miri": (miri, lacking_miri),
    "loom": (loom, lacking_loom),
}


def main(name: str) -> None:
    check, lacking = CHECKS[name]
    if lacks := "; ".join(lacking()):
        text = f"The {name} check is skipped. This machine lacks {lacks}"
        if os.environ.get("CI"):
            sys.exit(text)
        print(text)
    else:
        check()


if __name__ == "__main__":
    main(sys.argv[1])
