"""Costs of MuJoCo models, with derivatives.

``z = (x, u)``; a final cost is one of ``z = x`` alone. Parameters ``phi`` (P,).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._records import Array
from ..errors import UsageError
from . import names
from .differences import contract_hessian, hessian, jacobian
from .names import Outputs
from .simulator import Simulator

__all__ = ["Cost", "FunctionCost", "Quadratic", "QuadraticCost"]

#: Steps of differences of functions that round to the last bit: for first, second and third derivatives.
FIRST, SECOND, THIRD = 1e-3, 2e-3, 1e-2

Weight = float | str
#: A weight, or a weight and a target: one number or one per entry.
Term = Weight | tuple[Weight, Any]


class Cost(ABC):
    """A cost ``l(z; phi)``."""

    @abstractmethod
    def values(self, z: Array, phi: Array) -> Array:
        """``l``: (B,)."""

    @abstractmethod
    def gradients(self, z: Array, phi: Array) -> Array:
        """``l_z``: (B, k)."""

    @abstractmethod
    def hessians(self, z: Array, phi: Array) -> Array:
        """``l_zz``: (B, k, k)."""

    @abstractmethod
    def contract(self, z: Array, weights: Array, phi: Array) -> Array:
        """The gradient of ``<weights, l_zz>`` by ``z``, weights (B, k, k): (B, k)."""


class FunctionCost(Cost):
    """A function of the user's, (B, k) -> (B,), by differences of its values."""

    def __init__(self, name: str, function: Callable[[Array, Array], Any]) -> None:
        self._name, self._function = name, function

    def values(self, z: Array, phi: Array) -> Array:
        found = np.asarray(self._function(z, phi))
        if found.shape != (len(z),) or found.dtype != np.float64:
            raise UsageError(
                f"{self._name} returned shape {found.shape} of {found.dtype} for {len(z)} points: it must return float64 of "
                f"shape ({len(z)},). Its arguments have the points along the first axis: sum over the last"
            )
        return found

    def gradients(self, z: Array, phi: Array) -> Array:
        return jacobian(lambda at: self.values(at, phi), z, FIRST)

    def hessians(self, z: Array, phi: Array) -> Array:
        return hessian(lambda at: self.values(at, phi)[:, None], z, SECOND)[:, 0]

    def contract(self, z: Array, weights: Array, phi: Array) -> Array:
        return contract_hessian(lambda at: jacobian(lambda near: self.values(near, phi), at, THIRD), z, weights, THIRD)


@dataclass(frozen=True)
class Quadratic:
    """Weighted squares of states, sensors and controls less their targets; see :func:`supple.mujoco.quadratic`."""

    states: Mapping[str, Term]
    sensors: Mapping[str, Term]
    controls: Mapping[str, Term]
    final_states: Mapping[str, Term] | None = None
    final_sensors: Mapping[str, Term] | None = None


class _Weighted:
    """Weights and targets (r,) of numbers, either of which may be a parameter."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._entries: list[tuple[int, float | int, float | int, bool, bool]] = []

    def add(self, place: int, weight: Weight, target: Weight, parameters: Sequence[str]) -> None:
        def number(value: Weight) -> tuple[float | int, bool]:
            if isinstance(value, str):
                return names.find("parameter", value, parameters), True
            return float(value), False

        (w, named_w), (t, named_t) = number(weight), number(target)
        if not named_w and not (w >= 0.0 and np.isfinite(w)):
            raise UsageError(f"cost: a weight must be at least 0; found {weight}")
        self._entries.append((place, w, t, named_w, named_t))

    def at(self, phi: Array) -> tuple[Array, Array]:
        """Weights (r,) and targets (r,). Where a number has several terms their sum is one of both, up to a constant."""
        weights, moments = np.zeros(self._size), np.zeros(self._size)
        for place, w, t, named_w, named_t in self._entries:
            weight, target = phi[int(w)] if named_w else w, phi[int(t)] if named_t else t
            weights[place] += weight
            moments[place] += weight * target
        return weights, np.divide(moments, weights, out=np.zeros(self._size), where=weights != 0.0)

    def __bool__(self) -> bool:
        return bool(self._entries)


class QuadraticCost(Cost):
    """``sum w (z - target)^2 + sum w (s(x) - target)^2``: exact by ``z``, by MuJoCo's derivatives through sensors ``s``."""

    def __init__(
        self,
        simulator: Simulator,
        channels: Sequence[str],
        outputs: Outputs | None,
        terms: Mapping[str, Term],
        sensed: Mapping[str, Term],
        parameters: Sequence[str],
    ) -> None:
        self._simulator, self._outputs = simulator, outputs
        self._direct = _Weighted(len(channels))
        for pattern, term in terms.items():
            places = names.select("state or control, as the cost wants,", pattern, channels)
            _add(self._direct, pattern, places, term, parameters)
        self._sensed = _Weighted(len(outputs) if outputs is not None else 0)
        for name, term in sensed.items():
            if outputs is None or name not in outputs.groups:
                raise names.unknown("sensor, as the cost wants,", name, list(outputs.groups) if outputs is not None else [])
            first, count = outputs.groups[name]
            _add(self._sensed, name, list(range(first, first + count)), term, parameters)

    def _residuals(self, z: Array, phi: Array) -> tuple[Array, Array]:
        """Weighted residuals of sensors (B, r), and the weights (r,)."""
        assert self._outputs is not None
        weights, targets = self._sensed.at(phi)
        return weights * (self._simulator.observe(z[:, : self._simulator.states], phi, self._outputs) - targets), weights

    def values(self, z: Array, phi: Array) -> Array:
        weights, targets = self._direct.at(phi)
        total = np.sum(weights * (z - targets) ** 2, axis=1)
        if self._sensed:
            weights, targets = self._sensed.at(phi)
            assert self._outputs is not None
            sensed = self._simulator.observe(z[:, : self._simulator.states], phi, self._outputs)
            total = total + np.sum(weights * (sensed - targets) ** 2, axis=1)
        return np.asarray(total)

    def gradients(self, z: Array, phi: Array) -> Array:
        weights, targets = self._direct.at(phi)
        out = 2.0 * weights * (z - targets)
        if self._sensed:
            out[:, : self._simulator.states] += self._sensor_gradients(z[:, : self._simulator.states], phi)
        return np.asarray(out)

    def _sensor_gradients(self, x: Array, phi: Array) -> Array:
        assert self._outputs is not None
        residuals, _ = self._residuals(x, phi)
        return 2.0 * np.einsum("bri,br->bi", self._simulator.output_jacobians(x, phi, self._outputs), residuals)

    def hessians(self, z: Array, phi: Array) -> Array:
        weights, _ = self._direct.at(phi)
        out = np.tile(np.diag(2.0 * weights), (len(z), 1, 1))
        if self._sensed:
            assert self._outputs is not None
            n, outputs = self._simulator.states, self._outputs
            x = z[:, :n]
            residuals, weights = self._residuals(z, phi)
            C = self._simulator.output_jacobians(x, phi, outputs)
            bent = hessian(lambda at: self._simulator.observe(at, phi, outputs), x, SECOND)
            out[:, :n, :n] += 2.0 * np.einsum("bri,r,brj->bij", C, weights, C) + 2.0 * np.einsum("br,brij->bij", residuals, bent)
        return out

    def contract(self, z: Array, weights: Array, phi: Array) -> Array:
        out = np.zeros_like(z)
        if self._sensed:
            n = self._simulator.states
            out[:, :n] = contract_hessian(lambda x: self._sensor_gradients(x, phi), z[:, :n], weights[:, :n, :n], THIRD)
        return out


def _add(weighted: _Weighted, name: str, places: list[int], term: Term, parameters: Sequence[str]) -> None:
    weight, target = term if isinstance(term, tuple) else (term, 0.0)
    targets = [target] * len(places) if isinstance(target, (str, int, float)) else list(target)
    if len(targets) != len(places):
        raise UsageError(f"cost: `{name}` has {len(places)} numbers and {len(targets)} targets: give one each, or one for all")
    for place, value in zip(places, targets, strict=True):
        weighted.add(place, weight, value, parameters)
