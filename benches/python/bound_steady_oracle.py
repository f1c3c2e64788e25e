"""Makes ``crates/supple/tests/golden/bound_steady.json``: least information per step of random systems, by cvxpy.

    python benches/python/bound_steady_oracle.py crates/supple/tests/golden/bound_steady.json 560

Needs cvxpy with Clarabel. Modes on, inside and outside of the unit circle; singular prices of states and of controls. The
regulator is by steps of the Riccati equation from 0, and the rest is the program of T. Tanaka, P. Esfahani and S. Mitter,
"LQG control with minimum directed information: semidefinite programming approach", IEEE TAC 2018. What the covariances need
is computed from their determinants, which are more accurate than the solver's own value.
"""

from __future__ import annotations

import json
import sys

import cvxpy as cp
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Steps of the Riccati equation at most.
STEPS = 20_000


def system(seed: int) -> tuple[Array, Array, Array, Array, Array]:
    """``A``, ``B``, ``W``, ``Q``, ``R``: at least one mode on the unit circle, and every state driven."""
    draw = np.random.default_rng(seed)
    n, m = int(draw.integers(2, 5)), int(draw.integers(1, 3))
    blocks = np.zeros((n, n))
    angle = draw.uniform(0.2, 2.9)
    i = 0
    if seed % 3 == 0:
        blocks[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        i = 2
    elif seed % 3 == 1:
        blocks[:2, :2] = [[1.0, 1.0], [0.0, 1.0]]
        i = 2
    else:
        blocks[0, 0] = draw.choice([-1.0, 1.0])
        i = 1
    for k in range(i, n):
        blocks[k, k] = draw.choice([draw.uniform(-0.9, 0.9), draw.uniform(1.05, 1.5), 1.0])
    turn = np.linalg.qr(draw.normal(size=(n, n)))[0]
    a = turn @ blocks @ turn.T
    b = draw.normal(size=(n, m))
    g = draw.normal(size=(n, n))
    q = draw.normal(size=(int(draw.integers(1, n + 1)), n))
    r = np.eye(m) * (0.0 if seed % 4 == 3 else 0.5)
    return a, b, 0.2 * g @ g.T + 0.05 * np.eye(n), q.T @ q, r


def regulator(a: Array, b: Array, q: Array, r: Array) -> tuple[Array, Array] | None:
    """``S`` and ``Theta`` of the least-cost regulator; none where steps from 0 do not settle."""
    s = np.zeros_like(a)
    for _ in range(STEPS):
        gain = np.linalg.pinv(r + b.T @ s @ b, rcond=1e-12, hermitian=True) @ (b.T @ s @ a)
        price = (b.T @ s @ a).T @ gain
        after = q + a.T @ s @ a - price
        after = (after + after.T) / 2
        if np.abs(after - s).max() <= 1e-13 * np.abs(after).max():
            gain = np.linalg.pinv(r + b.T @ after @ b, rcond=1e-12, hermitian=True) @ (b.T @ after @ a)
            price = (b.T @ after @ a).T @ gain
            return after, (price + price.T) / 2
        s = after
    return None


def minimum(a: Array, w: Array, theta: Array, budget: float) -> float | None:
    """Bits per step; none where Clarabel ends without covariances that are feasible to 1e-7."""
    n = len(a)
    p, rest = cp.Variable((n, n), PSD=True), cp.Variable((n, n), PSD=True)
    predicted = a @ p @ a.T + w
    corner = cp.bmat([[p - rest, p @ a.T], [a @ p, predicted]])
    problem = cp.Problem(
        cp.Minimize(-cp.log_det(rest)),
        [predicted - p >> 0, 0.5 * (corner + corner.T) >> 0, cp.trace(theta @ p) <= budget],
    )
    try:
        problem.solve(solver=cp.CLARABEL, max_iter=300, tol_gap_abs=1e-9, tol_gap_rel=1e-9, tol_feas=1e-9)
    except cp.error.SolverError:
        return None
    if p.value is None:
        return None
    found = (p.value + p.value.T) / 2
    after = a @ found @ a.T + w
    if np.linalg.eigvalsh(after - found).min() < -1e-7 * np.trace(after):
        return None
    if abs(np.trace(theta @ found) / budget - 1) > 1e-6:
        return None
    return float(0.5 * (np.linalg.slogdet(after)[1] - np.linalg.slogdet(found)[1]) / np.log(2))


def main() -> None:
    """Solves all of them and writes those that came out."""
    out = []
    for seed in range(int(sys.argv[2])):
        a, b, w, q, r = system(seed)
        law = regulator(a, b, q, r)
        if law is None:
            continue
        s, theta = law
        # The budget of a filter that measures every state.
        p = np.eye(len(a))
        for _ in range(2000):
            posterior = np.linalg.inv(np.linalg.inv(p) + np.eye(len(a)) * [0.1, 1.0, 10.0][seed % 3])
            p = a @ posterior @ a.T + w
        budget = float(np.trace(theta @ posterior))
        bits = minimum(a, w, theta, budget)
        print(seed, len(a), bits, flush=True)
        if bits is not None:
            fields = {"A": a, "B": b, "W": w, "Q": q, "R": r}
            cost = {"least": float(np.trace(w @ s)), "budget": budget, "bits": bits}
            out.append({"seed": seed, **{key: value.tolist() for key, value in fields.items()}, **cost})
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        json.dump(out, file)
        file.write("\n")


if __name__ == "__main__":
    main()
