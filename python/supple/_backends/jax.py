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
from .jax_programs import Programs, refuse
from .jumps import inner, jumps, misses_jumps

__all__ = ["JaxBackend", "Untraceable", "double_precision"]


#: What to do about functions whose values jump.
ADVICE = (
    "Replace rounding by noise, with a variance of a twelfth of the squared resolution, and `sign` by a steep `tanh`"
)


class Untraceable(UsageError):
    """A function that JAX cannot trace: it is written for NumPy, or wrong."""


@contextmanager
def double_precision() -> Iterator[None]:
    """Enables float64 in JAX temporarily, on this thread only: the user's settings are not changed."""
    import jax

    if hasattr(jax, "enable_x64"):
        context = jax.enable_x64(True)
    else:
        from jax import experimental

        context = getattr(experimental, "enable_x64")()  # noqa: B009
    with context:
        yield


def padded(count: int) -> int:
    """The padded batch size for a number of points: few sizes, so that few programs are compiled; the same on every machine.

    Samples run in step with one another by 32 or less; few points take as long as 32.
    """
    return 32 if count <= 32 else -(-count // 64) * 64


class JaxBackend:
    """A :class:`~supple._backends.protocol.Backend` of functions of single points.

    Each method is one compiled program, called once for a whole batch. Batches are padded to few sizes, by their last
    point, so that each program is compiled for few of them.

    Raises:
        Untraceable: Where JAX cannot trace a function.
        UsageError: Where a function returns another shape, or computes in another precision than float64.
    """

    #: Forked processes cannot call it.
    calls_jax = True

    def __init__(self, functions: Functions) -> None:
        self.functions = functions
        self.states = functions.states
        self.controls = functions.controls
        self.measurements = functions.measurements
        self.programs = Programs(functions)
        self._compiled: dict[str, Callable[..., Any]] = {}
        self._sizes: set[tuple[str, int]] = set()
        self._lock = threading.Lock()
        self._jumps: dict[str, list[str]] = {}
        for name in functions.shapes:
            self._check(name)

    def source(self) -> str:
        """The code of the functions, which says what the model is."""
        return f"{type(self).__name__}\n{self.functions.source()}"

    def __reduce__(self) -> tuple[Any, ...]:
        return JaxBackend, (self.functions,)

    @property
    def compilations(self) -> int:
        """How many programs were compiled, each size of a batch counted."""
        return len(self._sizes)

    def _check(self, name: str) -> None:
        import jax

        functions = self.functions
        sizes = (functions.states, functions.controls, len(functions.parameters))
        with double_precision():
            point = [np.zeros(size) for size in sizes]
            try:
                jaxpr = jax.make_jaxpr(self.programs.point(name))(*point)
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
            refuse(name, coarse)
        self._jumps[name] = jumps(jaxpr.jaxpr)

    def doubts(self, x: Array, u: Array, phi: Array) -> list[str]:
        """What is wrong with derivatives near a point: they miss jumps of the functions."""
        with double_precision():
            return [
                f"derivatives of `{name}` miss its jumps ({', '.join(f'`{found}`' for found in self._jumps[name])}): cost and "
                f"information are not those of the model. {ADVICE}"
                for name in self.functions.shapes
                if self._jumps[name] and misses_jumps(self.programs.point(name), x, u, phi)
            ]

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
            program = self._compiled.get(name)
            if program is None:
                import jax

                point = self.programs.at_point(name)
                program = jax.jit(jax.vmap(point, in_axes=(*[0] * batches, None)))
                self._compiled[name] = program
        return program

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
            program = self._compiled.get(key)
            if program is None:
                program = self._compiled[key] = self.programs.roll_out(closed)
        with double_precision():
            x, u, cost = program(start, controls, feedback, reference, lower, upper, phi)
            return np.asarray(x).reshape(steps + 1, n), np.asarray(u), float(cost)

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


def _coarse(jaxpr: Any) -> Iterator[str]:
    """Types of less than 64 bits that occur in what JAX traced, inner functions included."""
    for part in inner(jaxpr):
        held = [*part.constvars, *(out for equation in part.eqns for out in equation.outvars)]
        held += [given for equation in part.eqns for given in equation.invars]
        for variable in held:
            dtype = getattr(variable.aval, "dtype", None)
            if str(dtype) in ("float32", "float16", "bfloat16", "complex64"):
                yield str(dtype)


def _first_line(error: Exception) -> str:
    return str(error).strip().split("\n")[0]
