"""Own models in JAX beside the built-in one: time per iteration of iLQG, and of a whole evaluation.

python benches/python/own_models.py
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import supple

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from jax_models import TwoMass, own_task

#: How often everything is measured: the least time counts, which other work on the machine disturbs least.
ROUNDS = {"built-in": 300, "recorded": 300, "jax": 15}


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


def measured(short: supple.Task, whole: supple.Task, rounds: int) -> tuple[float, float, float]:
    """The least times per iteration, of an evaluation, and of one with the total gradient, in s."""
    few, all_ = seconds(short)[1], seconds(whole)[1]
    times = [(seconds(short)[0], seconds(whole)[0], seconds(whole, gradient=True)[0]) for _ in range(rounds)]
    least = [min(column) for column in zip(*times, strict=True)]
    return (least[1] - least[0]) / (all_ - few), least[1], least[2]


def main() -> None:
    """Prints a table."""
    kinds = {"built-in": [built_in(3), built_in(500)]}
    for backend in ("recorded", "jax"):
        kinds[backend] = [own_task(TwoMass(), backend, planning={"max_iterations": most}) for most in (3, 500)]
    rows = {name: measured(*tasks, ROUNDS[name]) for name, tasks in kinds.items()}
    print(
        f"{'two masses, 125 steps':24}{'us per iteration':>18}{'ms per evaluation':>19}{'with gradient':>15}{'ratio':>8}"
    )
    for name, (per_iteration, evaluation, gradient) in rows.items():
        ratio = per_iteration / rows["built-in"][0]
        print(f"{name:24}{1e6 * per_iteration:18.1f}{1e3 * evaluation:19.2f}{1e3 * gradient:15.2f}{ratio:8.2f}")


if __name__ == "__main__":
    main()
