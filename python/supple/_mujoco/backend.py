"""The engine's model interface, implemented with MuJoCo's functions and finite differences."""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

import numpy as np

from .._backends.stencils import FIRST
from .._records import Array
from .costs import Cost
from .differences import hessian
from .names import Outputs
from .simulator import Simulator

__all__ = ["MujocoBackend"]

#: Results to keep: those that Newton's method and gradients ask for more than once.
_KEPT = 4


class MujocoBackend:
    """A :class:`supple._backends.protocol.Backend`.

    First derivatives are MuJoCo's. Second derivatives of the dynamics are second differences of steps, of fourth order in
    ``curvature_eps``; derivatives by parameters are differences of fourth order over ``steps`` (P,), negative ones
    relative to the parameters' values.
    """

    def __init__(
        self, simulator: Simulator, outputs: Outputs, cost: Cost, final: Cost, steps: Array, curvature_eps: float
    ) -> None:
        self.simulator, self.outputs, self.cost, self.final = simulator, outputs, cost, final
        self.states, self.controls, self.measurements = simulator.states, simulator.controls, len(outputs)
        self._steps, self._curvature_eps = np.asarray(steps), curvature_eps
        self._prepare()

    def _prepare(self) -> None:
        self._kept: OrderedDict[bytes, Any] = OrderedDict()
        self._lock = threading.Lock()

    def scaled(self, factor: float) -> MujocoBackend:
        """The same backend with all finite-difference steps scaled by a factor."""
        simulator = self.simulator.scaled(factor)
        cost, final = self.cost.scaled(factor, simulator), self.final.scaled(factor, simulator)
        return MujocoBackend(simulator, self.outputs, cost, final, factor * self._steps, factor * self._curvature_eps)

    def source(self) -> str:
        """What the model is, as a text: journals of sweeps use it to recognise their task."""
        measured = (self.outputs.sources.tolist(), self.outputs.sensed.tolist())
        steps = (self._steps.tolist(), self._curvature_eps)
        parts = (
            self.simulator.source(),
            f"measured {measured}, steps {steps}",
            self.cost.source(),
            self.final.source(),
        )
        return "\n".join(parts)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_kept", "_lock")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()

    def _once(self, what: str, arrays: tuple[Array, ...], make: Callable[[], Any]) -> Any:
        """Caches the result of ``make`` for the next call with the same arrays."""
        digest = hashlib.blake2b(what.encode())
        for array in arrays:
            digest.update(np.ascontiguousarray(array).tobytes())
        key = digest.digest()
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        made = make()
        with self._lock:
            self._kept[key] = made
            while len(self._kept) > _KEPT:
                self._kept.popitem(last=False)
        return made

    def _by_parameters(self, function: Callable[[Array], Array], phi: Array) -> list[Array]:
        """Derivatives of ``function`` (P,) -> array by each parameter."""
        derivatives = []
        for k, h in enumerate(np.where(self._steps < 0.0, -self._steps * np.abs(phi), self._steps)):
            values = [np.asarray(function(phi + multiple * h * np.eye(len(phi))[k])) for multiple, _ in FIRST]
            # Differences of pairs first: what is equal on both sides then cancels exactly.
            (_, inner), (_, outer) = FIRST[2:]
            derivatives.append((inner * (values[2] - values[1]) + outer * (values[3] - values[0])) / h)
        return derivatives

    def _sums(self, function: Callable[[Array], Array], phi: Array) -> Array:
        """The same for the sum over all entries: (P,)."""
        return np.array([float(np.sum(one)) for one in self._by_parameters(function, phi)])

    # Values.

    def roll_out(
        self,
        start: Array,
        controls: Array,
        feedback: Array | None,
        reference: Array | None,
        bounds: tuple[Array, Array] | None,
        phi: Array,
    ) -> tuple[Array, Array, float]:
        """States (N+1, n), controls (N, m) and cost; see the protocol."""

        def law(t: int, x: Array) -> Array:
            u: Array = controls[t]
            if feedback is not None and reference is not None:
                u = u + feedback[t] @ (x - reference[t])
            return u if bounds is None else np.asarray(np.clip(u, *bounds))

        x, u = self.simulator.roll_out(start, law, len(controls), phi)
        if not (np.all(np.isfinite(x)) and np.all(np.isfinite(u))):
            return x, u, np.inf
        total = np.sum(self.stage_costs(x[:-1], u, phi)) + np.sum(self.final_costs(x[-1:], phi))
        return x, u, float(total)

    def steps(self, x: Array, u: Array, phi: Array) -> Array:
        """``f``: (B, n)."""
        return self.simulator.steps(x, u, phi)

    def observations(self, x: Array, phi: Array) -> Array:
        """``g``: (B, p)."""
        return self.simulator.observe(x, phi, self.outputs)

    def stage_costs(self, x: Array, u: Array, phi: Array) -> Array:
        """``l``: (B,)."""
        return self.cost.values(np.concatenate([x, u], axis=1), phi)

    def final_costs(self, x: Array, phi: Array) -> Array:
        """``l_N``: (B,)."""
        return self.final.values(x, phi)

    # Derivatives by states and controls.

    def dynamics_jacobians(self, x: Array, u: Array, phi: Array) -> Array:
        """``[f_x f_u]``: (B, n, n+m)."""
        found: Array = self._once("f_z", (x, u, phi), lambda: self.simulator.dynamics_jacobians(x, u, phi))
        return found

    def measurement_jacobians(self, x: Array, phi: Array) -> Array:
        """``g_x``: (B, p, n)."""
        return self.simulator.output_jacobians(x, phi, self.outputs)

    def stage_quadratics(self, x: Array, u: Array, phi: Array) -> tuple[Array, Array]:
        """``l_zz``: (B, n+m, n+m), and ``l_z``: (B, n+m)."""
        z = np.concatenate([x, u], axis=1)
        return self.cost.hessians(z, phi), self.cost.gradients(z, phi)

    def final_quadratics(self, x: Array, phi: Array) -> tuple[Array, Array]:
        """``l_N,xx``: (B, n, n), and ``l_N,x``: (B, n)."""
        return self.final.hessians(x, phi), self.final.gradients(x, phi)

    def _bent(self, x: Array, u: Array, phi: Array) -> Array:
        """``f_zz``: (B, n, n+m, n+m)."""
        n = self.states

        def make() -> Array:
            z = np.concatenate([x, u], axis=1)
            return hessian(lambda at: self.simulator.steps(at[:, :n], at[:, n:], phi), z, self._curvature_eps)

        found: Array = self._once("f_zz", (x, u, phi), make)
        return found

    def dynamics_curvature(self, x: Array, u: Array, costates: Array, phi: Array) -> Array:
        """``(lambda' f)_zz``: (B, n+m, n+m), with costates (B, n)."""
        return np.asarray(np.einsum("bi,bijk->bjk", costates, self._bent(x, u, phi)))

    # Contractions.

    def contract_dynamics(self, x: Array, u: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``sum <adjoint, [f_x f_u]>``: by ``z`` (B, n+m), by ``phi`` (P,)."""
        by_z = np.einsum("bij,bijk->bk", adjoints, self._bent(x, u, phi))
        return by_z, self._contract_moved(x, u, adjoints, phi)

    def _contract_moved(self, x: Array, u: Array, adjoints: Array, phi: Array) -> Array:
        """The gradient of ``sum <adjoint, [f_x f_u]>`` by ``phi`` (P,)."""
        moved = self._once(
            "f_zphi",
            (x, u, phi),
            lambda: self._by_parameters(lambda at: self.simulator.dynamics_jacobians(x, u, at), phi),
        )
        return np.array([float(np.sum(adjoints * one)) for one in moved])

    def contract_measurements(self, x: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``sum <adjoint, g_x>``: by ``x`` (B, n), by ``phi`` (P,)."""
        if not self.outputs.sensed.any():
            return np.zeros_like(x), np.zeros_like(phi)
        bent = hessian(lambda at: self.observations(at, phi), x, self._curvature_eps)
        by_phi = self._sums(lambda at: adjoints * self.measurement_jacobians(x, at), phi)
        return np.asarray(np.einsum("bij,bijk->bk", adjoints, bent)), by_phi

    def contract_stage_costs(self, x: Array, u: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``sum <adjoint, l_zz>``: by ``z`` (B, n+m), by ``phi`` (P,)."""
        return self._contract_cost(self.cost, np.concatenate([x, u], axis=1), adjoints, phi)

    def contract_final_costs(self, x: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``sum <adjoint, l_N,xx>``: by ``x`` (B, n), by ``phi`` (P,)."""
        return self._contract_cost(self.final, x, adjoints, phi)

    def _contract_cost(self, cost: Cost, z: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        by_phi = self._sums(lambda at: adjoints * cost.hessians(z, at), phi)
        return cost.contract(z, adjoints, phi), by_phi

    # Derivatives by parameters.

    def stage_parameters(self, x: Array, u: Array, costates: Array, phi: Array) -> Array:
        """``sum l_phi + lambda' f_phi``: (P,)."""
        z = np.concatenate([x, u], axis=1)
        dynamics = self._sums(lambda at: costates * self.simulator.steps(x, u, at), phi)
        return dynamics + self._sums(lambda at: self.cost.values(z, at), phi)

    def final_parameters(self, x: Array, phi: Array) -> Array:
        """``sum l_N,phi``: (P,)."""
        return self._sums(lambda at: self.final.values(x, at), phi)

    def stage_parameters_along(
        self, x: Array, u: Array, costates: Array, dz: Array, dcostates: Array, phi: Array
    ) -> Array:
        """The derivative of :meth:`stage_parameters` along ``dz`` (B, n+m) and ``dcostates`` (B, n): (P,)."""
        z = np.concatenate([x, u], axis=1)
        bent = self._contract_moved(x, u, costates[:, :, None] * dz[:, None, :], phi)
        moved = self._sums(lambda at: dcostates * self.simulator.steps(x, u, at), phi)
        return bent + moved + self._sums(lambda at: dz * self.cost.gradients(z, at), phi)

    def final_parameters_along(self, x: Array, dx: Array, phi: Array) -> Array:
        """The derivative of :meth:`final_parameters` along ``dx`` (B, n): (P,)."""
        return self._sums(lambda at: dx * self.final.gradients(x, at), phi)
