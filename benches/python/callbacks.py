"""How fast own models are, by where their derivatives come from, beside the built-in model of the same physics.

    python benches/python/callbacks.py            # from the root of the repository, the package installed

Prints, for the two masses of tasks/two_mass.toml: time of one call for a batch of 500 knots; calls, and time, for each
iteration of the planner; time of an evaluation with total gradients; and what is spent once, on translation or compilation.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import supple

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from own_functions import PRESS, TWO_MASS, Counting, backend_of, two_mass, with_backend

KNOTS = 500


def batch_functions() -> dict[str, Callable[..., Any]]:
    """The two masses in NumPy, for batches."""

    def positive(z: Any, smoothing: float) -> Any:
        return 0.5 * (np.sqrt(z * z + smoothing**2) + z)

    def step(x: Any, u: Any, p: Any) -> Any:
        x1, v1, x2, v2, wall = np.moveaxis(x, -1, 0)
        coupling, contact = p.k1 * (x1 - x2), p.k2 * positive(x2 - wall, 0.01)
        a1, a2 = (u[..., 0] - 60.0 * v1 - coupling) / 0.8, (coupling - 35.0 * v2 - contact) / 0.4
        return np.stack([x1 + 0.02 * v1, v1 + 0.02 * a1, x2 + 0.02 * v2, v2 + 0.02 * a2, wall], axis=-1)

    def observe(x: Any, p: Any) -> Any:
        return np.stack([x[..., 0], p.k1 * (x[..., 2] - x[..., 0])], axis=-1)

    def final_cost(x: Any, p: Any) -> Any:
        missing = 10.0 - positive(p.k2 * (x[..., 2] - x[..., 4]), 0.1)
        return 0.05 * missing**2 + 0.1 * (x[..., 1] ** 2 + x[..., 3] ** 2)

    def cost(x: Any, u: Any, p: Any) -> Any:
        return final_cost(x, p) + 1e-4 * u[..., 0] ** 2

    return {"step": step, "observe": observe, "cost": cost, "final_cost": final_cost}


def seconds(work: Callable[[], Any], repeats: int = 15) -> float:
    """Median time of some work that has been done once before, s."""
    work()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return median(times)


def batches(backend: Any) -> None:
    """Time of each call for a batch of knots."""
    random = np.random.default_rng(0)
    x, u = random.normal(scale=0.3, size=(KNOTS, 5)), random.normal(size=(KNOTS, 1))
    phi = np.array([500.0, 500.0, 1e-4, 5e-3])
    costates, adjoints = random.normal(size=(KNOTS, 5)), random.normal(size=(KNOTS, 5, 6))
    feedback = 0.01 * random.normal(size=(KNOTS, 1, 5))
    calls: dict[str, Callable[[], Any]] = {
        "roll_out": lambda: backend.roll_out(x[0], u, feedback, x, None, phi),
        "steps": lambda: backend.steps(x, u, phi),
        "dynamics_jacobians": lambda: backend.dynamics_jacobians(x, u, phi),
        "measurement_jacobians": lambda: backend.measurement_jacobians(x, phi),
        "stage_quadratics": lambda: backend.stage_quadratics(x, u, phi),
        "dynamics_curvature": lambda: backend.dynamics_curvature(x, u, costates, phi),
        "contract_dynamics": lambda: backend.contract_dynamics(x, u, adjoints, phi),
    }
    for name, call in calls.items():
        print(f"    {name:24s} {1e6 * seconds(call):9.0f} us for {KNOTS} knots")


def planning(name: str, task: supple.Task, built_in: float | None) -> float:
    """Times of evaluations; the time of an iteration, s."""
    begin = time.perf_counter()
    report = task.evaluate(gradient="total", trajectories=False).tasks["press"]
    once = time.perf_counter() - begin
    whole = seconds(lambda: task.evaluate(gradient="total", trajectories=False), 5)
    plain = seconds(lambda: task.evaluate(trajectories=False), 5)
    iteration = plain / report.iterations
    beside = "" if built_in is None else f", {iteration / built_in:.2f} times the built-in's"
    print(f"{name}: {report.iterations} iterations, {report.status}")
    print(f"    an iteration: {1e6 * iteration:.0f} us{beside}")
    print(f"    an evaluation with total gradients: {1e3 * whole:.1f} ms; the first one {once:.2f} s")
    return iteration


def main() -> None:
    """All of it."""
    built_in = planning("built in", supple.load(ROOT / "tasks" / "two_mass.toml"), None)
    for backend in ("recorded", "jax", "numpy"):
        begin = time.perf_counter()
        if backend == "numpy":
            task = supple.Model(**batch_functions(), backend="numpy", **TWO_MASS).task(**PRESS)
        else:
            task = two_mass(backend)
        made = time.perf_counter() - begin
        planning(backend, task, built_in)
        print(f"    made in {made:.2f} s")
        if backend == "recorded":
            continue
        counting = Counting(backend_of(task))
        report = with_backend(task, counting).evaluate(trajectories=False).tasks["press"]
        calls = Counter(name for name, _ in counting.calls)
        print(
            f"    calls: {sum(calls.values()) / report.iterations:.1f} for an iteration: {dict(calls.most_common(6))}"
        )
        batches(counting.backend)


if __name__ == "__main__":
    main()
