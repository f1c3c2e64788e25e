"""The least directed information: the library against cvxpy with Clarabel and SCS, in one run.

    python benches/python/bound_peers.py [--rounds 5] [--door] [--limit 600] [--memory 8]

Twenty steps and four states (Tanaka's plant, 40 per step): seconds of the library by ``cargo bench`` on one core, and of
cvxpy by what a user waits for (the problem built, compiled and solved), by a second solve of a problem already compiled,
and by what the solver itself says. With ``--door`` both programs get a random horizon of the door's size too, 500 steps
and 16 states: the general solvers in a process of their own, with a limit of seconds and of GB.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import statistics
import subprocess
import time
from pathlib import Path
from typing import Any

import cvxpy as cp
import numpy as np
from bound_programs import Array, Horizon, program

ROOT = Path(__file__).resolve().parents[2]
A = np.array(
    [[0.12, 0.63, -0.52, 0.33], [0.26, -1.28, 1.57, 1.13], [-1.77, -0.30, 0.77, 0.25], [-0.16, 0.20, -0.58, 0.56]]
)
B = np.array(
    [[0.66, -0.58, 0.03, -0.20], [2.61, -0.91, 0.87, -0.07], [-0.64, -1.12, -0.19, 0.61], [0.93, 0.58, -1.18, -1.21]]
)
W = np.array([[4.94, -0.10, 1.29, 0.35], [-0.10, 5.55, 2.07, 0.31], [1.29, 2.07, 2.02, 1.43], [0.35, 0.31, 1.43, 3.10]])


def tanaka(steps: int, cost: float) -> Horizon:
    """Tanaka's plant from a unit covariance with the cost ``x+'x+ + u'u`` per step."""
    s, known, prices = np.zeros((4, 4)), 0.0, []
    for _ in range(steps):
        following = np.eye(4) + s
        known += float(np.trace(following @ W))
        half = B.T @ following @ A
        price = half.T @ np.linalg.solve(np.eye(4) + B.T @ following @ B, half)
        s = A.T @ following @ A - price
        prices.append((price + price.T) / 2)
    known += float(np.trace(s))
    repeat = np.repeat([A], steps, axis=0), np.repeat([W], steps, axis=0)
    return Horizon(*repeat, np.eye(4), np.array(prices[::-1]), cost * steps - known)


def large(steps: int, n: int) -> Horizon:
    """A random horizon of the door's size."""
    draw = np.random.default_rng(1)

    def covariances(rank: int) -> Array:
        g = draw.normal(size=(steps, n, rank))
        return np.asarray(g @ np.swapaxes(g, 1, 2))

    dynamics = 0.2 * draw.normal(size=(steps, n, n)) + 0.3 * np.eye(n)
    return Horizon(dynamics, 0.1 * covariances(n), np.eye(n), covariances(n // 2), 5.0 * steps)


def of_cvxpy(h: Horizon, rounds: int) -> dict[str, float]:
    """Seconds of cvxpy with Clarabel, medians: all a user waits for, a second solve, and the solver alone; and nats."""
    whole, again, solver = [], [], []
    value = 0.0
    for _ in range(rounds):
        started = time.perf_counter()
        problem, _ = program(h)
        problem.solve(solver=cp.CLARABEL)
        whole.append(time.perf_counter() - started)
        started = time.perf_counter()
        problem.solve(solver=cp.CLARABEL)
        again.append(time.perf_counter() - started)
        solver.append(float(problem.solver_stats.solve_time))
        value = float(problem.value)
    median = statistics.median
    return {"user": median(whole), "again": median(again), "solver": median(solver), "nats": value}


def of_library(name: str) -> float:
    """Seconds of a case of ``cargo bench``, the median of its samples."""
    command = ["cargo", "bench", "-q", "-p", "supple", "--bench", "bound", "--", f"bound/{name}$"]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    target = json.loads(
        subprocess.run(
            ["cargo", "metadata", "--format-version", "1", "--no-deps"], cwd=ROOT, check=True, capture_output=True
        ).stdout
    )["target_directory"]
    estimates = json.loads((Path(target) / "criterion" / "bound" / name / "new" / "estimates.json").read_text())
    return float(estimates["median"]["point_estimate"]) * 1e-9


def attempt(solver: str, memory: float, out: Any) -> None:
    """A general solver on a horizon of the door's size, in this process, within ``memory`` GB."""
    resource.setrlimit(resource.RLIMIT_AS, (int(memory * 2**30), int(memory * 2**30)))
    started = time.perf_counter()
    try:
        problem, _ = program(large(500, 16))
        data, _, _ = problem.get_problem_data(getattr(cp, solver))
        compiled = time.perf_counter() - started
        out.put(f"compiled in {compiled:.0f} s to {data['A'].shape[0]} rows and {data['A'].shape[1]} variables")
        problem.solve(solver=getattr(cp, solver))
        out.put(f"{problem.status} at {problem.value} nats after {time.perf_counter() - started:.0f} s")
    except MemoryError:
        out.put(f"out of memory after {time.perf_counter() - started:.0f} s")
    except Exception as error:  # whatever a solver says is what is reported
        out.put(f"{type(error).__name__} after {time.perf_counter() - started:.0f} s: {str(error)[:100]}")


def door(limit: float, memory: float) -> None:
    """What general solvers do at the door's size."""
    context = multiprocessing.get_context("spawn")
    for solver in ("CLARABEL", "SCS"):
        out = context.Queue()
        process = context.Process(target=attempt, args=(solver, memory, out))
        process.start()
        process.join(limit)
        while not out.empty():
            print(f"{solver}: {out.get()}", flush=True)
        if process.is_alive():
            print(f"{solver}: not done after {limit:.0f} s", flush=True)
            process.kill()
        elif process.exitcode:
            print(f"{solver}: ended with code {process.exitcode}: out of its {memory:.0f} GB", flush=True)
        process.join()


def main() -> None:
    """Prints all times."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--door", action="store_true")
    parser.add_argument("--limit", type=float, default=600.0)
    parser.add_argument("--memory", type=float, default=8.0)
    given = parser.parse_args()
    theirs = of_cvxpy(tanaka(20, 40.0), given.rounds)
    print(f"cvxpy and Clarabel, 20 steps x 4 states: {theirs}", flush=True)
    ours = of_library("tanaka_20x4")
    print(f"the library: {ours * 1e3:.2f} ms")
    for what in ("user", "again", "solver"):
        print(f"  {theirs[what] / ours:.0f} times as fast as cvxpy with Clarabel ({what}: {theirs[what] * 1e3:.0f} ms)")
    if given.door:
        for name in ("random_500x16", "door_500x16"):
            print(f"the library, {name}: {of_library(name):.1f} s", flush=True)
        print(f"peak memory of these: {resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20:.2f} GB")
        door(given.limit, given.memory)


if __name__ == "__main__":
    main()
