"""One file of output: never half written."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import UserError


def check_target(path: Path) -> None:
    """Raise UserError unless a file can be made at `path`: its folder must be there and take new files."""
    folder = path.parent
    if not folder.is_dir():
        raise UserError(f"cannot write {path}: there is no folder {folder}; make it first, or choose another")
    if path.is_dir():
        raise UserError(f"cannot write {path}: it is a folder; add a file name")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UserError(f"cannot write {path}: no permission to make files in {folder}")


@contextmanager
def written_beside(path: Path) -> Iterator[Path]:
    """Give a name in the same folder with the same suffix; what is written there becomes `path` when the block ends,
    and is removed when it raises. An OSError on the way becomes a UserError."""
    beside = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield beside
        os.replace(beside, path)
    except OSError as error:
        raise UserError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        beside.unlink(missing_ok=True)
