"""Lengths over which functions change, which set the steps of finite differences; and the remaining errors."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from .._records import Array
from . import stencils
from .differences import Differences
from .functions import Functions
from .stencils import ROUNDING, relative_step

__all__ = ["differences_near", "relative_errors"]

#: Shorter lengths that are tried: 4^-k times how far a variable goes.
TRIED = 10

#: Points that lengths are chosen at: of the trajectory, and at random around it.
POINTS = 256

#: Errors are measured at one of so many of these points.
MEASURED = 4


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
    reach = _size(z)
    points = _around(z)
    n = functions.states
    names = list(functions.shapes)

    def values(z: Array, phi: Array) -> Array:
        found = [functions.batch(name, z[:, :n], z[:, n:], phi).reshape(len(z), -1) for name in names]
        return np.concatenate(found, axis=1)

    lengths = {}
    for name in names:
        for order in (1, 2, 3):
            size = np.abs(functions.batch(name, points[:, :n], points[:, n:], phi).reshape(len(points), -1)).max(axis=0)
            best = []
            for index, largest in enumerate(reach):
                floor = size / largest**order
                best.append(_best(_derivative(functions, name, order, (points, phi), index), order, largest, floor))
            lengths[name, order] = np.array(best)
    size = np.abs(values(points, phi)).max(axis=0)
    scales = []
    for index, span in enumerate(spans):
        largest = -span * abs(phi[index]) if span < 0.0 else span

        def derivative(length: float, index: int = index) -> Array:
            def moved(shift: Array) -> Array:
                return np.stack([values(points, phi + step * np.eye(len(phi))[index]) for step in shift[:, 0]])

            return stencils.first(moved, np.zeros((1, 1)), np.array([relative_step(1) * length]))[0, ..., 0]

        best_scale = _best(derivative, 1, largest, size / largest)
        scales.append(-best_scale / abs(phi[index]) if span < 0.0 else best_scale)
    return Differences(functions, given, lengths, np.array(scales))


def _derivative(
    functions: Functions, name: str, order: int, at: tuple[Array, Array], index: int
) -> Callable[[float], Array]:
    """A function's derivative of an order along one variable at ``(z, phi)``, of the length for its steps."""
    (z, phi), n = at, functions.states

    def value(z: Array) -> Array:
        return functions.batch(name, z[:, :n], z[:, n:], phi).reshape(len(z), -1)

    def derivative(length: float) -> Array:
        step = relative_step(order)
        along = np.zeros(z.shape[1])
        along[index] = length
        if order == 1:
            return stencils.along(value, z, np.broadcast_to(along, z.shape), step) / length

        def second(z: Array) -> Array:
            found: Array = stencils.second_along(value, z, along[None], step)[0] / length**2
            return found

        if order == 2:
            return second(z)
        return stencils.along(second, z, np.broadcast_to(along, z.shape), step) / length

    return derivative


def _around(z: Array) -> Array:
    """Points of a trajectory, and others within the box around it, the same at every call."""
    few = z[np.linspace(0, len(z) - 1, min(POINTS, len(z))).astype(int)]
    lower, upper = z.min(axis=0), z.max(axis=0)
    random = np.random.default_rng(0).uniform(size=(POINTS, z.shape[1]))
    around: Array = np.concatenate([few, lower + random * (upper - lower)])
    return around


def _best(derivative: Callable[[float], Array], order: int, largest: float, floor: Array) -> float:
    """The length at which a derivative is least sensitive to it, relative to its size or, if greater, to ``floor``: a
    function's value over the largest length, below which derivatives matter little.

    Rounding counts at every length for as much as it may do: over short lengths the change of a function may be lost to rounding.
    """
    tried = [largest * 0.25**k for k in range(TRIED)]
    found = [derivative(length) for length in tried]
    worst = []
    for (wide, narrow), length in zip(pairwise(found), tried[1:], strict=True):
        rounding = ROUNDING * floor * (largest / (relative_step(order) * length)) ** order
        error, size = np.abs(wide - narrow).max(axis=0) + rounding, np.abs(narrow).max(axis=0) + floor
        relative = np.where(size > 0.0, error / np.where(size > 0.0, size, 1.0), 0.0)
        worst.append(float(relative.max(initial=0.0)) if np.isfinite(relative).all() else np.inf)
    # Between the two that agree best.
    return 0.5 * tried[int(np.argmin(worst))]


def relative_errors(backend: Any, x: Array, u: Array, phi: Array) -> tuple[float, float, float]:
    """Relative errors of first, second and third derivatives: how far they change where all steps are halved, over points
    along a trajectory x (B, n), u (B, m), and around it.

    The backend has ``scaled(factor)`` beside the protocol's methods. Variables and functions count by how large they become
    there; errors are relative to the largest derivative, or to the
    function where that is larger.
    """
    z = np.concatenate([x, u], axis=1)
    z = z[np.isfinite(z).all(axis=1)]
    reach, n = _size(z), x.shape[1]
    z = np.ascontiguousarray(_around(z)[::MEASURED])
    x, u = np.ascontiguousarray(z[:, :n]), np.ascontiguousarray(z[:, n:])
    half = backend.scaled(0.5)
    next_state, measured = _size(backend.steps(x, u, phi)), _size(backend.observations(x, phi))
    cost, final_cost = _size(backend.stage_costs(x, u, phi)), _size(backend.final_costs(x, phi))
    random = np.random.default_rng(0)
    costates = random.normal(size=x.shape) / next_state
    jacobian = random.normal(size=(len(z), n, z.shape[1])) * reach / next_state[:, None]
    square = random.normal(size=(len(z), z.shape[1], z.shape[1])) * reach * reach[:, None]
    square = square + np.swapaxes(square, 1, 2)
    both, by_x = reach * reach[:, None], reach[:n]

    def error(call: Callable[[Any], Any], scale: Array) -> float:
        one, other = call(backend) * scale, call(half) * scale
        return float(np.abs(one - other).max(initial=0.0)) / max(1.0, float(np.abs(one).max(initial=0.0)))

    first = [
        error(lambda of: of.dynamics_jacobians(x, u, phi), reach / next_state[:, None]),
        error(lambda of: of.measurement_jacobians(x, phi), by_x / measured[:, None]),
        error(lambda of: of.stage_quadratics(x, u, phi)[1], reach / cost),
        error(lambda of: of.final_quadratics(x, phi)[1], by_x / final_cost),
    ]
    second = [
        error(lambda of: of.stage_quadratics(x, u, phi)[0], both / cost),
        error(lambda of: of.final_quadratics(x, phi)[0], both[:n, :n] / final_cost),
        error(lambda of: of.dynamics_curvature(x, u, costates, phi), both),
        error(lambda of: of.contract_dynamics(x, u, jacobian, phi)[0], reach),
    ]
    third = [
        error(lambda of: of.contract_stage_costs(x, u, square / cost, phi)[0], reach),
        error(lambda of: of.contract_final_costs(x, square[:, :n, :n] / final_cost, phi)[0], by_x),
    ]
    return max(first), max(second), max(third)


def _size(values: Array) -> Array:
    """How large each of some numbers becomes over the first axis; 1 where it is always 0."""
    size = np.abs(values).max(axis=0)
    return np.asarray(np.where(size > 0.0, size, 1.0))
