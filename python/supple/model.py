"""Own models: functions of yours as the physics and the costs of a task."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from . import _description as describe
from ._backends import checks
from ._backends.differences import Differences
from ._backends.functions import Functions
from ._backends.given import Given, Overridden
from ._backends.lengths import differences_near, relative_errors
from ._description import Noise, Number, VaryingVariance, combine
from ._records import Array, Record
from .errors import UsageError
from .task import Parameter, Task

__all__ = ["DerivativeError", "Derivatives", "Model", "Noise", "VaryingVariance", "combine"]

LOGGER = logging.getLogger("supple")

Backend = Literal["auto", "recorded", "jax", "numpy"]

#: Names of the numbers of a vector, with their units where there are any; or how many there are.
Names = int | Sequence[str] | Mapping[str, str]


@dataclass(frozen=True)
class Derivatives:
    """Derivatives that you give in place of those that the package finds; what is left out it finds itself.

    Functions take batches of ``B`` points, as NumPy arrays of float64, and parameters by name. ``n`` states, ``m`` controls,
    ``p`` measurements, ``J = n + m``, ``z = (x, u)``, ``P`` parameters in the order of the model's; ``x`` is (B, n) and
    ``u`` is (B, m). They are compared with finite differences when a task is made.

    Attributes:
        dynamics_jacobians: ``(x, u, p)``: ``[f_x f_u]``, (B, n, J).
        measurement_jacobians: ``(x, p)``: ``g_x``, (B, p, n).
        stage_quadratics: ``(x, u, p)``: ``l_zz``, (B, J, J), and ``l_z``, (B, J).
        final_quadratics: ``(x, p)``: ``l_N,xx``, (B, n, n), and ``l_N,x``, (B, n).
        dynamics_curvature: ``(x, u, costates, p)``, costates (B, n): ``(costate' f)_zz``, (B, J, J).
        contract_dynamics: ``(x, u, adjoints, p)``, adjoints (B, n, J): the gradient of ``sum <adjoint, [f_x f_u]>`` by
            ``z``, (B, J), and by the parameters, (P,).
        contract_measurements: ``(x, adjoints, p)``, adjoints (B, p, n): that of ``sum <adjoint, g_x>``, (B, n), (P,).
        contract_stage_costs: ``(x, u, adjoints, p)``, adjoints (B, J, J): that of ``sum <adjoint, l_zz>``, (B, J), (P,).
        contract_final_costs: ``(x, adjoints, p)``, adjoints (B, n, n): that of ``sum <adjoint, l_N,xx>``, (B, n), (P,).
        stage_parameters: ``(x, u, costates, p)``: the gradient of ``sum l + costate' f`` by the parameters, (P,).
        final_parameters: ``(x, p)``: that of ``sum l_N``, (P,).
        stage_parameters_along: ``(x, u, costates, dz, dcostates, p)``: the derivative of ``stage_parameters`` along
            ``dz`` (B, J) and ``dcostates`` (B, n), (P,).
        final_parameters_along: ``(x, dx, p)``: that of ``final_parameters`` along ``dx`` (B, n), (P,).
    """

    dynamics_jacobians: Callable[..., Any] | None = None
    measurement_jacobians: Callable[..., Any] | None = None
    stage_quadratics: Callable[..., Any] | None = None
    final_quadratics: Callable[..., Any] | None = None
    dynamics_curvature: Callable[..., Any] | None = None
    contract_dynamics: Callable[..., Any] | None = None
    contract_measurements: Callable[..., Any] | None = None
    contract_stage_costs: Callable[..., Any] | None = None
    contract_final_costs: Callable[..., Any] | None = None
    stage_parameters: Callable[..., Any] | None = None
    final_parameters: Callable[..., Any] | None = None
    stage_parameters_along: Callable[..., Any] | None = None
    final_parameters_along: Callable[..., Any] | None = None

    def given(self) -> dict[str, Callable[..., Any]]:
        """Those that are given."""
        pairs = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: function for name, function in pairs if function is not None}


@dataclass(frozen=True, eq=False, repr=False)
class DerivativeError(Record):
    """Estimated relative errors of a model's derivatives: how far they change where all steps are halved, along the
    trajectory of the first guess and around it.

    Variables and functions count by how large they become there; errors are relative to the largest derivative, or to the
    function where that is larger. All 0 for functions of JAX, whose derivatives are exact but for rounding.

    Information and expected cost are as exact as the larger of ``first`` and ``second``, and total gradients as the largest
    of all three, times how much what they are made of cancels: most often within a factor of 100.

    Attributes:
        first: Of first derivatives.
        second: Of second derivatives.
        third: Of third derivatives of costs.
    """

    first: float
    second: float
    third: float


class Model:
    """A model of your own: how the state moves on, what is measured, and what it costs.

    Functions are written in JAX for one point, or in NumPy for batches of points:

    ``x``, the state, is (n,) or (B, n); ``u``, the controls, (m,) or (B, m); ``p`` holds the parameters by name, numbers,
    ``p["k1"]`` or ``p.k1``. They return arrays of (n,) or (B, n) and of (p,) or (B, p); costs a number or (B,).

    Functions must depend on their arguments only, and be twice differentiable, costs three times, where plans go.

    Args:
        step: ``f(x, u, p)``, the state after one time step.
        observe: ``g(x, p)``, what is measured.
        cost: ``l(x, u, p)``, the cost of a step.
        final_cost: ``l_N(x, p)``, the cost of the end; none where left out.
        parameters: Parameters by name.
        states: Names of the states, with their units in a dict; or how many there are.
        controls: The same of the controls.
        measurements: The same of the measurements.
        backend: Where derivatives come from. ``recorded``: functions of JAX are written out once as plain arithmetic that the
            engine differentiates and compiles itself: the fastest. ``jax``: JAX differentiates and compiles them.
            ``numpy``: finite differences of functions of batches. ``auto``: the first of these that takes the functions.
        derivatives: Derivatives that you give.

    Raises:
        UsageError: Where functions or names are of the wrong type, or return something else than they should.
    """

    def __init__(
        self,
        *,
        step: Callable[..., Any],
        observe: Callable[..., Any],
        cost: Callable[..., Any],
        final_cost: Callable[..., Any] | None = None,
        parameters: Mapping[str, Parameter],
        states: Names,
        controls: Names,
        measurements: Names,
        backend: Backend = "auto",
        derivatives: Derivatives | None = None,
    ) -> None:
        if backend not in ("auto", "recorded", "jax", "numpy"):
            raise UsageError(f'backend={backend!r}: there is "auto", "recorded", "jax" and "numpy"')
        self._parameters = describe.parameters(parameters)
        self._channels = {
            "states": describe.names("states", states, "x"),
            "controls": describe.names("controls", controls, "u"),
            "measurements": describe.names("measurements", measurements, "y"),
        }
        written: dict[str, Callable[..., Any]] = {
            "step": step,
            "observe": observe,
            "cost": cost,
            "final_cost": final_cost or _no_cost,
        }
        for name, function in written.items():
            if not callable(function):
                raise UsageError(f"{name}={function!r} is no function")
        n, m, p = (len(channels) for channels in self._channels.values())
        self._functions = Functions(
            step=step,
            observe=observe,
            cost=cost,
            final_cost=written["final_cost"],
            states=n,
            controls=m,
            measurements=p,
            parameters=tuple(self._parameters),
        )
        self._given = None if derivatives is None else Given(derivatives.given(), self._functions)
        if backend == "recorded" and self._given is not None:
            raise UsageError(
                'backend="recorded" finds all derivatives itself: leave `derivatives` out, or take backend="jax"'
            )
        self._wanted = backend
        self._why_not_jax = ""
        self._jax = self._traced(backend)

    def _traced(self, backend: Backend) -> Any:
        """The functions in JAX; none where they are not written in it."""
        # Functions of JAX come from a module that has imported it.
        if backend == "numpy" or backend == "auto" and "jax" not in sys.modules:
            return None
        try:
            import jax  # noqa: F401
        except ImportError as error:
            raise UsageError(f'backend="{backend}" needs JAX: pip install jax') from error
        from ._backends.jax import JaxBackend, Untraceable

        try:
            return JaxBackend(self._functions)
        except Untraceable as error:
            if backend != "auto":
                raise
            LOGGER.info("functions are taken for NumPy's: %s", error)
            self._why_not_jax = str(error)
            return None

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Parameters by name."""
        return dict(self._parameters)

    def task(
        self,
        *,
        steps: int,
        time_step: Number,
        initial_state: Sequence[Number],
        initial_control: Sequence[Number] | Sequence[Sequence[Number]] | ArrayLike,
        noise: Noise,
        bound: Number | None = None,
        name: str = "task",
        title: str = "",
        information_weight: float = 1.0,
        control_bounds: Sequence[tuple[float, float]] | None = None,
        planning: Mapping[str, Any] | None = None,
        design: Mapping[str, Any] | None = None,
    ) -> Task:
        """A task for this model. Numbers may be names of parameters in their place.

        Args:
            steps: How many steps it lasts, N.
            time_step: Length of a step, s. The model's ``step`` is not told: it is what rates of information refer to.
            initial_state: Mean of the first state, (n,).
            initial_control: First guess of the controls: (m,) for all steps, or (N, m).
            noise: Covariances of first state, process and measurement.
            bound: What the expected cost may be at most.
            name: Its name.
            title: What it is, for people.
            information_weight: Weight of its information in the objective.
            control_bounds: Least and greatest value of each control; plus or minus infinity for none.
            planning: Settings of the planning by the names of the task file's ``[planning]``.
            design: Settings of the search by the names of the task file's ``[design]``.

        Raises:
            UsageError: Where a number or shape is wrong, and where the functions do not do what they should at the first
                state: wrong shapes, not float64, not finite, not the same twice, not one point at a time.
        """
        if isinstance(steps, bool) or not isinstance(steps, (int, np.integer)) or steps < 1:
            raise UsageError(f"steps={steps!r}: a whole number of at least 1")
        rows = describe.control_rows(initial_control)
        near = self._near(initial_state, rows, int(steps))
        described = {
            "name": name,
            "steps": int(steps),
            "time_step": time_step,
            "bound": bound,
            "information_weight": information_weight,
            "initial_state": describe.numbers(initial_state),
            "initial_control": rows,
            "control_bounds": describe.bounds(control_bounds),
            **noise.describe(),
        }
        plain = {
            "title": title,
            "parameters": describe.declared(self._parameters),
            "tasks": [described],
            "planning": dict(planning or {}),
        }

        def made(system: dict[str, Any], error: DerivativeError) -> Task:
            # Roll-outs would call functions in Python some hundred thousand times: they are made where they are asked for.
            unasked = {"rollouts": 0} if system["kind"] == "callback" else {}
            text = json.dumps({**plain, "design": {**unasked, **(design or {})}})
            return describe.made({"plain": text, "systems": [system], "derivative_error": error})

        system, error = self._system(near, time_step)
        try:
            return made(system, error)
        except UsageError as why:
            if self._wanted != "auto" or system["kind"] != "recorded":
                raise
            # What is wrong with the task itself is said of the functions called in JAX as well.
            LOGGER.info("functions are called in JAX, because the engine does not take their record: %s", why)
            return made(*self._called(near))

    def _near(self, state: Any, rows: list[list[Number]], steps: int) -> tuple[Array, Array, Array]:
        """The first state (n,), guess of the controls (N, m) and parameters (P,) as numbers."""
        resolve = describe.resolver(self._parameters)
        x = resolve("initial_state", state, (len(self._channels["states"]),))
        guess = resolve("initial_control", rows, (len(rows), len(self._channels["controls"])))
        phi = np.array([float(parameter.initial) for parameter in self._parameters.values()])
        controls = np.broadcast_to(guess, (steps, guess.shape[1])) if len(rows) == 1 else guess
        return x, np.ascontiguousarray(controls), phi

    def _system(self, near: tuple[Array, Array, Array], time_step: Number) -> tuple[dict[str, Any], DerivativeError]:
        """The system of a task that starts at a state with these controls, (N, m), and the error of its derivatives."""
        x, controls, phi = near
        exact = DerivativeError(0.0, 0.0, 0.0)
        if self._jax is None:
            return self._by_differences(x, controls, phi)
        checks.check_single(self._functions, x, controls[0], phi)
        if self._wanted == "recorded" or self._wanted == "auto" and self._given is None:
            from ._jaxpr import Mistranslated, Untranslatable

            try:
                return _record(self, (x, controls[0], phi), time_step), exact
            except (Mistranslated, Untranslatable) as why:
                if self._wanted == "recorded":
                    raise UsageError(f'backend="recorded": {why}. Or take backend="jax"') from why
                LOGGER.info("functions are called in JAX, and not recorded: %s", why)
        return self._called(near)

    def _called(self, near: tuple[Array, Array, Array]) -> tuple[dict[str, Any], DerivativeError]:
        """The system of functions that are called in JAX, whose derivatives are exact."""
        x, controls, phi = near
        checks.check_guess(self._jax, x, controls, phi)
        return self._described(self._overridden(self._jax, self._jax, near)), DerivativeError(0.0, 0.0, 0.0)

    def _by_differences(self, x: Array, controls: Array, phi: Array) -> tuple[dict[str, Any], DerivativeError]:
        functions = self._functions
        try:
            checks.check_batches(functions, x, controls[0], phi)
        except Exception as error:
            if self._why_not_jax and not isinstance(error, UsageError):
                raise UsageError(
                    f"the functions run neither in JAX nor for batches of NumPy's. In JAX: {self._why_not_jax}. In NumPy: "
                    f"{type(error).__name__}: {error}"
                ) from error
            raise
        plain = differences_near(functions, None, x[None], controls[:1], phi, self._spans())
        checks.check_guess(plain, x, controls, phi)
        states, taken, _ = plain.roll_out(x, controls, None, None, None, phi)
        plain = differences_near(functions, None, states[:-1], taken, phi, self._spans())
        found = Differences(functions, self._given, plain.lengths, plain.scales)
        described = self._described(self._overridden(found, plain, (x, controls, phi)))
        estimate = DerivativeError(*relative_errors(found, states[:-1], taken, phi))
        LOGGER.info(
            "derivatives by finite differences: relative errors %.1e (first), %.1e (second), %.1e (third)",
            estimate.first,
            estimate.second,
            estimate.third,
        )
        return described, estimate

    def _overridden(self, backend: Any, plain: Any, near: tuple[Array, Array, Array]) -> Any:
        """A backend with the derivatives that are given, once they agree with those of another."""
        if self._given is None:
            return backend
        x, controls, phi = near
        checks.check_given(self._given, plain, x, controls[0], phi)
        return Overridden(backend, self._given)

    def _spans(self) -> Array:
        """How far parameters may go: relative to their values where they move by ratios."""
        spans = [
            -0.5 if parameter.scale == "log" else 0.5 * (parameter.bounds[1] - parameter.bounds[0])
            for parameter in self._parameters.values()
        ]
        return np.array(spans, dtype=np.float64)

    def _described(self, backend: Any) -> dict[str, Any]:
        system: dict[str, Any] = {"kind": "callback", "backend": backend}
        for what, key in (
            ("states", "state_units"),
            ("controls", "control_units"),
            ("measurements", "measurement_units"),
        ):
            system[what] = list(self._channels[what])
            system[key] = list(self._channels[what].values())
        return system


def _no_cost(x: Any, p: Any) -> Any:
    """No final cost, for one point or for a batch."""
    return x[..., 0] * 0.0


def _record(model: Model, near: tuple[Array, Array, Array], time_step: Number) -> dict[str, Any]:
    """The system of a model of JAX as plain arithmetic, which the engine differentiates itself.

    Raises:
        Untranslatable: Where a function does something that cannot be written out.
        Mistranslated: Where what is written out gives other numbers.
    """
    from ._backends.recorded import record

    step, observe, cost, final_cost = (model._jax.programs.point(name) for name in model._functions.shapes)
    states, controls, measurements = (tuple(channels.items()) for channels in model._channels.values())
    return record(
        step,
        lambda x, phi: observe(x, None, phi),
        cost,
        lambda x, phi: final_cost(x, None, phi),
        near=near,
        channels=(states, controls, measurements),
        time_step=time_step,
    )
