"""Costs of MuJoCo models, with derivatives.

``z = (x, u)``; a final cost is one of ``z = x`` alone. Parameters ``phi`` (P,).
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._backends import stencils
from .._backends.functions import Values, checked, pack, unpack
from .._records import Array
from .._source import of_function
from ..errors import UsageError
from . import names
from .differences import contract_hessian, hessian
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

    #: Factor on all steps of differences.
    _factor = 1.0

    @abstractmethod
    def source(self) -> str:
        """What the cost is, as a text."""

    def scaled(self, factor: float, simulator: Simulator) -> Cost:
        """The same with all steps of differences times a factor, and with this simulator."""
        other = copy.copy(self)
        other._factor = factor * self._factor
        return other

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
    """A function of the user's, ``cost(x, u, p)`` or ``final_cost(x, p)`` -> (B,), by differences of its values.

    Args:
        name: ``cost`` or ``final_cost``; only the former takes ``u``.
        function: The function.
        states: n.
        parameters: Names of all parameters.
    """

    def __init__(self, name: str, function: Callable[..., Any], states: int, parameters: Sequence[str]) -> None:
        self._name, self._function, self._states, self._parameters = name, function, states, tuple(parameters)

    def source(self) -> str:
        return of_function(self._function)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_function": pack(self._function, f"`{self._name}`")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._function = unpack(state["_function"], f"`{self._name}`")

    def values(self, z: Array, phi: Array) -> Array:
        p, n = Values(self._parameters, phi), self._states
        with np.errstate(all="ignore"):
            found = self._function(z[:, :n], z[:, n:], p) if self._name == "cost" else self._function(z, p)
        return checked(f"`{self._name}`", found, (len(z),))

    def gradients(self, z: Array, phi: Array) -> Array:
        return self._gradients(z, phi, FIRST)

    def _gradients(self, z: Array, phi: Array, step: float) -> Array:
        return stencils.first(lambda at: self.values(at, phi), z, np.full(z.shape[1], self._factor * step))

    def hessians(self, z: Array, phi: Array) -> Array:
        return hessian(lambda at: self.values(at, phi)[:, None], z, self._factor * SECOND)[:, 0]

    def contract(self, z: Array, weights: Array, phi: Array) -> Array:
        return contract_hessian(lambda at: self._gradients(at, phi, THIRD), z, weights, self._factor * THIRD)


@dataclass(frozen=True)
class Quadratic:
    """Weighted squares of states, sensors and controls less their targets; see :func:`supple.mujoco.quadratic`."""

    states: Mapping[str, Term]
    sensors: Mapping[str, Term]
    controls: Mapping[str, Term]
    final_states: Mapping[str, Term] | None = None
    final_sensors: Mapping[str, Term] | None = None


class _Weighted:
    """Weights and targets (r,), numbers or parameters; 0 where none is set."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._entries: dict[int, tuple[Weight, Weight]] = {}

    def set(self, name: str, places: list[int], term: Term, parameters: Sequence[str]) -> None:
        """Sets a term for these places, over what was set for them."""
        weight, target = term if isinstance(term, tuple) else (term, 0.0)
        targets: list[Any] = [target] * len(places) if np.ndim(target) == 0 else list(np.asarray(target, dtype=object))
        if len(targets) != len(places):
            raise UsageError(
                f"cost: `{name}` has {len(places)} numbers and {len(targets)} targets: give one each, or one for all"
            )
        for place, value in zip(places, targets, strict=True):
            self._entries[place] = (_number(name, weight, parameters), _number(name, value, parameters))
            if not isinstance(weight, str) and not float(weight) >= 0.0:
                raise UsageError(f"cost: the weight of `{name}` must be at least 0; found {weight}")

    @property
    def entries(self) -> list[tuple[int, tuple[Weight, Weight]]]:
        """Weights and targets by place."""
        return sorted(self._entries.items())

    def at(self, phi: Array) -> tuple[Array, Array]:
        """Weights (r,) and targets (r,)."""
        weights, targets = np.zeros(self._size), np.zeros(self._size)
        for place, (weight, target) in self._entries.items():
            weights[place] = phi[int(weight[1:])] if isinstance(weight, str) else weight
            targets[place] = phi[int(target[1:])] if isinstance(target, str) else target
        return weights, targets

    def __bool__(self) -> bool:
        return bool(self._entries)


def _number(name: str, value: Any, parameters: Sequence[str]) -> Weight:
    """A finite number; a parameter becomes ``#`` and its index."""
    if isinstance(value, str):
        return f"#{names.find('parameter, as the cost wants,', value, parameters)}"
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = float("nan")
    if not np.isfinite(number):
        raise UsageError(f"cost: `{name}` has {value!r}, which is neither a finite number nor the name of a parameter")
    return number


class QuadraticCost(Cost):
    """``sum w (z - target)^2 + sum w (s(x) - target)^2``: exact by ``z``, by MuJoCo's derivatives through sensors ``s``."""

    def __init__(
        self,
        simulator: Simulator,
        direct: Sequence[tuple[Sequence[str], Mapping[str, Term]]],
        outputs: Outputs,
        sensed: Mapping[str, Term],
        parameters: Sequence[str],
    ) -> None:
        self._simulator, self._outputs = simulator, outputs
        self._direct = _Weighted(sum(len(channels) for channels, _ in direct))
        first = 0
        for channels, terms in direct:
            for pattern in sorted(terms, key=lambda pattern: (pattern in channels, len(pattern))):
                places = [first + i for i in names.select("state or control, as the cost wants,", pattern, channels)]
                self._direct.set(pattern, places, terms[pattern], parameters)
            first += len(channels)
        self._sensed = _Weighted(len(outputs))
        for name, term in sensed.items():
            if name not in outputs.groups:
                raise names.unknown("sensor, as the cost wants,", name, list(outputs.groups))
            first, count = outputs.groups[name]
            self._sensed.set(name, list(range(first, first + count)), term, parameters)

    def source(self) -> str:
        sensed = [channel.name for channel in self._outputs.channels]
        return f"squares of states and controls {self._direct.entries}, of {sensed} {self._sensed.entries}"

    def scaled(self, factor: float, simulator: Simulator) -> Cost:
        other = copy.copy(self)
        other._factor, other._simulator = factor * self._factor, simulator
        return other

    def _residuals(self, z: Array, phi: Array) -> tuple[Array, Array]:
        """Weighted residuals of sensors (B, r), and the weights (r,)."""
        weights, targets = self._sensed.at(phi)
        return weights * (
            self._simulator.observe(z[:, : self._simulator.states], phi, self._outputs) - targets
        ), weights

    def values(self, z: Array, phi: Array) -> Array:
        weights, targets = self._direct.at(phi)
        total = np.sum(weights * (z - targets) ** 2, axis=1)
        if self._sensed:
            weights, targets = self._sensed.at(phi)
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
        residuals, _ = self._residuals(x, phi)
        found: Array = 2.0 * np.einsum("bri,br->bi", self._simulator.output_jacobians(x, phi, self._outputs), residuals)
        return found

    def hessians(self, z: Array, phi: Array) -> Array:
        weights, _ = self._direct.at(phi)
        out = np.tile(np.diag(2.0 * weights), (len(z), 1, 1))
        if self._sensed:
            n, outputs = self._simulator.states, self._outputs
            x = z[:, :n]
            residuals, weights = self._residuals(z, phi)
            C = self._simulator.output_jacobians(x, phi, outputs)
            bent = hessian(lambda at: self._simulator.observe(at, phi, outputs), x, self._factor * SECOND)
            out[:, :n, :n] += 2.0 * np.einsum("bri,r,brj->bij", C, weights, C) + 2.0 * np.einsum(
                "br,brij->bij", residuals, bent
            )
        return out

    def contract(self, z: Array, weights: Array, phi: Array) -> Array:
        out = np.zeros_like(z)
        if self._sensed:
            n = self._simulator.states
            out[:, :n] = contract_hessian(
                lambda x: self._sensor_gradients(x, phi), z[:, :n], weights[:, :n, :n], self._factor * THIRD
            )
        return out
