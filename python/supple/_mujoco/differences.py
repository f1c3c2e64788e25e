"""Second derivatives by central differences over whole batches of points.

``B`` points ``z`` of ``k`` numbers. Formulas are of fourth order in the step ``h``: second order at ``h`` and ``2 h``,
extrapolated. The error by rounding is about that of the function over ``h^2``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._records import Array

__all__ = ["contract_hessian", "hessian"]

#: Points to evaluate at once, at most: what bounds the memory.
CHUNK = 16384

Batched = Callable[[Array], Array]


def _at(function: Batched, points: Array) -> Array:
    """``function`` (B, k) -> (B, ...) at (B, S, k): (B, S, ...)."""
    batch, shifts, k = points.shape
    flat = points.reshape(batch * shifts, k)
    parts = [function(flat[first : first + CHUNK]) for first in range(0, len(flat), CHUNK)]
    values = np.concatenate(parts)
    return values.reshape(batch, shifts, *values.shape[1:])


def hessian(function: Batched, z: Array, h: float) -> Array:
    """The second derivative of ``function`` (B, k) -> (B, r) by ``z``: (B, r, k, k), from ``2 (k^2 + k) + 2`` evaluations."""
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


def _second(values: Array, h: float, rows: Any, columns: Any, k: int) -> Array:
    """Second differences of second order from the values (B, S, r) at a point and around it: (B, r, k, k)."""
    pairs = len(rows)
    centre = values[:, :1]
    single = (values[:, 1 : 1 + k] - centre) + (values[:, 1 + k : 1 + 2 * k] - centre)
    double = (values[:, 1 + 2 * k : 1 + 2 * k + pairs] - centre) + (values[:, 1 + 2 * k + pairs :] - centre)
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
        ahead = _at(gradient, z[:, None, :] + size * along) - centre
        return (ahead + (_at(gradient, z[:, None, :] - size * along) - centre)) / size**2

    curvature = (4.0 * second(h) - second(2.0 * h)) / 3.0
    return np.asarray(np.einsum("bd,bdk->bk", values, curvature))
