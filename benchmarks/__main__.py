"""Measure bihtree beside its peers and write docs/benchmarks.md: `python -m benchmarks`, or `make bench`.

    python -m benchmarks                              what has not been measured on these sources yet, then the page
    python -m benchmarks --scene bunny --part build   these again, then the page
    python -m benchmarks --quick                      small scenes; answers and counts are asserted, no clock is
    python -m benchmarks --page                       the page alone

An interrupted run goes on where it stopped.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import perf_counter

from . import sides
from .harness import Failed, Harness
from .meshes import Unavailable, scene, written
from .plan import PARTS, Job, jobs
from .store import Store


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="assert answers and counts on small scenes")
    parser.add_argument("--page", action="store_true", help="write the page from what was measured before")
    parser.add_argument("--scene", action="append", help="only this one, again; may be repeated")
    parser.add_argument("--part", action="append", choices=PARTS, help="only this one, again; may be repeated")
    parser.add_argument("--threads", type=int, choices=(1, 2), help="only these, again")
    parser.add_argument("--again", action="store_true", help="measure all again")
    parser.add_argument("--list", action="store_true", help="say what would be measured")
    parser.add_argument("--meshes", type=Path, help="folder of the meshes that no formula makes")
    parser.add_argument("--wrap", default="", help="a command to run each measurement under")
    return parser.parse_args()


def _chosen(arguments: argparse.Namespace, store: Store) -> list[Job]:
    """Those asked for; if none is named, those that are not fresh."""
    is_named = bool(arguments.scene or arguments.part or arguments.threads)
    found = []
    for job in jobs():
        is_asked = (
            (not arguments.scene or job.scene.partition("@")[0] in arguments.scene or job.scene in arguments.scene)
            and (not arguments.part or job.part in arguments.part)
            and (not arguments.threads or job.threads == arguments.threads)
        )
        if is_asked and (is_named or arguments.again or not store.is_fresh(job)):
            found.append(job)
    return found


def _measure(job: Job, harness: Harness, known: set[str], meshes: Path | None, store: Store) -> None:
    if job.table == "python":
        from .python_peers import measure

        store.put(job, measure(scene(job.scene, meshes)))
    else:
        store.put(job, harness.run(written(job.scene, meshes), job.options(known)))


def _measure_all(arguments: argparse.Namespace, store: Store) -> bool:
    """Whether all went well; a job that fails does not hold up the others."""
    harness = Harness.built(arguments.wrap)
    named = {sides.side_of(call) for job in jobs() for call in job.sides}
    known = harness.known(sorted(named))
    print(f"not built yet, so left out: {', '.join(sorted(named - known)) or 'nothing'}")
    chosen = _chosen(arguments, store)
    is_well = True
    for number, job in enumerate(chosen, 1):
        print(f"{number:>3} of {len(chosen)}  {job.name}", end="", flush=True)
        start = perf_counter()
        try:
            _measure(job, harness, known, arguments.meshes, store)
            print(f"  {perf_counter() - start:.0f} s")
        except Unavailable as reason:
            print(f"  skipped: {reason}")
        except Failed as reason:
            print(f"  failed: {reason}")
            is_well = False
    return is_well


def main() -> int:
    arguments = _arguments()
    store = Store()
    if arguments.list:
        print("\n".join(job.name for job in _chosen(arguments, store)))
        return 0
    try:
        if arguments.quick:
            from .quick import check

            return check()
        is_well = arguments.page or _measure_all(arguments, store)
    except Failed as reason:
        print(reason, file=sys.stderr)
        return 1
    from . import page

    page.write(store)
    print(page.PAGE)
    return 0 if is_well else 1


if __name__ == "__main__":
    sys.exit(main())
