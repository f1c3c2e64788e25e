"""Functions written in NumPy for batches of points: differentiated by central differences of fourth order.

What the user gives of the derivatives is differentiated in place of the functions. Where nothing is given, relative errors
are, for functions that are smooth over the lengths found and do not cancel: 1e-12 for first, 1e-10 for second and 1e-9 for
third derivatives. :meth:`Differences.errors` measures them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._records import Array
from . import stencils
from .functions import Functions
from .stencils import relative_step

__all__ = ["Differences", "Lengths"]

Point = Callable[[Array, Array], Array]

#: Lengths by function and order of the derivative.
Lengths = dict[tuple[str, int], Array]


class Differences:
    """A :class:`~supple._backends.protocol.Backend` by finite differences.

    Args:
        functions: What the user wrote, for batches.
        given: Derivatives that the user gives: an object with some of the protocol's methods, others ``None``.
        lengths: Over which each of ``z = (x, u)`` has to change for a function's derivatives to change, by the function's name
            and the order of the derivatives, 1 to 3: (n+m,) each.
        scales: The same for each parameter, (P,).
    """

    def __init__(self, functions: Functions, given: Any, lengths: Lengths, scales: Array) -> None:
        self.functions = functions
        self.given = given
        self.states = functions.states
        self.controls = functions.controls
        self.measurements = functions.measurements
        self.lengths = lengths
        self.scales = scales

    def source(self) -> str:
        """The code of the functions, which says what the model is."""
        return f"{type(self).__name__}\n{self.functions.source()}"

    def scaled(self, factor: float) -> Differences:
        """The same with all steps times a factor."""
        lengths = {key: factor * lengths for key, lengths in self.lengths.items()}
        return Differences(self.functions, self.given, lengths, factor * self.scales)

    def _lengths(self, name: str, order: int, z: Array) -> Array:
        return self.lengths[name, order][: z.shape[1]]

    # The functions by z = (x, u).

    def _of(self, name: str) -> Point:
        """A function of ``z`` and phi; that of final costs and measurements has no ``u`` in its ``z``."""
        n = self.states
        return lambda z, phi: self.functions.batch(name, z[:, :n], z[:, n:], phi)

    def _gradient(self, name: str, key: str) -> Point | None:
        """A derivative that the user gives, of ``z`` and phi."""
        method = getattr(self.given, key, None)
        if method is None:
            return None
        n, has_control = self.states, self.functions.has_control(name)
        return lambda z, phi: method(z[:, :n], z[:, n:], phi) if has_control else method(z, phi)

    def _jacobian(self, name: str, key: str, z: Array, phi: Array, order: int = 1) -> Array:
        """``[f_x f_u]`` or ``g_x``: (B, k, J); with the steps that suit derivatives of this order."""
        given = self._gradient(name, key)
        if given is not None:
            return given(z, phi)
        function = self._of(name)
        steps = relative_step(order) * self._lengths(name, order, z)
        return stencils.first(lambda z: function(z, phi), z, steps)

    def _tensor(self, name: str, key: str, z: Array, phi: Array, order: int = 2) -> Array:
        """Second derivatives of a vector: (B, k, J, J)."""
        given = self._gradient(name, key)
        if given is not None:
            steps = relative_step(1) * self._lengths(name, 1, z)
            found = stencils.first(lambda z: given(z, phi), z, steps)
            half: Array = 0.5 * (found + np.swapaxes(found, -1, -2))
            return half
        function = self._of(name)
        return stencils.second(lambda z: function(z, phi), z, self._lengths(name, order, z), relative_step(order))

    def _quadratic(self, name: str, key: str, z: Array, phi: Array, order: int = 2) -> Array:
        """Second derivatives of a cost: (B, J, J)."""
        given = self._gradient(name, key)
        if given is not None:
            return np.asarray(given(z, phi)[0])
        function = self._of(name)
        return stencils.second(lambda z: function(z, phi), z, self._lengths(name, order, z), relative_step(order))

    def _by_parameters(self, function: Callable[[Array], Array], phi: Array, order: int = 1) -> Array:
        """Derivatives of something by each parameter, along a last axis: (..., P)."""
        steps = relative_step(order) * self._scales_at(phi)
        columns = []
        for index, step in enumerate(steps):
            values = []
            for multiple, _ in stencils.FIRST:
                moved = phi.copy()
                moved[index] += multiple * step
                values.append(function(moved))
            outer, inner = values[3] - values[0], values[2] - values[1]
            columns.append((stencils.FIRST[3][1] * outer + stencils.FIRST[2][1] * inner) / step)
        return np.stack(columns, axis=-1) if columns else np.zeros((*function(phi).shape, 0))

    def _scales_at(self, phi: Array) -> Array:
        """Scales of the parameters; negative ones are relative to the parameter's own value."""
        return np.where(self.scales < 0.0, -self.scales * np.abs(phi), self.scales)

    # What the engine calls.

    def roll_out(
        self,
        start: Array,
        controls: Array,
        feedback: Array | None,
        reference: Array | None,
        bounds: tuple[Array, Array] | None,
        phi: Array,
    ) -> tuple[Array, Array, float]:
        """See the protocol. One call of ``step`` for each step, one of ``cost`` for all."""
        steps = len(controls)
        x, u = np.full((steps + 1, self.states), np.nan), np.array(controls)
        x[0] = start
        for t in range(steps):
            if feedback is not None and reference is not None:
                u[t] += feedback[t] @ (x[t] - reference[t])
            if bounds is not None:
                u[t] = np.clip(u[t], *bounds)
            x[t + 1] = self.functions.batch("step", x[t : t + 1], u[t : t + 1], phi)[0]
            if not np.isfinite(x[t + 1]).all():
                return x, u, np.inf
        cost = self.stage_costs(x[:-1], u, phi).sum() + self.final_costs(x[-1:], phi)[0]
        return x, u, float(cost)

    def steps(self, x: Array, u: Array, phi: Array) -> Array:
        """See the protocol."""
        return self.functions.batch("step", x, u, phi)

    def observations(self, x: Array, phi: Array) -> Array:
        """See the protocol."""
        return self.functions.batch("observe", x, x[:, :0], phi)

    def stage_costs(self, x: Array, u: Array, phi: Array) -> Array:
        """See the protocol."""
        return self.functions.batch("cost", x, u, phi)

    def final_costs(self, x: Array, phi: Array) -> Array:
        """See the protocol."""
        return self.functions.batch("final_cost", x, x[:, :0], phi)

    def dynamics_jacobians(self, x: Array, u: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._jacobian("step", "dynamics_jacobians", _joint(x, u), phi)

    def measurement_jacobians(self, x: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._jacobian("observe", "measurement_jacobians", x, phi)

    def stage_quadratics(self, x: Array, u: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._both("cost", "stage_quadratics", _joint(x, u), phi)

    def final_quadratics(self, x: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._both("final_cost", "final_quadratics", x, phi)

    def _both(self, name: str, key: str, z: Array, phi: Array) -> tuple[Array, Array]:
        given = self._gradient(name, key)
        if given is not None:
            second, gradient = given(z, phi)
            return second, gradient
        function = self._of(name)
        gradient = stencils.first(lambda z: function(z, phi), z, relative_step(1) * self._lengths(name, 1, z))
        return self._quadratic(name, key, z, phi), gradient

    def dynamics_curvature(self, x: Array, u: Array, costates: Array, phi: Array) -> Array:
        """See the protocol."""
        found: Array = np.einsum(
            "bk,bkij->bij", costates, self._tensor("step", "dynamics_jacobians", _joint(x, u), phi)
        )
        return found

    def contract_dynamics(self, x: Array, u: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._contract_jacobian("step", "dynamics_jacobians", _joint(x, u), adjoints, phi)

    def contract_measurements(self, x: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._contract_jacobian("observe", "measurement_jacobians", x, adjoints, phi)

    def _contract_jacobian(self, name: str, key: str, z: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        by_point = np.einsum("bki,bkij->bj", adjoints, self._tensor(name, key, z, phi))
        order = 1 if self._gradient(name, key) is not None else 2

        def weighed(phi: Array) -> Array:
            found: Array = np.einsum("bki,bki->b", adjoints, self._jacobian(name, key, z, phi, order))
            return found

        return by_point, self._by_parameters(weighed, phi, order).sum(axis=0)

    def contract_stage_costs(self, x: Array, u: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._contract_cost("cost", "stage_quadratics", _joint(x, u), adjoints, phi)

    def contract_final_costs(self, x: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._contract_cost("final_cost", "final_quadratics", x, adjoints, phi)

    def _contract_cost(self, name: str, key: str, z: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """The gradient of ``<adjoint, l_zz>``: second derivatives along the principal directions of the adjoints."""
        order = 1 if self._gradient(name, key) is not None else 3
        lengths = self._lengths(name, order, z)
        if order == 1:

            def weighed(z: Array, phi: Array) -> Array:
                repeated = np.tile(adjoints, (len(z) // len(adjoints), 1, 1))
                found: Array = np.einsum("bij,bij->b", repeated, self._quadratic(name, key, z, phi))
                return found

        else:
            sizes, axes = np.linalg.eigh(adjoints / (lengths[:, None] * lengths[None, :]))
            # (J, B, J): direction, point, variable.
            directions = np.moveaxis(axes, -1, 0) * lengths
            weights = np.moveaxis(sizes, -1, 0)
            function, step = self._of(name), relative_step(3)

            def weighed(z: Array, phi: Array) -> Array:
                copies = len(z) // len(adjoints)
                turned = np.tile(directions, (1, copies, 1))
                found = stencils.second_along(lambda z: function(z, phi), z, turned, step)
                total: Array = (np.tile(weights, (1, copies)) * found).sum(axis=0)
                return total

        by_point = stencils.first(lambda z: weighed(z, phi), z, relative_step(order) * lengths)
        return by_point, self._by_parameters(lambda phi: weighed(z, phi), phi, order).sum(axis=0)

    def stage_parameters(self, x: Array, u: Array, costates: Array, phi: Array) -> Array:
        """See the protocol."""
        total: Array = self._stage_parameters(_joint(x, u), costates, phi).sum(axis=0)
        return total

    def _stage_parameters(self, z: Array, costates: Array, phi: Array, order: int = 1) -> Array:
        step, cost = self._of("step"), self._of("cost")

        def by_parameters(phi: Array) -> Array:
            # Kept separate, so that a large one does not swamp the small ones.
            return np.concatenate([cost(z, phi)[:, None], step(z, phi)], axis=1)

        found = self._by_parameters(by_parameters, phi, order)
        total: Array = found[:, 0] + np.einsum("bk,bkp->bp", costates, found[:, 1:])
        return total

    def final_parameters(self, x: Array, phi: Array) -> Array:
        """See the protocol."""
        final_cost = self._of("final_cost")
        total: Array = self._by_parameters(lambda phi: final_cost(x, phi), phi).sum(axis=0)
        return total

    def stage_parameters_along(
        self, x: Array, u: Array, costates: Array, dz: Array, dcostates: Array, phi: Array
    ) -> Array:
        """See the protocol."""
        z = _joint(x, u)

        def gradient(z: Array) -> Array:
            copies = len(z) // len(x)
            return self._stage_parameters(z, np.tile(costates, (copies, 1)), phi, 2)

        # Both functions are differentiated, so use the shorter of their lengths.
        lengths = np.minimum(self.lengths["step", 2], self.lengths["cost", 2])
        step, sizes = self._of("step"), _sizes(dz / lengths)
        moved = stencils.along(gradient, z, dz / sizes[:, None], relative_step(2))
        direct = self._by_parameters(lambda phi: step(z, phi), phi)
        total: Array = sizes @ moved + np.einsum("bk,bkp->p", dcostates, direct)
        return total

    def final_parameters_along(self, x: Array, dx: Array, phi: Array) -> Array:
        """See the protocol."""
        final_cost, sizes = self._of("final_cost"), _sizes(dx / self._lengths("final_cost", 2, x))

        def gradient(x: Array) -> Array:
            return self._by_parameters(lambda phi: final_cost(x, phi), phi, 2)

        total: Array = sizes @ stencils.along(gradient, x, dx / sizes[:, None], relative_step(2))
        return total


def _joint(x: Array, u: Array) -> Array:
    return np.concatenate([x, u], axis=1)


def _sizes(directions: Array) -> Array:
    """Length of each direction, 1 where it is 0: (B,)."""
    sizes: Array = np.linalg.norm(directions, axis=1)
    return np.where(sizes > 0.0, sizes, 1.0)
