"""MuJoCo models: dynamics by ``mj_step``, derivatives by ``mjd_transitionFD`` and finite differences.

For example::

    model = supple.mujoco.Model(
        "arm.xml",
        sensors=["q.shoulder", "tip"],
        parameters={"wrist_kp": ("jnt_stiffness", "wrist")},
        cost=supple.mujoco.quadratic(sensors={"tip": (10.0, [0.3, 0.0, 0.2])}, controls={"*": 1e-3}),
    )
    task = model.task(steps=100, noise=supple.Noise(initial={"*": 1e-4}, process={"v.*": 1e-4}, measurement=1e-4))

These tasks are used like any others.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

try:
    import mujoco
except ImportError as error:
    raise ImportError("supple.mujoco needs MuJoCo: pip install mujoco") from error

from . import model as own
from ._asked import changed
from ._backends.lengths import relative_errors
from ._description import Noise, Number, VaryingVariance
from ._mujoco import fields, names, reading
from ._mujoco.backend import MujocoBackend
from ._mujoco.costs import Cost, FunctionCost, Quadratic, QuadraticCost, Term
from ._mujoco.fields import Field
from ._mujoco.names import Channel
from ._mujoco.simulator import Simulator
from ._mujoco.validation import ENDS_WELL, VARY, validate
from ._records import Array
from .errors import UsageError
from .reports import TaskReport
from .task import Parameter, Task

__all__ = ["ENDS_WELL", "VARY", "Field", "Model", "gradient_error", "quadratic", "validate"]

CostFunction = Callable[..., Any]


def quadratic(
    *,
    states: Mapping[str, Term] | None = None,
    sensors: Mapping[str, Term] | None = None,
    controls: Mapping[str, Term] | float | None = None,
    final_states: Mapping[str, Term] | None = None,
    final_sensors: Mapping[str, Term] | None = None,
) -> Quadratic:
    """A cost of weighted squares, ``sum weight (value - target)^2``, with exact derivatives; through sensors, MuJoCo's.

    Each entry is a weight, with a target of 0, or ``(weight, target)`` with one target for all numbers or a list with one
    for each. Weights and targets may be names of parameters. Weights apply at every step; they are not multiplied by the
    time step.

    Args:
        states: By name or pattern: ``{"q.wrist": (5.0, 0.3), "v.*": 0.1}``.
        sensors: By names of MuJoCo sensors; they do not have to be measured.
        controls: By names of actuators or patterns; one number is the weight of all.
        final_states: States of the final cost; default: ``states``.
        final_sensors: The same for ``sensors``.
    """
    every = {"*": float(controls)} if isinstance(controls, (int, float)) else dict(controls or {})
    return Quadratic(dict(states or {}), dict(sensors or {}), every, final_states, final_sensors)


class Model:
    """A MuJoCo model with chosen controls, measurements, parameters and costs.

    The given model is copied and never changed. In the copy the constraint solver runs until it has converged to
    ``tolerance``, controls are not clamped to their range (plans respect it instead, see :meth:`task`), and diverging states
    are not reset. The noise that MuJoCo declares for sensors is not simulated; see ``sensor_variances``.

    Its state consists of coordinates, velocities and activations: ``q.JOINT``, ``v.JOINT``, ``a.ACTUATOR``. Orientations of
    ball and free joints are rotation vectors (3,) relative to the initial state, ``q.JOINT.rx`` to ``.rz``, rad, which must stay
    below a full turn; their velocities are in the body's own axes, as in MuJoCo.

    Args:
        model: An ``MjModel``, or the path of an MJCF, MJB or URDF file.
        actuators: Names or patterns of the controlled actuators; default: all. Others keep the keyframe's control.
        sensors: The measurements: names of MuJoCo sensors of positions and velocities, and names or patterns of states;
            default: all sensors, or all positions if the model has none.
        parameters: By name, the field that each sets: ``("jnt_stiffness", "wrist")``, ``("actuator_gainprm", "servo", 0)``, a
            :class:`Field`, or a list of these for several numbers at once; then, as last entry of the tuple, a
            :class:`supple.Parameter`, or a dict with some of ``initial``, ``bounds``, ``scale``, ``unit`` and ``role``. The
            default initial value is the model's, with bounds of a tenth and ten times of it.
        cost: :func:`quadratic`, or a function ``cost(x, u, p)`` of batches: (B, n), (B, m) and parameters by name to (B,),
            for every step.
        final_cost: ``final_cost(x, p)`` to (B,); default: that of :func:`quadratic` if ``cost`` is one, otherwise 0.
        keyframe: Name or number of the keyframe with the initial state and controls; default: ``qpos0`` at rest.
        substeps: MuJoCo steps in each time step.
        eps: Step size of finite differences for first derivatives, the same in all coordinates.
        order: Their order: 2 is ``mjd_transitionFD``, centred, at ``eps``; 4 extrapolates from ``eps`` and ``2 eps``.
        curvature_eps: Step size of finite differences for second derivatives of the dynamics; they are of order 4.
        tolerance: Tolerance of MuJoCo's constraint solver, if the model's is larger.
        threads: MuJoCo threads in one call; default: all cores.

    Raises:
        UsageError: If a name is unknown, or an argument has the wrong type.
        FileError: If MuJoCo cannot read the file.
    """

    def __init__(
        self,
        model: mujoco.MjModel | str | os.PathLike[str],
        *,
        actuators: Iterable[str] | None = None,
        sensors: Iterable[str] | None = None,
        parameters: Mapping[str, Any] | None = None,
        cost: Quadratic | CostFunction,
        final_cost: CostFunction | None = None,
        keyframe: str | int | None = None,
        substeps: int = 1,
        eps: float = 1e-4,
        order: int = 4,
        curvature_eps: float = 2e-3,
        tolerance: float = 1e-14,
        threads: int | None = None,
    ) -> None:
        self._mjmodel = reading.read(model)
        reading.check(
            substeps=substeps, eps=eps, order=order, curvature_eps=curvature_eps, tolerance=tolerance, threads=threads
        )
        read = {name: fields.read(self._mjmodel, name, given) for name, given in (parameters or {}).items()}
        self._parameters = {name: parameter for name, (_, parameter) in read.items()}
        self._controls, places = names.controls(self._mjmodel, actuators)
        self._states = names.states(self._mjmodel)
        self._outputs = names.outputs(self._mjmodel, sensors)
        if not len(self._outputs):
            raise UsageError("sensors: nothing is measured; choose sensors of the model, or states such as `q.JOINT`")
        start = reading.keyframe(self._mjmodel, keyframe)
        simulator = Simulator(
            self._mjmodel,
            places,
            [targets for targets, _ in read.values()],
            reference=start.qpos,
            held=start.ctrl,
            substeps=substeps,
            eps=eps,
            order=order,
            tolerance=tolerance,
            threads=threads,
        )
        nv = simulator.nv
        self._start = np.concatenate(
            [simulator.chart.coordinates(start.qpos[None], np.zeros((1, nv)))[0], start.qvel, start.act]
        )
        self._start_control = np.array(start.ctrl[places])
        stage, final = self._costs(simulator, cost, final_cost)
        moves = [reading.move(parameter) for parameter in self._parameters.values()]
        self._backend = MujocoBackend(simulator, self._outputs, stage, final, np.array(moves), curvature_eps)
        self._ranges = reading.ranges(self._mjmodel, places)
        self._time_step = float(self._mjmodel.opt.timestep) * substeps
        self._engine = _Engine(self._backend, self._parameters, (self._states, self._controls, self._outputs.channels))

    def _costs(
        self, simulator: Simulator, cost: Quadratic | CostFunction, final: CostFunction | None
    ) -> tuple[Cost, Cost]:
        parameters = list(self._parameters)
        n = simulator.states
        last: Cost
        if isinstance(cost, Quadratic):
            sensed = {**cost.sensors, **(cost.final_sensors or {})}
            outputs = names.outputs(self._mjmodel, list(sensed))
            direct = [(self.states, cost.states), (self.controls, cost.controls)]
            stage: Cost = QuadraticCost(simulator, direct, outputs, cost.sensors, parameters)
            ends = cost.states if cost.final_states is None else cost.final_states
            end_sensors = cost.sensors if cost.final_sensors is None else cost.final_sensors
            last = QuadraticCost(simulator, [(self.states, ends)], outputs, end_sensors, parameters)
        elif callable(cost):
            stage = FunctionCost("cost", cost, n, parameters)
            last = QuadraticCost(simulator, [(self.states, {})], names.outputs(self._mjmodel, []), {}, parameters)
        else:
            raise UsageError(
                f"cost is a {type(cost).__name__}: it must be supple.mujoco.quadratic(...) or a function (x, u, p)"
            )
        if callable(final):
            last = FunctionCost("final_cost", final, n, parameters)
        elif final is not None:
            raise UsageError(f"final_cost is a {type(final).__name__}: it must be a function (x, p)")
        return stage, last

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Parameters by name."""
        return dict(self._parameters)

    @property
    def states(self) -> list[str]:
        """Names of the states, (n,)."""
        return [channel.name for channel in self._states]

    @property
    def controls(self) -> list[str]:
        """Names of the controls, (m,)."""
        return [channel.name for channel in self._controls]

    @property
    def measurements(self) -> list[str]:
        """Names of the measurements, (p,)."""
        return [channel.name for channel in self._outputs.channels]

    @property
    def time_step(self) -> float:
        """Length of a step, s: MuJoCo's time step times ``substeps``."""
        return self._time_step

    @property
    def sensor_variances(self) -> Array:
        """Squares of the ``noise`` that the MuJoCo model declares for the measurements, (p,); 0 if there is none."""
        variances = np.zeros(len(self._outputs))
        for name, (first, count) in self._outputs.groups.items():
            if self._outputs.sensed[first]:
                sensor = names.sensor_names(self._mjmodel).index(name)
                variances[first : first + count] = float(self._mjmodel.sensor_noise[sensor]) ** 2
        return variances

    def mjmodel(self, values: Mapping[str, float] | None = None, /, **parameters: float) -> mujoco.MjModel:
        """A copy of the MuJoCo model with these parameter values, to simulate or display a design in MuJoCo itself."""
        asked = changed(values, parameters)
        for name in asked:
            names.find("parameter", name, list(self._parameters))
        phi = [float(asked.get(name, parameter.initial)) for name, parameter in self._parameters.items()]
        return fields.changed(self._mjmodel, self._backend.simulator.targets, phi)

    def positions(self, x: ArrayLike) -> Array:
        """MuJoCo's ``qpos`` (..., nq) of states (..., n): a trajectory, for display or simulation."""
        given = np.asarray(x, dtype=np.float64)
        flat = given.reshape(-1, given.shape[-1])
        found = self._backend.simulator.chart.positions(flat[:, : self._backend.simulator.nv])
        return np.asarray(found.reshape(*given.shape[:-1], -1))

    def state(self, changes: Mapping[str, Number] | None = None) -> list[Number]:
        """The keyframe's state (n,) with changes by name or pattern: ``{"q.elbow": 0.3}``."""
        return reading.changed("initial_state", list(self._start), self.states, changes or {})

    def noise(
        self,
        *,
        initial: Mapping[str, Number],
        process: Mapping[str, Number],
        measurement: Mapping[str, Number] | Number | None = None,
        varying: Sequence[VaryingVariance] = (),
    ) -> Noise:
        """Variances by names or patterns of states and measurements; 0 for names not given.

        Args:
            initial: Variances of the initial state: ``{"q.*": 1e-6, "v.*": 1e-4}``.
            process: Variances of the noise that each step adds to the state.
            measurement: Variances of the measurements; ``sensor_variances`` for names not given.
            varying: State-dependent terms added to the measurement variances.
        """
        named = {"*": measurement} if isinstance(measurement, (int, float, str)) else measurement or {}
        still: list[Number] = [0.0] * len(self._states)
        return Noise(
            initial=reading.changed("noise: initial", still, self.states, initial),
            process=reading.changed("noise: process", still, self.states, process),
            measurement=reading.changed("noise: measurement", list(self.sensor_variances), self.measurements, named),
            varying=varying,
        )

    def task(
        self,
        *,
        steps: int,
        noise: Noise,
        initial_state: Mapping[str, Number] | Sequence[Number] | None = None,
        initial_control: Sequence[Number] | Sequence[Sequence[Number]] | ArrayLike | None = None,
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
            noise: Covariances of initial state, process and measurement; see :meth:`noise`.
            initial_state: Mean of the initial state, (n,), or changes of the keyframe's state by name.
            initial_control: Initial guess of the controls, (m,) for all steps or (N, m); default: the keyframe's.
            bound: Cost limit: the greatest expected cost allowed.
            name: Its name.
            title: Description, for people.
            information_weight: Weight of its information in the objective.
            control_bounds: Lower and upper limit of each control; default: the actuators' ``ctrlrange``.
            planning: Settings of the planner, by the names in the task file's ``[planning]``.
            design: Settings of the search, by the names in the task file's ``[design]``.

        Raises:
            UsageError: If a number, name or shape is wrong, or MuJoCo diverges at the initial state.
        """
        given = isinstance(initial_state, Mapping) or initial_state is None
        start = self.state(initial_state) if given else initial_state  # type: ignore[arg-type]
        return self._engine.task(
            steps=steps,
            time_step=self._time_step,
            initial_state=start,  # type: ignore[arg-type]
            initial_control=list(self._start_control) if initial_control is None else initial_control,
            noise=noise,
            bound=bound,
            name=name,
            title=title,
            information_weight=information_weight,
            control_bounds=self._ranges if control_bounds is None else control_bounds,
            planning=planning,
            design=design,
        )


def gradient_error(task: Task, *, step: float = 0.01) -> dict[str, float]:
    """Relative errors of the total gradient of information, compared with new plans at four neighbouring designs each.

    Args:
        task: The task, at the values to examine; these must be at least two steps away from their bounds.
        step: Step of a parameter: relative to its value, or to its range if the value is 0.

    Returns:
        Errors by parameter of the role ``design``. The differences themselves have an error of about ``step**4``.
    """
    found = task.evaluate(gradient="total", needed=False, rollouts=0, trajectories=False)
    weights = {one["name"]: float(one["information_weight"]) for one in found.made["about"]["tasks"]}
    errors = {}
    for name, parameter in task.parameters.items():
        if parameter.role != "design":
            continue
        value = task.values[name]
        h = step * (abs(value) or parameter.bounds[1] - parameter.bounds[0])
        moved = [
            task.evaluate(at={name: value + k * h}, needed=False, rollouts=0, trajectories=False).information.nats
            for k in (-2, -1, 1, 2)
        ]
        truth = (8.0 * (moved[2] - moved[1]) - (moved[3] - moved[0])) / (12.0 * h)
        slope = sum(weights[label] * _slope(report, name) for label, report in found.tasks.items())
        errors[name] = abs(slope - truth) / abs(truth) if truth != 0.0 else abs(slope)
    return errors


def _slope(report: TaskReport, name: str) -> float:
    """The total gradient of a task's information with respect to a parameter."""
    total = None if report.gradient is None else report.gradient.total
    return float("nan") if total is None else total.information_nats[name]


class _Engine(own.Model):
    """Tasks of an existing backend."""

    def __init__(
        self, backend: MujocoBackend, parameters: Mapping[str, Parameter], channels: tuple[tuple[Channel, ...], ...]
    ) -> None:
        self._backend = backend
        self._jax = None
        self._parameters = dict(parameters)
        keys = ("states", "controls", "measurements")
        self._channels = {key: {one.name: one.unit for one in some} for key, some in zip(keys, channels, strict=True)}

    def _system(
        self, near: tuple[Array, Array, Array], time_step: Number
    ) -> tuple[dict[str, Any], own.DerivativeError]:
        x, controls, phi = near
        backend = self._backend
        if not (
            np.isfinite(backend.steps(x[None], controls[:1], phi)).all()
            and np.isfinite(backend.observations(x[None], phi)).all()
        ):
            raise UsageError(
                "MuJoCo diverges in the first step from the initial state: shorten `timestep`, or change the state"
            )
        states, taken, _ = backend.roll_out(x, controls, None, None, None, phi)
        finite = np.flatnonzero(np.isfinite(states[:-1]).all(axis=1) & np.isfinite(taken).all(axis=1))
        few = finite[:: max(1, len(finite) // 4)]
        error = own.DerivativeError(*relative_errors(backend, states[few], taken[few], phi))
        return self._described(backend), error
