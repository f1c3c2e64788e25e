"""The programs of a model of JAX at one point: functions and derivatives, before they are batched and compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np

from ..errors import UsageError
from .functions import Functions

__all__ = ["Programs", "refuse"]


Program = Callable[..., Any]


class Programs:
    """Programs by the names of the protocol's methods. Each takes ``z = (x, u)`` or ``x``, what else its method takes, and
    ``phi``, and gives a tuple of arrays."""

    def __init__(self, functions: Functions) -> None:
        self.functions = functions
        self.states = functions.states

    def at_point(self, name: str) -> Program:
        """The program of a method."""
        program: Program = getattr(self, f"_{name}")()
        return program

    def point(self, name: str) -> Callable[[Any, Any, Any], Any]:
        """A function at one point (x, u, phi), checked while JAX traces it."""
        import jax.numpy as jnp

        functions = self.functions
        shape = functions.shapes[name]

        def call(x: Any, u: Any, phi: Any) -> Any:
            found = functions.call(name, x, u, phi)
            value = jnp.stack([jnp.asarray(entry) for entry in found]) if isinstance(found, (list, tuple)) else found
            value = jnp.asarray(value)
            if value.shape != shape:
                raise UsageError(
                    f"`{name}` returned an array of the shape {value.shape}: written in JAX it is called for one point, and "
                    f"must return the shape {shape}"
                )
            return value if value.dtype == np.float64 else _widened(name, value)

        return call

    def _split(self, name: str) -> Program:
        """A function of ``z = (x, u)`` and phi."""
        point, n = self.point(name), self.states
        return lambda z, phi: point(z[:n], z[n:], phi)

    def _weighed(self, name: str, derivative: Program) -> Program:
        """The gradient of ``<adjoint, derivative of the function by z>`` by z and phi."""
        import jax
        import jax.numpy as jnp

        function = derivative(self._split(name))

        def call(z: Any, adjoint: Any, phi: Any) -> Any:
            return jax.grad(lambda z, phi: jnp.sum(adjoint * function(z, phi)), argnums=(0, 1))(z, phi)

        return call

    def _steps(self) -> Program:
        point = self._split("step")
        return lambda z, phi: (point(z, phi),)

    def _observations(self) -> Program:
        point = self._split("observe")
        return lambda x, phi: (point(x, phi),)

    def _stage_costs(self) -> Program:
        point = self._split("cost")
        return lambda z, phi: (point(z, phi),)

    def _final_costs(self) -> Program:
        point = self._split("final_cost")
        return lambda x, phi: (point(x, phi),)

    def _dynamics_jacobians(self) -> Program:
        import jax

        derivative = jax.jacfwd(self._split("step"))
        return lambda z, phi: (derivative(z, phi),)

    def _measurement_jacobians(self) -> Program:
        import jax

        derivative = jax.jacfwd(self._split("observe"))
        return lambda x, phi: (derivative(x, phi),)

    def _stage_quadratics(self) -> Program:
        return self._quadratics("cost")

    def _final_quadratics(self) -> Program:
        return self._quadratics("final_cost")

    def _quadratics(self, name: str) -> Program:
        import jax

        point = self._split(name)
        gradient, hessian = jax.grad(point), jax.hessian(point)
        return lambda z, phi: (hessian(z, phi), gradient(z, phi))

    def _dynamics_curvature(self) -> Program:
        import jax

        point = self._split("step")
        curvature = jax.hessian(lambda z, costate, phi: costate @ point(z, phi))
        return lambda z, costate, phi: (curvature(z, costate, phi),)

    def _contract_dynamics(self) -> Program:
        import jax

        return self._weighed("step", jax.jacfwd)

    def _contract_measurements(self) -> Program:
        import jax

        return self._weighed("observe", jax.jacfwd)

    def _contract_stage_costs(self) -> Program:
        import jax

        return self._weighed("cost", jax.hessian)

    def _contract_final_costs(self) -> Program:
        import jax

        return self._weighed("final_cost", jax.hessian)

    def _lagrangian(self) -> Program:
        step, cost = self._split("step"), self._split("cost")
        return lambda z, costate, phi: cost(z, phi) + costate @ step(z, phi)

    def _stage_parameters(self) -> Program:
        import jax

        gradient = jax.grad(self._lagrangian(), argnums=2)
        return lambda z, costate, phi: (gradient(z, costate, phi),)

    def _final_parameters(self) -> Program:
        import jax

        gradient = jax.grad(self._split("final_cost"), argnums=1)
        return lambda x, phi: (gradient(x, phi),)

    def _stage_parameters_along(self) -> Program:
        import jax

        gradient = jax.grad(self._lagrangian(), argnums=2)

        def call(z: Any, costate: Any, dz: Any, dcostate: Any, phi: Any) -> Any:
            return (jax.jvp(lambda z, costate: gradient(z, costate, phi), (z, costate), (dz, dcostate))[1],)

        return call

    def _final_parameters_along(self) -> Program:
        import jax

        gradient = jax.grad(self._split("final_cost"), argnums=1)
        return lambda x, dx, phi: (jax.jvp(lambda x: gradient(x, phi), (x,), (dx,))[1],)

    def roll_out(self, closed: bool) -> Program:
        """The roll-out of a control law, or of controls as they are."""
        import jax
        import jax.numpy as jnp

        step, cost, final_cost = self.point("step"), self.point("cost"), self.point("final_cost")

        def call(start: Any, controls: Any, feedback: Any, reference: Any, lower: Any, upper: Any, phi: Any) -> Any:
            def advance(x: Any, given: Any) -> Any:
                u, gain, xbar = given
                if closed:
                    u = u + gain @ (x - xbar)
                u = jnp.clip(u, lower, upper)
                return step(x, u, phi), (x, u)

            end, (x, u) = jax.lax.scan(advance, start, (controls, feedback, reference))
            costs = jax.vmap(cost, in_axes=(0, 0, None))(x, u, phi)
            return jnp.concatenate([x, end[None]]), u, jnp.sum(costs) + final_cost(end, None, phi)

        return jax.jit(call)


def _widened(name: str, value: Any) -> Any:
    """Whole numbers as float64; less exact ones are refused."""
    if np.issubdtype(value.dtype, np.integer) or value.dtype == np.bool_:
        return value.astype(np.float64)
    refuse(name, str(value.dtype))


def refuse(name: str, dtype: str) -> NoReturn:
    """Refuses a function that computes in less than float64."""
    raise UsageError(
        f"`{name}` computes in {dtype}: it must compute in float64 throughout. Put jax.config.update("
        '"jax_enable_x64", True) before everything else, so that arrays which the function uses are made in float64, and '
        "take conversions such as .astype(jnp.float32) out"
    )
