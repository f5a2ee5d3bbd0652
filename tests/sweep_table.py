"""The sweeps over stiffness counted: wrong answers, and the largest errors, of each structure in each precision.

python -m tests.sweep_table [FOLDER]     from the root of the repository; writes sweeps.csv and sweeps.md into FOLDER
"""

from __future__ import annotations

import csv
import os
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from fractions import Fraction
from pathlib import Path

import bihtree
import numpy as np
from numpy.typing import NDArray

from addon.report.markdown import table
from addon.report.sweeps import SWEEPS
from tests.agreement import Promise, distance_error, faults
from tests.meshes import Triangles
from tests.oracle import Oracle, Truth

RAYS = int(os.environ.get("BIHTREE_SWEEP_RAYS", "10000"))
STRUCTURES: dict[str, dict[str, str]] = {
    "bih": {},
    "bih on demand": {"build": "on_demand"},
    "bih classic": {"layout": "classic"},
    "kd_tree": {"structure": "kd_tree"},
    "bvh": {"structure": "bvh"},
}
PRECISIONS = ("fast", "watertight", "exact")
NONE = Fraction(0)
ULP = Promise(np.float32, 1, NONE, 0, NONE), Promise(np.float64, 1, NONE, 0, NONE)  # for errors of t in ulp


@dataclass(frozen=True)
class Row:
    """Counts of one k; `wrong`: another triangle than the exact one, of which `lost` are misses of what is hit."""

    sweep: str
    k: int
    dtype: str
    structure: str
    precision: str
    rays: int
    hits: int
    undecided: int
    wrong: int
    lost: int
    beyond_bounds: int
    t_error_ulps: float
    t_error_ulps_999: float
    nodes_a_ray: float


def rows(rays: int = RAYS) -> Iterator[Row]:
    """Every step; `undecided`: rays that the oracle's filter leaves to whole numbers."""
    for name, sweep in SWEEPS.items():
        for k in sweep.ks:
            for dtype in (np.float32, np.float64):
                # Whole numbers decide nearly every pair of many sheets an ulp apart.
                count = max(100, rays // 2 ** max(0, k - 4)) if name == "depth complexity" else rays
                step = sweep.at(k, count, dtype=dtype)
                mesh = Triangles(step.vertices, step.triangles.astype(np.int32))
                truth = Oracle(*mesh).decide(step.origins, step.directions)
                for structure, options in STRUCTURES.items():
                    for precision in PRECISIONS:
                        tree = bihtree.Tree(*mesh, precision=precision, **options)  # type: ignore[arg-type]
                        counts = _counts(tree, truth, step.origins, step.directions)
                        yield Row(name, k, np.dtype(dtype).name, structure, precision, count, *counts)


def _counts(
    tree: bihtree.Tree, truth: Truth, origins: NDArray[np.floating], directions: NDArray[np.floating]
) -> tuple[int, int, int, int, int, float, float, float]:
    hits = tree.intersect(origins, directions)
    nodes, _ = tree.traversal_cost(origins, directions)
    is_hit = truth.triangle >= 0
    is_wrong = hits.triangle != truth.triangle
    precision = tree.stats.precision
    beyond = 0
    if precision != "fast":
        beyond = len({line.split(":")[0] for line in faults(hits, truth, precision)}) - int(is_wrong.sum())
    errors = _ulps(hits, truth, is_hit & ~is_wrong)
    largest = (float(errors.max()), float(np.quantile(errors, 0.999))) if len(errors) else (0.0, 0.0)
    lost = int((is_wrong & is_hit & ~hits.hit).sum())
    return int(is_hit.sum()), truth.undecided, int(is_wrong.sum()), lost, beyond, *largest, float(nodes.mean())


def _ulps(hits: bihtree.Hits, truth: Truth, chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Errors of t, to a hundredth of a unit in the last place of the answers' format."""
    rays, near = np.flatnonzero(chosen), truth.approximate
    places = np.searchsorted(np.flatnonzero(truth.triangle >= 0), rays)
    with np.errstate(all="ignore"):
        unit = np.spacing(np.abs(near.t[places]).astype(hits.t.dtype)).astype(np.float64)
        errors = (np.abs(hits.t[rays] - near.t[places]) / unit).astype(np.float64)
        unknown = ~(near.t_error[places] < 0.01 * unit) | ~np.isfinite(errors)
    promised = ULP[hits.t.dtype == np.float64]
    for i in np.flatnonzero(unknown).tolist():
        expected = truth.hit(int(rays[i]))
        assert expected
        errors[i] = float(distance_error(hits.t[rays[i]], expected.t, promised))
    return errors


def main(arguments: list[str]) -> int:
    folder = Path(arguments[0] if arguments else "build/stress")
    folder.mkdir(parents=True, exist_ok=True)
    names = [field.name for field in fields(Row)]
    found = []
    with open(folder / "sweeps.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        for row in rows():
            writer.writerow(asdict(row))
            found.append(row)
            if row.structure == "bih" and row.precision == "fast" and row.dtype == "float32":
                print(f"{row.sweep}, k = {row.k}", flush=True)
    shown = [[_text(value) for value in asdict(row).values()] for row in found]
    (folder / "sweeps.md").write_text(table(names, shown) + "\n", encoding="utf-8")
    broken = [row for row in found if row.precision != "fast" and (row.wrong or row.beyond_bounds)]
    for row in broken:
        print(f"WRONG: {row}", file=sys.stderr)
    print(f"{sum(row.rays for row in found):,} answers; {len(broken)} rows with wrong ones, fast left out")
    return 1 if broken else 0


def _text(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
