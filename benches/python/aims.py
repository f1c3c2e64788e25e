"""What all three informations cost: evaluations with and without what is needed, and designs for each kind, in one run.

    python benches/python/aims.py [--runs 5] [TASK ...]

Prints the median seconds of each and its ratio to that of what is measured.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import supple

KINDS = ("measured", "used", "needed")


def seconds(what: Callable[[], object]) -> float:
    start = time.perf_counter()
    what()
    return time.perf_counter() - start


def medians(jobs: dict[str, Callable[[], object]], runs: int) -> dict[str, float]:
    """Of jobs in turns, so that a machine that slows down slows all of them."""
    taken: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(runs):
        for name, job in jobs.items():
            taken[name].append(seconds(job))
    return {name: statistics.median(times) for name, times in taken.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("tasks", nargs="*", default=["tasks/two_mass_unsure.toml", "tasks/iiwa_door.toml"])
    asked = parser.parse_args()
    for path in asked.tasks:
        task = supple.load(path)
        jobs: dict[str, Callable[[], object]] = {
            "evaluate, measured": lambda task=task: task.evaluate(needed=False, rollouts=0, gradient="total"),
            "evaluate, all three": lambda task=task: task.evaluate(rollouts=0, gradient="total"),
        }
        for kind in KINDS:
            jobs[f"design, {kind}"] = lambda task=task, kind=kind: task.design(information=kind, rollouts=0, starts=1)
        found = medians(jobs, asked.runs)
        print(path)
        for name, taken in found.items():
            first = found[name.split(",")[0] + ", measured"]
            print(f"  {name:<20} {taken:9.3f} s  {taken / first:6.2f}")


if __name__ == "__main__":
    main()
