"""Own models in JAX beside the built-in one: time per iteration of iLQG, and of a whole evaluation.

python benches/python/own_models.py
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path

import supple

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from jax_models import TwoMass, own_task

#: How often everything is measured.
ROUNDS = 15


def built_in(most: int) -> supple.Task:
    """`tasks/two_mass.toml` with at most so many iterations."""
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
        file.write((ROOT / "tasks" / "two_mass.toml").read_text() + f"\n[planning]\nmax_iterations = {most}\n")
        file.flush()
        return supple.load(file.name)


def seconds(task: supple.Task, gradient: bool = False) -> tuple[float, int]:
    """The time of one evaluation, and its iterations."""
    start = time.perf_counter()
    found = task.evaluate(gradient="total" if gradient else None, trajectories=False)
    return time.perf_counter() - start, found.tasks["press"].iterations


def measured(short: supple.Task, whole: supple.Task) -> tuple[float, float, float]:
    """Medians: time per iteration, of an evaluation, and of one with the total gradient, in s."""
    for task in (short, whole):
        seconds(task, gradient=True)
    per_iteration, evaluation, gradient = [], [], []
    for _ in range(ROUNDS):
        (few, first), (all_, last) = seconds(short), seconds(whole)
        per_iteration.append((all_ - few) / (last - first))
        evaluation.append(all_)
        gradient.append(seconds(whole, gradient=True)[0])
    return statistics.median(per_iteration), statistics.median(evaluation), statistics.median(gradient)


def main() -> None:
    """Prints a table."""
    kinds = {"built-in": [built_in(3), built_in(500)]}
    for backend in ("recorded", "jax"):
        kinds[backend] = [own_task(TwoMass(), backend, planning={"max_iterations": most}) for most in (3, 500)]
    rows = {name: measured(*tasks) for name, tasks in kinds.items()}
    print(
        f"{'two masses, 125 steps':24}{'us per iteration':>18}{'ms per evaluation':>19}{'with gradient':>15}{'ratio':>8}"
    )
    for name, (per_iteration, evaluation, gradient) in rows.items():
        ratio = per_iteration / rows["built-in"][0]
        print(f"{name:24}{1e6 * per_iteration:18.1f}{1e3 * evaluation:19.2f}{1e3 * gradient:15.2f}{ratio:8.2f}")


if __name__ == "__main__":
    main()
