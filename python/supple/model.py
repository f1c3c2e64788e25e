"""Custom models: user-supplied functions as the physics and the costs of a task."""

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

#: Names of the entries of a vector, with their units if any; or the number of entries.
Names = int | Sequence[str] | Mapping[str, str]


@dataclass(frozen=True)
class Derivatives:
    """User-supplied derivatives; the package computes those that are not given.

    Functions take batches of ``B`` points, as NumPy arrays of float64, and parameters by name. ``n`` states, ``m`` controls,
    ``p`` measurements, ``J = n + m``, ``z = (x, u)``, ``P`` parameters in the order of the model's; ``x`` is (B, n) and
    ``u`` is (B, m). They are compared with finite differences when a task is created.

    Attributes:
        dynamics_jacobians: ``(x, u, p)``: ``[f_x f_u]``, (B, n, J).
        measurement_jacobians: ``(x, p)``: ``g_x``, (B, p, n).
        stage_quadratics: ``(x, u, p)``: ``l_zz``, (B, J, J), and ``l_z``, (B, J).
        final_quadratics: ``(x, p)``: ``l_N,xx``, (B, n, n), and ``l_N,x``, (B, n).
        dynamics_curvature: ``(x, u, costates, p)``, costates (B, n): ``(costate' f)_zz``, (B, J, J).
        contract_dynamics: ``(x, u, adjoints, p)``, adjoints (B, n, J): the gradient of ``sum <adjoint, [f_x f_u]>``
            with respect to ``z``, (B, J), and to the parameters, (P,).
        contract_measurements: ``(x, adjoints, p)``, adjoints (B, p, n): the gradient of ``sum <adjoint, g_x>``, (B, n), (P,).
        contract_stage_costs: ``(x, u, adjoints, p)``, adjoints (B, J, J): the gradient of ``sum <adjoint, l_zz>``, (B, J), (P,).
        contract_final_costs: ``(x, adjoints, p)``, adjoints (B, n, n): the gradient of ``sum <adjoint, l_N,xx>``, (B, n), (P,).
        stage_parameters: ``(x, u, costates, p)``: the gradient of ``sum l + costate' f`` with respect to the parameters, (P,).
        final_parameters: ``(x, p)``: the gradient of ``sum l_N``, (P,).
        stage_parameters_along: ``(x, u, costates, dz, dcostates, p)``: the derivative of ``stage_parameters`` along
            ``dz`` (B, J) and ``dcostates`` (B, n), (P,).
        final_parameters_along: ``(x, dx, p)``: the derivative of ``final_parameters`` along ``dx`` (B, n), (P,).
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
        """The given derivatives."""
        pairs = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: function for name, function in pairs if function is not None}


@dataclass(frozen=True, eq=False, repr=False)
class DerivativeError(Record):
    """Estimated relative errors of a model's derivatives: their change when all steps are halved, along the trajectory of
    the initial guess and around it.

    Variables and functions are scaled by their largest values there; errors are relative to the largest derivative, or to the
    function if that is larger. All are 0 for JAX functions, whose derivatives are exact up to rounding.

    The error of information and expected cost is the larger of ``first`` and ``second``, and the error of total gradients the
    largest of all three, times the cancellation among their terms: usually within a factor of 100.

    Attributes:
        first: Error of first derivatives.
        second: Error of second derivatives.
        third: Error of third derivatives of costs.
    """

    first: float
    second: float
    third: float

    def _tolerance(self) -> float:
        """The default tolerance of plans: errors of derivatives hide smaller residuals, which sum over the steps."""
        return min(max(1e-12, 1e3 * self.first), 1e-9)


#: First derivatives with a greater relative error are worth a warning.
ROUGH = 1e-3


class Model:
    """A custom model: dynamics, measurements and costs.

    Functions are written in JAX for one point, or in NumPy for batches of points:

    ``x``, the state, is (n,) or (B, n); ``u``, the controls, (m,) or (B, m); ``p`` holds the parameters by name as
    numbers, ``p["k1"]`` or ``p.k1``. They return arrays of (n,) or (B, n) and of (p,) or (B, p); costs return a number or (B,).

    Functions must depend on their arguments only, and be twice differentiable (costs three times) wherever plans go.

    Args:
        step: ``f(x, u, p)``, the state after one time step.
        observe: ``g(x, p)``, the measurement.
        cost: ``l(x, u, p)``, the stage cost.
        final_cost: ``l_N(x, p)``, the final cost; default: none.
        parameters: Parameters by name; none by default.
        states: Names of the states, with their units in a dict; or their number.
        controls: The same for the controls.
        measurements: The same for the measurements.
        backend: Source of the derivatives. ``recorded``: JAX functions are converted once to plain arithmetic that the engine
            differentiates and compiles itself; this is the fastest. ``jax``: JAX differentiates and compiles them.
            ``numpy``: finite differences of batched functions. ``auto``: the first of these that accepts the functions.
        derivatives: User-supplied derivatives.

    Raises:
        UsageError: If functions or names are of the wrong type, or functions return something unexpected.
    """

    def __init__(
        self,
        *,
        step: Callable[..., Any],
        observe: Callable[..., Any],
        cost: Callable[..., Any],
        final_cost: Callable[..., Any] | None = None,
        parameters: Mapping[str, Parameter] | None = None,
        states: Names,
        controls: Names,
        measurements: Names,
        backend: Backend = "auto",
        derivatives: Derivatives | None = None,
    ) -> None:
        if backend not in ("auto", "recorded", "jax", "numpy"):
            raise UsageError(f'backend={backend!r}: must be "auto", "recorded", "jax" or "numpy"')
        self._parameters = describe.parameters({} if parameters is None else parameters)
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
                raise UsageError(f"{name}={function!r} is not a function")
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
        """The JAX functions; none if they are not written in JAX."""
        # JAX functions come from a module that has imported JAX.
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
        """Creates a task for this model. Names of parameters may replace numbers.

        Args:
            steps: Number of steps, N.
            time_step: Length of a step, s. It is not passed to the model's ``step``; it only defines information rates.
            initial_state: Mean of the initial state, (n,).
            initial_control: Initial guess of the controls: (m,) for all steps, or (N, m).
            noise: Covariances of initial state, process and measurement.
            bound: Cost limit: the greatest expected cost allowed.
            name: Its name.
            title: Description, for people.
            information_weight: Weight of its information in the objective.
            control_bounds: Lower and upper limit of each control; plus or minus infinity for none.
            planning: Settings of the planner, by the names in the task file's ``[planning]``.
            design: Settings of the search, by the names in the task file's ``[design]``.

        Raises:
            UsageError: If a number or shape is wrong, or if a function misbehaves at the initial state: wrong shape, not
                float64, not finite, different values on a second call, or points that affect one another.
        """
        if isinstance(steps, bool) or not isinstance(steps, (int, np.integer)) or steps < 1:
            raise UsageError(f"steps={steps!r}: a whole number of at least 1")
        describe.check_printable("name of the task", name)
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
        planner: dict[str, Any] = dict(planning or {})
        plain = {
            "title": title,
            "parameters": describe.declared(self._parameters),
            "tasks": [described],
            "planning": planner,
        }
        is_default = "tolerance" not in planner

        def made(system: dict[str, Any], error: DerivativeError) -> Task:
            described["doubtful_derivatives"] = [f"task `{name}`: {doubt}" for doubt in self._doubts(near, error)]
            for doubt in described["doubtful_derivatives"]:
                LOGGER.warning("%s", doubt)
            # Roll-outs would call Python functions some hundred thousand times: they are made only on request.
            unasked = {"rollouts": 0} if system["kind"] == "callback" else {}
            if is_default and error.first > 0.0:
                planner["tolerance"] = error._tolerance()
            text = json.dumps({**plain, "design": {**unasked, **(design or {})}})
            task = describe.made({"plain": text, "systems": [system], "derivative_error": error})
            for warning in task.warnings:
                LOGGER.warning("%s", warning)
            return task

        system, error = self._system(near, time_step)
        try:
            return made(system, error)
        except UsageError as why:
            if self._wanted != "auto" or system["kind"] != "recorded":
                raise
            # Errors of the task itself are also reported for functions called in JAX.
            LOGGER.info("functions are called in JAX, because the engine does not take their record: %s", why)
            return made(*self._called(near))

    def _near(self, state: Any, rows: list[list[Number]], steps: int) -> tuple[Array, Array, Array]:
        """The initial state (n,), initial guess of the controls (N, m) and parameters (P,) as numbers."""
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
        """The system of functions that JAX evaluates, with exact derivatives."""
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

    def _doubts(self, near: tuple[Array, Array, Array], error: DerivativeError) -> list[str]:
        """Why no result of a task that starts there can be trusted."""
        x, controls, phi = near
        doubts = [] if self._jax is None else self._jax.doubts(x, controls[0], phi)
        if not error.first <= ROUGH:
            doubts.append(
                f"derivatives by finite differences have a relative error of {error.first:.1e}: results cannot be trusted. "
                "Functions that are rounded, look up tables or integrate with a coarse tolerance have no smooth derivatives"
            )
        return doubts

    def _overridden(self, backend: Any, plain: Any, near: tuple[Array, Array, Array]) -> Any:
        """A backend with the given derivatives, once they agree with those of another backend."""
        if self._given is None:
            return backend
        x, controls, phi = near
        checks.check_given(self._given, plain, x, controls[0], phi)
        return Overridden(backend, self._given)

    def _spans(self) -> Array:
        """Ranges of the parameters: relative to their values if they vary by ratios."""
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
    """The system of a JAX model as plain arithmetic, which the engine differentiates itself.

    Raises:
        Untranslatable: If a function uses an operation that cannot be converted.
        Mistranslated: If the converted function gives other numbers.
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
