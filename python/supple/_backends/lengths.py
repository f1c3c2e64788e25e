"""Lengths over which functions change, for the steps of finite differences; and what errors remain."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._records import Array
from . import stencils
from .differences import Differences
from .functions import Functions
from .stencils import relative_step

__all__ = ["differences_near", "relative_errors"]

#: Shorter lengths that are tried: 4^-k times how far a variable goes.
TRIED = 10

#: Points that lengths are chosen at: of the trajectory, and at random around it.
POINTS = 24


def differences_near(functions: Functions, given: Any, x: Array, u: Array, phi: Array, spans: Array) -> Differences:
    """A backend by finite differences, with steps that suit the functions along a trajectory.

    Each variable gets the length at which derivatives change least when it is divided by 4: rounding and truncation are
    alike there.

    Args:
        functions: What the user wrote.
        given: Derivatives that the user gives.
        x: States of a trajectory, (B, n); those that are not finite are left out.
        u: Controls, (B, m).
        phi: Parameters, (P,).
        spans: How far each parameter may go, (P,); negative where that is relative to its value.
    """
    z = np.concatenate([x, u], axis=1)
    z = z[np.isfinite(z).all(axis=1)]
    reach = np.abs(z).max(axis=0)
    reach = np.where(reach > 0.0, reach, 1.0)
    points = _around(z)
    n = functions.states
    names = list(functions.shapes)

    def values(z: Array, phi: Array) -> Array:
        found = [functions.batch(name, z[:, :n], z[:, n:], phi).reshape(len(z), -1) for name in names]
        return np.concatenate(found, axis=1)

    size = np.abs(values(points, phi)).max(axis=0)

    def by_variable(index: int, length: float) -> Array:
        steps = np.zeros(len(reach))
        steps[index] = relative_step(1) * length
        return stencils.along(lambda z: values(z, phi), points, np.broadcast_to(steps, points.shape), 1.0) / steps[index]

    def by_parameter(index: int, length: float) -> Array:
        backend = Differences(functions, None, reach, np.full(len(phi), length))
        only = phi[index : index + 1]

        def moved(one: Array) -> Array:
            all_ = phi.copy()
            all_[index] = one[0]
            return values(points, all_)

        backend.scales = np.array([length])
        return backend._by_parameters(moved, only)[..., 0]

    lengths = [_best(lambda length, i=i: by_variable(i, length), reach[i], size) for i in range(len(reach))]
    scales = []
    for index, span in enumerate(spans):
        largest = -span * abs(phi[index]) if span < 0.0 else span
        best = _best(lambda length, i=index: by_parameter(i, length), largest, size)
        scales.append(-best / abs(phi[index]) if span < 0.0 else best)
    return Differences(functions, given, np.array(lengths), np.array(scales))


def _around(z: Array) -> Array:
    """Points of a trajectory, and as many within the box around it, the same at every call."""
    few = z[np.linspace(0, len(z) - 1, min(POINTS, len(z))).astype(int)]
    lower, upper = z.min(axis=0), z.max(axis=0)
    random = np.random.default_rng(0).uniform(size=few.shape)
    around: Array = np.concatenate([few, lower + random * (upper - lower)])
    return around


def _best(derivative: Callable[[float], Array], largest: float, size: Array) -> float:
    """The length at which a derivative depends least on it."""
    tried = [largest * 0.25**k for k in range(TRIED)]
    found = [derivative(length) for length in tried]
    worst = []
    for wide, narrow in zip(found, found[1:]):
        scale = np.nanmax(np.abs(narrow), axis=0) + 1e-6 * size / largest
        error = np.abs(wide - narrow) / np.where(scale > 0.0, scale, 1.0)
        worst.append(float(error.max()) if np.isfinite(error).all() else np.inf)
    best = int(np.argmin(worst))
    # Between the two that agree best.
    return 0.5 * tried[best]


def relative_errors(backend: Any, x: Array, u: Array, phi: Array) -> tuple[float, float, float]:
    """Relative errors of first, second and third derivatives at points x (B, n), u (B, m): how far they change where all
    steps are halved, relative to the largest entry over the points."""
    half = backend.scaled(0.5)
    random = np.random.default_rng(0)
    n, z = x.shape[1], x.shape[1] + u.shape[1]
    costates = random.normal(size=x.shape)
    jacobian = random.normal(size=(len(x), n, z))
    square = random.normal(size=(len(x), z, z))
    square = square + np.swapaxes(square, 1, 2)

    def both(call: Callable[[Any], Any]) -> float:
        worst = 0.0
        for one, other in zip(_parts(call(backend)), _parts(call(half))):
            scale = float(np.abs(one).max(initial=0.0))
            if scale > 0.0:
                worst = max(worst, float(np.abs(one - other).max()) / scale)
        return worst

    first = [
        both(lambda of: of.dynamics_jacobians(x, u, phi)),
        both(lambda of: of.measurement_jacobians(x, phi)),
        both(lambda of: of.stage_quadratics(x, u, phi)[1]),
        both(lambda of: of.final_quadratics(x, phi)[1]),
        both(lambda of: of.stage_parameters(x, u, costates, phi)),
    ]
    second = [
        both(lambda of: of.stage_quadratics(x, u, phi)[0]),
        both(lambda of: of.final_quadratics(x, phi)[0]),
        both(lambda of: of.dynamics_curvature(x, u, costates, phi)),
        both(lambda of: of.contract_dynamics(x, u, jacobian, phi)),
    ]
    third = [
        both(lambda of: of.contract_stage_costs(x, u, square, phi)),
        both(lambda of: of.contract_final_costs(x, square[:, :n, :n], phi)),
    ]
    return max(first), max(second), max(third)


def _parts(found: Any) -> tuple[Array, ...]:
    return found if isinstance(found, tuple) else (found,)
