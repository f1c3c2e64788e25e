"""Functions written in JAX for one point: differentiated, batched over points and compiled by JAX, in float64."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from .._records import Array
from ..errors import UsageError
from .functions import Functions

__all__ = ["JaxBackend", "Untraceable", "double_precision"]

#: Steps of a roll-out that are compiled as one.
UNROLLED = 5


class Untraceable(UsageError):
    """A function that JAX cannot trace: it is written for NumPy, or wrong."""


@contextmanager
def double_precision() -> Iterator[None]:
    """JAX in float64, on this thread and for a while: settings of the user's stay as they are."""
    import jax

    if hasattr(jax, "enable_x64"):
        context = jax.enable_x64(True)
    else:
        from jax import experimental

        context = getattr(experimental, "enable_x64")()  # noqa: B009
    with context:
        yield


def padded(count: int) -> int:
    """How many points are computed for so many: few sizes, so that little is compiled; the same on every machine."""
    if count <= 64:
        return max(1, 1 << (count - 1).bit_length())
    return -(-count // 64) * 64


class JaxBackend:
    """A :class:`~supple._backends.protocol.Backend` of functions of single points.

    Each method is one compiled program, called once for a whole batch. Batches are padded to few sizes, by their last
    point, so that each program is compiled for few of them.

    Raises:
        Untraceable: Where JAX cannot trace a function.
        UsageError: Where a function returns another shape, or computes in another precision than float64.
    """

    def __init__(self, functions: Functions) -> None:
        self.functions = functions
        self.states = functions.states
        self.controls = functions.controls
        self.measurements = functions.measurements
        self._start()
        for name in functions.shapes:
            self._check(name)

    def _start(self) -> None:
        self._programs: dict[str, Callable[..., Any]] = {}
        self._sizes: set[tuple[str, int]] = set()
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[Any, ...]:
        return JaxBackend, (self.functions,)

    @property
    def compilations(self) -> int:
        """How many programs were compiled, each size of a batch counted."""
        return len(self._sizes)

    # What the user wrote.

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

    def _check(self, name: str) -> None:
        import jax

        functions = self.functions
        sizes = (functions.states, functions.controls, len(functions.parameters))
        with double_precision():
            point = [jax.ShapeDtypeStruct((size,), np.float64) for size in sizes]
            try:
                jaxpr = jax.make_jaxpr(self.point(name))(*point)
            except UsageError:
                raise
            except Exception as error:
                raise Untraceable(
                    f"`{name}` cannot be traced by JAX: {type(error).__name__}: {_first_line(error)}. Write it for one "
                    "point with jax.numpy, without conditions on numbers (jnp.where, jax.lax.cond); or for batches of "
                    'points with NumPy and backend="numpy"'
                ) from error
        coarse = next(_coarse(jaxpr.jaxpr), None)
        if coarse is not None:
            _refuse(name, coarse)

    # Programs.

    def _run(self, name: str, batches: tuple[Array, ...], phi: Array) -> list[Array]:
        """A program over a batch: arrays of (B, ...)."""
        count = len(batches[0])
        size = padded(count)
        if size > count:
            batches = tuple(np.concatenate([array, np.repeat(array[-1:], size - count, axis=0)]) for array in batches)
        with double_precision():
            found = self._program(name, len(batches), size)(*batches, phi)
            return [np.asarray(array)[:count] for array in found]

    def _program(self, name: str, batches: int, size: int) -> Callable[..., Any]:
        with self._lock:
            self._sizes.add((name, size))
            program = self._programs.get(name)
            if program is None:
                import jax

                point = getattr(self, f"_{name}")()
                program = jax.jit(jax.vmap(point, in_axes=(*[0] * batches, None)))
                self._programs[name] = program
        return program

    def _split(self, name: str) -> Callable[[Any, Any], Any]:
        """A function of ``z = (x, u)`` and phi."""
        point, n = self.point(name), self.states
        return lambda z, phi: point(z[:n], z[n:], phi)

    def _weighed(self, name: str, derivative: Callable[..., Any]) -> Callable[..., Any]:
        """The gradient of ``<adjoint, derivative of the function by z>`` by z and phi."""
        import jax
        import jax.numpy as jnp

        function = derivative(self._split(name))

        def call(z: Any, adjoint: Any, phi: Any) -> Any:
            return jax.grad(lambda z, phi: jnp.sum(adjoint * function(z, phi)), argnums=(0, 1))(z, phi)

        return call

    def _steps(self) -> Callable[..., Any]:
        point = self._split("step")
        return lambda z, phi: (point(z, phi),)

    def _observations(self) -> Callable[..., Any]:
        point = self._split("observe")
        return lambda x, phi: (point(x, phi),)

    def _stage_costs(self) -> Callable[..., Any]:
        point = self._split("cost")
        return lambda z, phi: (point(z, phi),)

    def _final_costs(self) -> Callable[..., Any]:
        point = self._split("final_cost")
        return lambda x, phi: (point(x, phi),)

    def _dynamics_jacobians(self) -> Callable[..., Any]:
        import jax

        derivative = jax.jacfwd(self._split("step"))
        return lambda z, phi: (derivative(z, phi),)

    def _measurement_jacobians(self) -> Callable[..., Any]:
        import jax

        derivative = jax.jacfwd(self._split("observe"))
        return lambda x, phi: (derivative(x, phi),)

    def _stage_quadratics(self) -> Callable[..., Any]:
        return self._quadratics("cost")

    def _final_quadratics(self) -> Callable[..., Any]:
        return self._quadratics("final_cost")

    def _quadratics(self, name: str) -> Callable[..., Any]:
        import jax

        point = self._split(name)
        gradient, hessian = jax.grad(point), jax.hessian(point)
        return lambda z, phi: (hessian(z, phi), gradient(z, phi))

    def _dynamics_curvature(self) -> Callable[..., Any]:
        import jax

        point = self._split("step")
        curvature = jax.hessian(lambda z, costate, phi: costate @ point(z, phi))
        return lambda z, costate, phi: (curvature(z, costate, phi),)

    def _contract_dynamics(self) -> Callable[..., Any]:
        import jax

        return self._weighed("step", jax.jacfwd)

    def _contract_measurements(self) -> Callable[..., Any]:
        import jax

        return self._weighed("observe", jax.jacfwd)

    def _contract_stage_costs(self) -> Callable[..., Any]:
        import jax

        return self._weighed("cost", jax.hessian)

    def _contract_final_costs(self) -> Callable[..., Any]:
        import jax

        return self._weighed("final_cost", jax.hessian)

    def _lagrangian(self) -> Callable[[Any, Any, Any], Any]:
        step, cost = self._split("step"), self._split("cost")
        return lambda z, costate, phi: cost(z, phi) + costate @ step(z, phi)

    def _stage_parameters(self) -> Callable[..., Any]:
        import jax

        gradient = jax.grad(self._lagrangian(), argnums=2)
        return lambda z, costate, phi: (gradient(z, costate, phi),)

    def _final_parameters(self) -> Callable[..., Any]:
        import jax

        gradient = jax.grad(self._split("final_cost"), argnums=1)
        return lambda x, phi: (gradient(x, phi),)

    def _stage_parameters_along(self) -> Callable[..., Any]:
        import jax

        gradient = jax.grad(self._lagrangian(), argnums=2)

        def call(z: Any, costate: Any, dz: Any, dcostate: Any, phi: Any) -> Any:
            return (jax.jvp(lambda z, costate: gradient(z, costate, phi), (z, costate), (dz, dcostate))[1],)

        return call

    def _final_parameters_along(self) -> Callable[..., Any]:
        import jax

        gradient = jax.grad(self._split("final_cost"), argnums=1)
        return lambda x, dx, phi: (jax.jvp(lambda x: gradient(x, phi), (x,), (dx,))[1],)

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
        """See the protocol."""
        steps, n, m = len(controls), self.states, self.controls
        closed = feedback is not None and reference is not None
        if not closed:
            feedback, reference = np.zeros((steps, 0, 0)), np.zeros((steps, 0))
        lower, upper = bounds or (np.full(m, -np.inf), np.full(m, np.inf))
        key = f"roll_out {'closed' if closed else 'open'}"
        with self._lock:
            self._sizes.add((key, steps))
            program = self._programs.get(key)
            if program is None:
                program = self._programs[key] = self._roll_out(closed)
        with double_precision():
            x, u, cost = program(start, controls, feedback, reference, lower, upper, phi)
            return np.asarray(x).reshape(steps + 1, n), np.asarray(u), float(cost)

    def _roll_out(self, closed: bool) -> Callable[..., Any]:
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

            end, (x, u) = jax.lax.scan(advance, start, (controls, feedback, reference), unroll=UNROLLED)
            costs = jax.vmap(cost, in_axes=(0, 0, None))(x, u, phi)
            return jnp.concatenate([x, end[None]]), u, jnp.sum(costs) + final_cost(end, None, phi)

        return jax.jit(call)

    def steps(self, x: Array, u: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._run("steps", (_joint(x, u),), phi)[0]

    def observations(self, x: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._run("observations", (x,), phi)[0]

    def stage_costs(self, x: Array, u: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._run("stage_costs", (_joint(x, u),), phi)[0]

    def final_costs(self, x: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._run("final_costs", (x,), phi)[0]

    def dynamics_jacobians(self, x: Array, u: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._run("dynamics_jacobians", (_joint(x, u),), phi)[0]

    def measurement_jacobians(self, x: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._run("measurement_jacobians", (x,), phi)[0]

    def stage_quadratics(self, x: Array, u: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._pair("stage_quadratics", (_joint(x, u),), phi)

    def final_quadratics(self, x: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._pair("final_quadratics", (x,), phi)

    def dynamics_curvature(self, x: Array, u: Array, costates: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._run("dynamics_curvature", (_joint(x, u), costates), phi)[0]

    def contract_dynamics(self, x: Array, u: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._contraction("contract_dynamics", _joint(x, u), adjoints, phi)

    def contract_measurements(self, x: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._contraction("contract_measurements", x, adjoints, phi)

    def contract_stage_costs(self, x: Array, u: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._contraction("contract_stage_costs", _joint(x, u), adjoints, phi)

    def contract_final_costs(self, x: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        """See the protocol."""
        return self._contraction("contract_final_costs", x, adjoints, phi)

    def stage_parameters(self, x: Array, u: Array, costates: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._sum("stage_parameters", (_joint(x, u), costates), phi)

    def final_parameters(self, x: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._sum("final_parameters", (x,), phi)

    def stage_parameters_along(
        self, x: Array, u: Array, costates: Array, dz: Array, dcostates: Array, phi: Array
    ) -> Array:
        """See the protocol."""
        return self._sum("stage_parameters_along", (_joint(x, u), costates, dz, dcostates), phi)

    def final_parameters_along(self, x: Array, dx: Array, phi: Array) -> Array:
        """See the protocol."""
        return self._sum("final_parameters_along", (x, dx), phi)

    def _pair(self, name: str, batches: tuple[Array, ...], phi: Array) -> tuple[Array, Array]:
        first, second = self._run(name, batches, phi)
        return first, second

    def _contraction(self, name: str, z: Array, adjoints: Array, phi: Array) -> tuple[Array, Array]:
        by_point, by_parameter = self._run(name, (z, adjoints), phi)
        return by_point, by_parameter.sum(axis=0)

    def _sum(self, name: str, batches: tuple[Array, ...], phi: Array) -> Array:
        total: Array = self._run(name, batches, phi)[0].sum(axis=0)
        return total


def _joint(x: Array, u: Array) -> Array:
    return np.concatenate([x, u], axis=1)


def _widened(name: str, value: Any) -> Any:
    """Whole numbers as float64; less exact ones are refused."""
    if np.issubdtype(value.dtype, np.integer) or value.dtype == np.bool_:
        return value.astype(np.float64)
    _refuse(name, str(value.dtype))


def _refuse(name: str, dtype: str) -> None:
    raise UsageError(
        f"`{name}` computes in {dtype}: it must compute in float64 throughout. Put jax.config.update("
        '"jax_enable_x64", True) before everything else, so that arrays which the function uses are made in float64, and '
        "take conversions such as .astype(jnp.float32) out"
    )


def _coarse(jaxpr: Any) -> Iterator[str]:
    """Types of less than 64 bits that occur in what JAX traced, inner functions included."""
    held = [*jaxpr.constvars, *(out for equation in jaxpr.eqns for out in equation.outvars)]
    held += [given for equation in jaxpr.eqns for given in equation.invars]
    for variable in held:
        dtype = getattr(variable.aval, "dtype", None)
        if str(dtype) in ("float32", "float16", "bfloat16", "complex64"):
            yield str(dtype)
    for equation in jaxpr.eqns:
        for value in equation.params.values():
            for inner in value if isinstance(value, (list, tuple)) else [value]:
                inner = getattr(inner, "jaxpr", inner)
                if hasattr(inner, "eqns"):
                    yield from _coarse(inner)


def _first_line(error: Exception) -> str:
    return str(error).strip().split("\n")[0]
