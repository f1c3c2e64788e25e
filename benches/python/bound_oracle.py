"""Makes ``crates/supple/tests/golden/bound.json``: the least directed information of small random horizons by cvxpy.

    python benches/python/bound_oracle.py crates/supple/tests/golden/bound.json

Needs cvxpy with Clarabel. Time-varying systems, unstable ones, and singular prices, process and initial covariances.
"""

from __future__ import annotations

import json
import sys

import cvxpy as cp
import numpy as np
from bound_programs import Array, Horizon, program


def covariance(draw: np.random.Generator, n: int, rank: int) -> Array:
    """A random covariance, (n, n)."""
    g = draw.normal(size=(n, rank))
    return np.asarray(g @ g.T)


def open_loop(h: Horizon) -> float:
    """The cost of no information."""
    p, cost = h.initial, 0.0
    for a, w, price in zip(h.dynamics, h.process, h.prices, strict=True):
        cost += float(np.trace(price @ p))
        p = a @ p @ a.T + w
    return cost


def example(seed: int) -> Horizon:
    """A random horizon; which of its matrices are singular depends on the seed."""
    draw = np.random.default_rng(seed)
    n, steps = int(draw.integers(1, 5)), int(draw.integers(1, 9))
    kind = seed % 4
    prices = np.array([covariance(draw, n, n if kind == 0 else max(1, n - 1)) for _ in range(steps)])
    if seed % 5 == 0 and steps > 1:
        prices[0] = 0.0
    process = np.array([covariance(draw, n, max(0, n - 1) if kind == 2 else n) for _ in range(steps)]) * 0.3
    if seed % 8 == 6:
        process[:] = 0.0
    initial = covariance(draw, n, max(1, n - 1) if kind == 3 else n)
    h = Horizon(draw.normal(size=(steps, n, n)) * 0.9 / np.sqrt(n) * 1.6, process, initial, prices, 0.0)
    h.budget = open_loop(h) * float(draw.choice([0.02, 0.1, 0.3, 0.7]))
    return h


def solve(h: Horizon) -> tuple[float, float] | None:
    """The minimum in nats and how accurate it is, relative to the larger of it and 1: the tightest that Clarabel reaches."""
    for tolerance, accuracy in ((1e-9, 1e-5), (1e-7, 1e-4)):
        problem, _ = program(h)
        try:
            problem.solve(
                solver=cp.CLARABEL, tol_gap_abs=tolerance, tol_gap_rel=tolerance, tol_feas=tolerance, max_iter=300
            )
        except cp.error.SolverError:
            continue
        if problem.status == "optimal":
            return float(problem.value), accuracy
    return None


def main() -> None:
    """Solves all of them and writes those that came out."""
    out = []
    for seed in range(64):
        h = example(seed)
        found = solve(h)
        print(seed, h.prices.shape, found, flush=True)
        if found is not None:
            fields = {k: getattr(h, k).tolist() for k in ("dynamics", "process", "initial", "prices")}
            out.append({"seed": seed, **fields, "budget": h.budget, "nats": found[0], "accuracy": found[1]})
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        json.dump(out, file)
        file.write("\n")


if __name__ == "__main__":
    main()
