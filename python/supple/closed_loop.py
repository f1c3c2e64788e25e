"""The controller of a plan on a user-supplied plant: roll-outs as arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._arrays import check_unmasked
from ._records import Array, Record
from ._supple import times
from .checks import Linearisation
from .errors import ComputeError, UsageError

__all__ = ["Plant", "Rollouts", "roll_out"]

#: A function from a state (n,), controls (m,) and the step number to the next state, (n,).
Plant = Callable[[Array, Array, int], Any]


@dataclass(frozen=True, eq=False, repr=False)
class Rollouts(Record):
    """Closed-loop roll-outs; ``R`` roll-outs, ``N`` steps, ``n`` states, ``m`` controls.

    Attributes:
        time: Time of each state, s, (N+1,).
        states: States of the plant, (R, N+1, n).
        estimates: Estimates of the filter after each measurement, (R, N+1, n).
        controls: Controls, (R, N, m).
        seed: Seed of the noise.
    """

    time: Array
    states: Array
    estimates: Array
    controls: Array
    seed: int


def roll_out(plan: Linearisation, plant: Plant, runs: int, seed: int, start: Array | None, noise: bool) -> Rollouts:
    """Runs the linear controller and Kalman filter of a plan on a plant.

    The controller uses only the plan: it measures ``C dx + v`` of the plant's state, and predicts with the plan's ``A`` and
    ``B``, regardless of the plant.
    """
    if plan.status != "converged":
        raise ComputeError(f"the plan ended as {plan.status}: it has no controller that could be rolled out")
    steps, n, m = len(plan.controls), plan.states.shape[1], plan.controls.shape[1]
    if start is not None and start.shape != (n,):
        raise UsageError(f"initial_state has {start.size} numbers: it must have {n}")
    gains = _filter_gains(plan)
    random = np.random.default_rng(seed)
    states, estimates = np.full((runs, steps + 1, n), np.nan), np.full((runs, steps + 1, n), np.nan)
    controls = np.full((runs, steps, m), np.nan)
    for run in range(runs):
        x = plan.states[0] if start is None else start
        x = x + noise * _drawn(random, plan.initial_covariance)
        predicted = np.zeros(n)
        for t in range(steps + 1):
            sensed = plan.C[t] @ (x - plan.states[t]) + noise * _drawn(random, plan.measurement_covariance[t])
            estimate = predicted + gains[t] @ (sensed - plan.C[t] @ predicted)
            states[run, t], estimates[run, t] = x, plan.states[t] + estimate
            if t == steps:
                break
            change = plan.feedback[t] @ estimate
            u = plan.controls[t] + change
            controls[run, t] = u
            x = _next(plant, x, u, t) + noise * _drawn(random, plan.process_covariance[t])
            predicted = plan.A[t] @ estimate + plan.B[t] @ change
    time = np.asarray(times(steps, plan.time_step), dtype=np.float64)
    return Rollouts(time=time, states=states, estimates=estimates, controls=controls, seed=seed)


def _filter_gains(plan: Linearisation) -> list[Array]:
    """``P C' (C P C' + V)^-1`` at each step, ``P`` before the measurement."""
    gains = []
    before = plan.initial_covariance
    for t, (C, V) in enumerate(zip(plan.C, plan.measurement_covariance)):
        gains.append(np.linalg.solve(C @ before @ C.T + V, C @ before).T)
        if t < len(plan.A):
            before = plan.A[t] @ plan.belief_covariance[t] @ plan.A[t].T + plan.process_covariance[t]
    return gains


def _drawn(random: np.random.Generator, covariance: Array) -> Array:
    """A sample of a covariance, which may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors @ (np.sqrt(np.maximum(values, 0.0)) * random.standard_normal(len(values))))


def _next(plant: Plant, x: Array, u: Array, t: int) -> Array:
    found = plant(x.copy(), u.copy(), t)
    check_unmasked("what plant returned", found)
    try:
        moved = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise UsageError(
            f"plant returned {found!r} at step {t}: it must return the next state, {len(x)} numbers"
        ) from error
    if moved.shape != x.shape:
        raise UsageError(
            f"plant returned the shape {moved.shape} at step {t}: it must return the next state, {x.shape}"
        )
    if not np.isfinite(moved).all():
        raise ComputeError(f"the plant's state is not finite at step {t + 1}: the controller does not stabilise it")
    return moved
