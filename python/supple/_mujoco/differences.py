"""Derivatives by central differences over whole batches of points.

``B`` points ``z`` of ``k`` numbers. All formulas are of fourth order in the step ``h``: second order at ``h`` and ``2 h``,
extrapolated. Errors by rounding grow as ``1/h`` for first and ``1/h^2`` for second derivatives.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .._records import Array

__all__ = ["CHUNK", "contract_hessian", "hessian", "in_chunks", "jacobian", "weighted_jacobian"]

#: Points to evaluate at once, at most: what bounds the memory.
CHUNK = 16384

Batched = Callable[[Array], Array]

#: Shifts in steps, and their weights in a first derivative.
FIRST = ((-2.0, 1.0 / 12.0), (-1.0, -2.0 / 3.0), (1.0, 2.0 / 3.0), (2.0, -1.0 / 12.0))


def in_chunks(function: Batched, z: Array) -> Array:
    """``function`` (B, k) -> (B, ...) at many points, some at a time."""
    if len(z) <= CHUNK:
        return function(z)
    return np.concatenate([function(z[i : i + CHUNK]) for i in range(0, len(z), CHUNK)])


def _at(function: Batched, points: Array) -> Array:
    """``function`` at (B, S, k): (B, S, ...)."""
    batch, shifts, k = points.shape
    values = in_chunks(function, points.reshape(batch * shifts, k))
    return values.reshape(batch, shifts, *values.shape[1:])


def jacobian(function: Batched, z: Array, h: float) -> Array:
    """The derivative of ``function`` (B, k) -> (B, ...) by ``z``: (B, ..., k)."""
    k = z.shape[1]
    shifts = np.concatenate([shift * h * np.eye(k) for shift, _ in FIRST])
    values = _at(function, z[:, None, :] + shifts)
    values = values.reshape(len(z), len(FIRST), k, *values.shape[2:])
    weights = np.array([weight for _, weight in FIRST]) / h
    return np.ascontiguousarray(np.moveaxis(np.tensordot(weights, values, axes=(0, 1)), 1, -1))


def weighted_jacobian(function: Batched, z: Array, weights: Array, h: float) -> Array:
    """The gradient of ``<weights, function(z)>``, weights (B, ...): (B, k)."""
    k = z.shape[1]
    gradient = np.zeros((len(z), k))
    flat = weights.reshape(len(z), 1, -1)
    for shift, weight in FIRST:
        values = _at(function, z[:, None, :] + shift * h * np.eye(k))
        gradient += weight / h * np.sum(values.reshape(len(z), k, -1) * flat, axis=2)
    return gradient


def hessian(function: Batched, z: Array, h: float) -> Array:
    """The second derivative of ``function`` (B, k) -> (B, r) by ``z``: (B, r, k, k)."""
    k = z.shape[1]
    rows, columns = np.triu_indices(k, 1)
    unit = np.eye(k)
    pairs = unit[rows] + unit[columns]
    shifts = np.concatenate([np.zeros((1, k)), unit, -unit, pairs, -pairs])
    points = max(1, CHUNK // len(shifts))
    parts = []
    for first in range(0, len(z), points):
        some = z[first : first + points, None, :]
        coarse, fine = (_second(_at(function, some + size * shifts), size, rows, columns, k) for size in (2.0 * h, h))
        parts.append((4.0 * fine - coarse) / 3.0)
    return np.concatenate(parts)


def _second(values: Array, h: float, rows: Array, columns: Array, k: int) -> Array:
    """Second differences of second order from the values (B, S, r) at a point and around it: (B, r, k, k)."""
    pairs = len(rows)
    centre = values[:, 0]
    single = values[:, 1 : 1 + k] + values[:, 1 + k : 1 + 2 * k] - 2.0 * centre[:, None]
    double = values[:, 1 + 2 * k : 1 + 2 * k + pairs] + values[:, 1 + 2 * k + pairs :] - 2.0 * centre[:, None]
    out = np.empty((len(values), values.shape[2], k, k))
    diagonal = np.arange(k)
    out[:, :, diagonal, diagonal] = np.moveaxis(single, 1, 2) / h**2
    mixed = np.moveaxis(double - single[:, rows] - single[:, columns], 1, 2) / (2.0 * h**2)
    out[:, :, rows, columns] = mixed
    out[:, :, columns, rows] = mixed
    return out


def contract_hessian(gradient: Batched, z: Array, weights: Array, h: float) -> Array:
    """The gradient of ``<weights, H(z)>``, ``H`` the derivative of ``gradient`` (B, k) -> (B, k), weights (B, k, k): (B, k).

    With the symmetric part of the weights ``sum mu v v'`` it is ``sum mu`` times the second derivative of ``gradient``
    along ``v``.
    """
    values, vectors = np.linalg.eigh(0.5 * (weights + np.swapaxes(weights, 1, 2)))
    along = np.swapaxes(vectors, 1, 2)  # (B, k, k): one direction per row
    centre = gradient(z)[:, None, :]

    def second(size: float) -> Array:
        ahead = _at(gradient, z[:, None, :] + size * along)
        return (ahead + _at(gradient, z[:, None, :] - size * along) - 2.0 * centre) / size**2

    curvature = (4.0 * second(h) - second(2.0 * h)) / 3.0
    return np.asarray(np.einsum("bd,bdk->bk", values, curvature))
