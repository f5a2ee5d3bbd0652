"""A tree as files: the one that bihtree.Tree.load reads, and an .npz of its nodes."""

from __future__ import annotations

from pathlib import Path

import bihtree
import numpy as np

from .built import Told
from .errors import UserError
from .files import check_target, written_beside

SUFFIX = ".bihtree"


def nodes_path(path: Path) -> Path:
    return path.with_suffix(".npz")


def check(path: Path) -> None:
    """Raise UserError unless both files can be made."""
    if path.suffix != SUFFIX:
        raise UserError(f"{path}: a saved tree ends in {SUFFIX}", exit_status=2)
    check_target(path)
    check_target(nodes_path(path))


def write(tree: bihtree.Tree, path: Path, *, told: Told = lambda _line, _share: None) -> tuple[Path, Path]:
    """`path` for bihtree.Tree.load, and beside it an .npz: `nodes`, the rows of Tree.nodes(), and `order`, those of
    Tree.order(). Raises UserError where they cannot be written; then neither is half there."""
    check(path)
    told("writing the tree", 0.0)
    try:
        tree.save(path)
    except OSError as error:
        raise UserError(f"cannot write {path}: {error.strerror or error}") from error
    told("writing its nodes", 0.5)
    with written_beside(nodes_path(path)) as beside:
        np.savez(beside, nodes=tree.nodes(), order=tree.order())
    return path, nodes_path(path)
