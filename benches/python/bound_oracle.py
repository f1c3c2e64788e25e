"""Makes ``crates/supple/tests/golden/bound.json``: the least directed information of small random horizons by cvxpy.

    python benches/python/bound_oracle.py crates/supple/tests/golden/bound.json

Needs cvxpy with Clarabel. Time-varying systems, unstable ones, and singular prices, process and initial covariances.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import cvxpy as cp
import numpy as np
from bound_programs import Array, Horizon, program, root


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


def needed(h: Horizon, variables: list[Any]) -> float | None:
    """What the covariances found need, in nats, from determinants: Clarabel's own value is less accurate than they are.

    None where they are not feasible.
    """
    first = root(h.initial)
    predicted, nats, cost = np.eye(first.shape[1]), 0.0, 0.0
    for t, variable in enumerate(variables):
        p = variable.value
        if np.linalg.eigvalsh(predicted - p).min() < -1e-7 * np.trace(predicted):
            return None
        nats += 0.5 * (np.linalg.slogdet(predicted)[1] - np.linalg.slogdet(p)[1])
        whole = first @ p @ first.T if t == 0 else p
        cost += float(np.trace(h.prices[t] @ whole))
        predicted = h.dynamics[t] @ whole @ h.dynamics[t].T + h.process[t]
    return nats if abs(cost / h.budget - 1) < 1e-6 else None


def solve(h: Horizon) -> float | None:
    """The minimum in nats; None where Clarabel finds no covariances that are feasible."""
    for tolerance in (1e-9, 1e-7):
        problem, variables = program(h)
        limits = {f"tol_{k}": tolerance for k in ("gap_abs", "gap_rel", "feas")}
        try:
            problem.solve(solver=cp.CLARABEL, max_iter=300, **limits)
        except cp.error.SolverError:
            continue
        found = needed(h, variables)
        if found is not None:
            return found
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
            out.append({"seed": seed, **fields, "budget": h.budget, "nats": found})
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        json.dump(out, file)
        file.write("\n")


if __name__ == "__main__":
    main()
