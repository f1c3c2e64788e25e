"""Fourth-order central differences, in few calls for many points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .._records import Array

__all__ = ["ROUNDING", "along", "first", "relative_step", "second", "second_along"]

#: Relative rounding of a function's values.
ROUNDING = float(np.finfo(np.float64).eps)

#: Points of one call at most, so that memory stays small.
MOST_POINTS = 1 << 16

#: Multiples of the step, and weights over the step, of a first derivative.
FIRST = ((-2.0, 1.0 / 12.0), (-1.0, -8.0 / 12.0), (1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0))

#: Multiples of the step, and weights over its square, of a second derivative; that of the middle is -30/12.
SECOND = ((-2.0, -1.0 / 12.0), (-1.0, 16.0 / 12.0), (1.0, 16.0 / 12.0), (2.0, -1.0 / 12.0))
MIDDLE = -30.0 / 12.0

Function = Callable[[Array], Array]


def relative_step(order: int) -> float:
    """The step, relative to the length over which a function changes, that balances rounding and truncation errors of
    a derivative of this order: ``eps^(1 / (4 + order))``."""
    return float(ROUNDING ** (1.0 / (4 + order)))


def _evaluate(function: Function, points: Array, shifts: Array) -> Array:
    """The function at points (B, J) moved by shifts (S, J) or (S, B, J): (S, B, ...)."""
    if shifts.ndim == 2:
        shifts = shifts[:, None, :]
    count, size = len(shifts), len(points)
    if size == 0 or count == 0:
        return np.zeros((count, size, *function(points).shape[1:]))
    at_once = max(1, MOST_POINTS // size)
    parts = []
    for begin in range(0, count, at_once):
        moved = points[None] + shifts[begin : begin + at_once]
        values = function(np.ascontiguousarray(moved.reshape(-1, points.shape[1])))
        parts.append(values.reshape(len(moved), size, *values.shape[1:]))
    return np.concatenate(parts)


def first(function: Function, points: Array, steps: Array) -> Array:
    """First derivatives at points (B, J) with a step for each variable, (J,): (B, ..., J).

    ``function`` takes (B', J) and gives (B', ...).
    """
    variables = points.shape[1]
    shifts = np.concatenate([multiple * np.diag(steps) for multiple, _ in FIRST])
    values = _evaluate(function, points, shifts)
    values = values.reshape(len(FIRST), variables, *values.shape[1:])
    # Differences of pairs first: what is equal on both sides then cancels exactly.
    total = FIRST[3][1] * (values[3] - values[0]) + FIRST[2][1] * (values[2] - values[1])
    total = total / steps.reshape(-1, *[1] * (total.ndim - 1))
    return np.moveaxis(total, 0, -1)


def along(function: Function, points: Array, directions: Array, step: float) -> Array:
    """First derivatives along a direction of its own at each point, (B, J): (B, ...)."""
    values = _evaluate(function, points, np.stack([multiple * step * directions for multiple, _ in FIRST]))
    total: Array = (FIRST[3][1] * (values[3] - values[0]) + FIRST[2][1] * (values[2] - values[1])) / step
    return total


def second_along(function: Function, points: Array, directions: Array, step: float) -> Array:
    """Second derivatives along directions, (D, J) the same for all points or (D, B, J): (D, B, ...)."""
    middle = function(points)
    shifts = np.concatenate([multiple * step * directions for multiple, _ in SECOND])
    values = _evaluate(function, points, shifts)
    values = values.reshape(len(SECOND), len(directions), *values.shape[1:]) - middle
    total: Array = (SECOND[1][1] * (values[1] + values[2]) + SECOND[0][1] * (values[0] + values[3])) / step**2
    return total


def second(function: Function, points: Array, lengths: Array, step: float) -> Array:
    """All second derivatives at points (B, J): (B, ..., J, J), from those along axes and diagonals.

    Steps are ``step * lengths``, lengths (J,).
    """
    variables = points.shape[1]
    axes = np.diag(lengths)
    pairs = [(i, j) for i in range(variables) for j in range(i)]
    diagonals = [axes[i] + sign * axes[j] for i, j in pairs for sign in (1.0, -1.0)]
    directions = np.concatenate([axes, np.array(diagonals).reshape(-1, variables)])
    found = second_along(function, points, directions, step)
    result = np.zeros((variables, variables, *found.shape[1:]))
    for i in range(variables):
        result[i, i] = found[i] / lengths[i] ** 2
    for index, (i, j) in enumerate(pairs):
        both = found[variables + 2 * index] - found[variables + 2 * index + 1]
        result[i, j] = result[j, i] = both / (4.0 * lengths[i] * lengths[j])
    return np.moveaxis(result, (0, 1), (-2, -1))
