"""The least directed information as programs for cvxpy: independent of the library, to compare with.

Their form is that of T. Tanaka, P. Esfahani and S. Mitter, "LQG control with minimum directed information: semidefinite
programming approach", IEEE TAC 2018, and, where the process noise is singular, one by the noise itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass
class Horizon:
    """``x+ = A_t x + w``: ``dynamics`` and ``process`` (T, n, n), ``initial`` (n, n), ``prices`` (T, n, n), a budget."""

    dynamics: Array
    process: Array
    initial: Array
    prices: Array
    budget: float


def root(a: Array) -> Array:
    """``G`` of full column rank with ``G G' = a``, (n, rank)."""
    values, vectors = np.linalg.eigh(a)
    kept = values > 1e-12 * max(values.max(), 1e-300)
    return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))


def schur(corner: Any, across: Any, other: Any) -> Any:
    """``[[corner, across'], [across, other]]`` as a positive semidefinite constraint."""
    block = cp.bmat([[corner, across.T], [across, other]])
    return 0.5 * (block + block.T) >> 0


def program(h: Horizon) -> tuple[cp.Problem, list[Any]]:
    """The convex program, in nats, and its variables ``p_t``, ``P_t = E p_t E'``; ``E`` is not the identity at t = 0 only.

    Needs an initial covariance of full rank or a process covariance that is; dynamics that are singular need the latter.
    """
    steps, n = h.prices.shape[:2]
    first = root(h.initial)
    constraints, cost = [], 0.0
    information: Any = np.linalg.slogdet(first.T @ first)[1] / 2
    variables: list[Any] = []
    predicted: Any = np.eye(first.shape[1])
    for t in range(steps):
        basis = first if t == 0 else np.eye(n)
        p = cp.Variable((basis.shape[1], basis.shape[1]), PSD=True)
        variables.append(p)
        constraints.append(predicted - p >> 0)
        whole = basis @ p @ basis.T
        cost = cost + cp.trace(h.prices[t] @ whole)
        if t == 0:
            # Coordinates of the first covariance: |E p E'| is |p| |E'E|, which the last line takes back.
            information = 0.0
        if t + 1 == steps:
            information = information - cp.log_det(p) / 2
            break
        a, w = h.dynamics[t] @ basis, h.process[t]
        carried = a @ p @ a.T
        predicted = carried + w
        g = root(w)
        if g.shape[1] == n:
            rest = cp.Variable(p.shape, PSD=True)
            constraints.append(schur(p - rest, a @ p, predicted))
            information = information + np.linalg.slogdet(w)[1] / 2 - cp.log_det(rest) / 2
        else:
            # 1/2 log |A P A' + G G'| - 1/2 log |P| = log |det A| - 1/2 log |I - H'(P + H H')^-1 H|, H = A^-1 G.
            information = information + np.linalg.slogdet(a)[1]
            if g.shape[1]:
                by = np.linalg.solve(a, g)
                rest = cp.Variable((g.shape[1], g.shape[1]), PSD=True)
                constraints.append(schur(np.eye(g.shape[1]) - rest, by, p + by @ by.T))
                information = information - cp.log_det(rest) / 2
    constraints.append(cost <= h.budget)
    return cp.Problem(cp.Minimize(information), constraints), variables
