"""Designs of supple in closed loop on MuJoCo."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import mujoco
import numpy as np

from .._asked import check_choice, check_counts, finite, logged
from .._records import Array, build
from .._supple import NativeTask, mean_and_interval
from ..checks import Linearisation
from ..errors import ComputeError, UsageError
from ..reports import Consistency, LimitShare
from ..results import Design, Evaluation
from ..task import Task
from ..validation import SampledLoop, TaskValidation, Validation
from .judgement import Moves, conclude, enlarged, furthest_left, sampled
from .plant import Plant
from .robot import FACTORS, Robot

__all__ = ["ENDS_WELL", "VARY", "validate"]

#: A roll-out ends well where no entry of its last state is further from the plan's than so many of the standard deviations
#: that the plan predicts, and this share of the range that the entry has in the plan.
ENDS_WELL, ENDS_WELL_RANGE = 4.0, 0.1

#: What can be varied: which keys of which kinds of ``[[model.compliance]]`` each name multiplies; ``insert`` are the springs of
#: ``[[model.insert]]``.
VARY: dict[str, list[tuple[tuple[str, ...], tuple[str, ...]]]] = {
    "mass": [],
    "damping": [
        (("spring", "elastic_joint", "bushing", "insert"), ("damping",)),
        (("elastic_joint",), ("motor_damping",)),
        (("bushing",), ("torsional_damping",)),
    ],
    "stiffness": [
        (("spring", "elastic_joint", "bushing", "insert"), ("stiffness",)),
        (("bushing",), ("torsional_stiffness",)),
    ],
    "friction": [(("contact",), ("friction",))],
    "contact.stiffness": [(("contact",), ("stiffness",))],
    "contact.dissipation": [(("contact",), ("dissipation",))],
}

#: What the names of efforts in the first sub-step end with.
EARLY = " in the first sub-step"
#: MuJoCo's steps are short enough where halving them changes velocities by this share of what a step of the task does, and
#: innovations by this share of what the filter expects.
CONVERGED, ENLARGED = 1e-2, 5e-3
FEWEST, MOST = 4, 128
#: Points of the plan at which that is looked at.
LOOKED_AT = 64


def validate(
    result_or_task: Task | Design | Evaluation,
    rollouts: int = 200,
    contact: Literal["same", "mujoco"] = "same",
    vary: Mapping[str, float] | None = None,
    at: Literal["start", "optimum"] | None = None,
    seed: int = 0,
) -> Validation:
    """Runs a design's plan, gains and extended Kalman filter on MuJoCo, beside supple's own model under the same noise.

    MuJoCo reads the robot's file itself. Bodies, springs, elastic joints, drives and damping are MuJoCo's own; bushings,
    friction in joints and supple's law of contact are applied at each of its steps, of which there are as many in a time step
    as it takes for motion and measurements to change no more, at most 128, or four times the sub-steps of the task. Noise is that of the task: roll-out ``i`` has the same random numbers on both.
    Measurements, costs and contacts are supple's functions of MuJoCo's states.

    Args:
        result_or_task: A task of a robot from a file, or what :meth:`supple.Task.design` or :meth:`supple.Task.evaluate` found.
        rollouts: Roll-outs of each task.
        contact: ``same`` has supple's law of contact (R.14, R.15). ``mujoco`` has MuJoCo's own between a sphere and a plane:
            its static stiffness is that of the law, it sets in where the body meets the wall and not before, its damping is
            that of the law at the mean force of the plan, and its friction is dry.
        vary: Factors on numbers of MuJoCo's robot, of which plan, gains and filter know nothing, by the names of
            :data:`supple.mujoco.VARY`: ``mass`` (and moments of inertia) of all links; ``damping`` of joints, motors, springs,
            mounts and bushings; ``stiffness`` of joints, springs, mounts, elastic joints and bushings; ``friction`` of joints and
            contacts;
            ``contact.stiffness`` and ``contact.dissipation``. Where a number is a parameter, the parameter is multiplied,
            and expressions of it change with it.
        at: The design: of a task or an evaluation ``start``, as it is; of a design search the ``optimum`` it found, which is
            the default there, or its ``start``. ``optimum`` of a task runs :meth:`supple.Task.design` first. Plans of a
            result that keeps trajectories are its own.
        seed: Seed of the noise.

    Raises:
        UsageError: Where the task is not one of a robot from a file, has something that MuJoCo's twin of it has not, or a name
            or number is wrong, or a factor multiplies nothing.
        ComputeError: Where the design has no plan.
    """
    check_choice("contact", [contact], ["same", "mujoco"])
    at = at or ("optimum" if isinstance(result_or_task, Design) else "start")
    check_choice("at", [at], ["start", "optimum"])
    check_counts(rollouts=rollouts, seed=seed)
    if rollouts < 2:
        raise UsageError(f"rollouts={rollouts}: at least 2, for intervals")
    factors = _factors(vary or {})
    task = _task(result_or_task, at)
    with logged("validate"):
        tasks = {name: _validate(task, name, (int(rollouts), int(seed)), contact, factors) for name in task.tasks}
    return Validation(
        title=task.title,
        at=at,
        parameters=task.values,
        contact=contact,
        vary=factors,
        rollouts=int(rollouts),
        seed=int(seed),
        mujoco_version=str(mujoco.__version__),
        tasks=tasks,
    )


def _factors(vary: Mapping[str, float]) -> dict[str, float]:
    found = {}
    for name, factor in vary.items():
        if name not in VARY:
            raise UsageError(f"vary: unknown quantity `{name}`; valid: {', '.join(VARY)}")
        number = finite(f"vary: {name}", factor)
        if number is None or number < 0.0 or (name == "mass" and number == 0.0):
            raise UsageError(f"vary: {name}={factor!r}: must be {'above' if name == 'mass' else 'at least'} 0")
        found[name] = number
    return found


def _task(given: Task | Design | Evaluation, at: str) -> Task:
    """The task at the design that is meant, with its plans."""
    if isinstance(given, Task):
        return given if at == "start" else _task(given.design(), at)
    if not isinstance(given, (Design, Evaluation)):
        raise UsageError(
            f"{type(given).__name__} cannot be validated: give a Task, or a result of its design or evaluate"
        )
    if isinstance(given, Evaluation) and at == "optimum":
        raise UsageError("at='optimum': an evaluation has one design, its `start`; give a task or a result of design")
    of = given._start if isinstance(given, Design) and at == "start" else given._evaluated
    if given.task is not None:
        task = given.task.at(of.parameters)
    else:
        sources = [(source["path"], source["text"]) for source in given.made["sources"]]
        native = NativeTask.restore(sources, list(of.parameters.items()))
        task = Task(native, ("loads", sources[0][0]), of.parameters)
    plans = [(name, one.trajectory.controls.tolist()) for name, one in of.tasks.items() if one.trajectory is not None]
    return Task(task._native.knowing(plans), task._recipe, task._changed)


def _validate(task: Task, name: str, sizes: tuple[int, int], contact: str, factors: dict[str, float]) -> TaskValidation:
    plan = task.linearise(task=name)
    if plan.status in ("indefinite", "not_finite"):
        raise ComputeError(f"the plan of `{name}` ended as {plan.status}: there is no controller to validate")
    native = _of(task._native, name, plan.controls.tolist())
    truth = _truth(native, factors)
    substeps = int(json.loads(native.tables())["model"].get("substeps", 1))
    trial = _trial(truth, name, (plan, substeps), contact == "mujoco", factors)
    steps = trial.plant.substeps
    idle = [key for key in factors if key not in trial.robot.scaled and not _varied(native, {key: factors[key]})]
    if idle:
        raise UsageError(f"vary: {idle[0]}: the robot of `{name}` has nothing that it would multiply")
    unvaried = trial
    if factors:
        unvaried = _trial(native, name, (plan, substeps), contact == "mujoco", {}, steps)

    def rolled_out(task: NativeTask, robot: Robot) -> dict[str, Any]:
        plant = Plant(robot, sizes[0], plan.time_step, steps)
        found = task.roll_out_elsewhere(name, truth, lambda x, u, _: plant.step(x, u), sizes)
        for runs, peaks in ((found["own"], {}), (found["plant"], plant.peaks())):
            runs["limits"] = [build(LimitShare, limit) for limit in _at_peaks(runs.get("limits", []), peaks)]
        return found

    found = rolled_out(native, trial.robot)
    stops = _stops(native, name)
    if _reached(found["plant"], stops):
        known = native.knowing([(name, plan.controls.tolist())])
        stopped = rolled_out(known, trial.with_stops(stops))["plant"]
        # What is commanded may be outside of ranges; what acts is not.
        cut = {reported for of, (reported, _) in stops.items() if not of.startswith("q.")}
        stopped["limits"] = [limit for limit in stopped["limits"] if limit.name not in cut]
        found["stopped"] = stopped
    tolerance = ENDS_WELL * deviations(plan) + ENDS_WELL_RANGE * np.ptp(plan.states, axis=0) + 1e-12
    costs = {where: np.asarray(found[where]["costs"], dtype=np.float64) for where in ("own", "plant")}
    both = np.isfinite(costs["own"]) & np.isfinite(costs["plant"])
    difference, interval = _mean(costs["plant"][both] - costs["own"][both])
    states = [channel["name"] for channel in native.channels(name)["states"]]
    # What sensors recall of the last step is nothing that has to end anywhere.
    states = [state for state in states if not state.startswith("last.")]
    loops = [where for where in ("own", "plant", "stopped") if where in found]
    off = {where: (_off(found[where], plan.states[-1]) / tolerance)[:, : len(states)] for where in loops}
    own, *on_mujoco = (_loop(found[where], off[where]) for where in loops)
    furthest = [states[int(np.nanmedian(off[where], axis=0).argmax())] for where in loops[1:]]
    predicted = float(found["predicted_cost"]), float(found["predicted_bits"])
    moves = Moves(
        plan=plan,
        points=trial.points,
        mujoco=trial.plant.step,
        unvaried=unvaried.plant.step,
        supple=lambda count: _truth(native, {}, count),
        substeps=substeps,
        task=name,
        is_settled=trial.is_settled,
        asked=", ".join(f"{key} x {factor:g}" for key, factor in factors.items()),
        contacts=contact == "mujoco",
    )
    limit = None if found["limit"] is None else float(found["limit"])
    left = furthest_left(found["plant"]["limits"])
    ended = list(zip(on_mujoco, furthest, strict=True))
    conclusion = conclude(predicted, limit, own, ended, moves, left, sizes[0])
    return TaskValidation(
        name=name,
        status=str(found["status"]),
        predicted_cost=predicted[0],
        limit=limit,
        predicted_bits=predicted[1],
        predicted_contacts={entry["name"]: bool(entry["touches"]) for entry in found["contacts"]},
        supple=own,
        mujoco=on_mujoco[0],
        stopped=on_mujoco[1] if len(on_mujoco) > 1 else None,
        cost_difference=difference,
        cost_difference_interval_95=interval,
        mujoco_steps=steps,
        conclusion=conclusion.words,
        broken=conclusion.broken,
    )


def _stops(task: NativeTask, name: str) -> dict[str, tuple[str, tuple[float, float]]]:
    """What stops the robot, and not only limits it: names in reports and ends, by the names that :class:`Robot` has."""
    found: dict[str, tuple[str, tuple[float, float]]] = {}
    for reported, of, lower, upper in task.robot_limits(name):
        if not of.startswith("v."):
            found.setdefault(of, (reported, (lower, upper)))
    return found


def _at_peaks(limits: list[dict[str, Any]], peaks: Mapping[str, tuple[Array, Array]]) -> list[dict[str, Any]]:
    """Limits of efforts by what MuJoCo's drives exert within steps, where effort is greatest after each change of the control."""
    found = []
    for limit in limits:
        if limit["name"].removesuffix(EARLY) in peaks and limit["name"].endswith(EARLY):
            continue
        if limit["name"] in peaks:
            sign = 1.0 if limit["upper"] else -1.0
            reached = np.sort(sign * peaks[limit["name"]][int(limit["upper"])])
            most = sign * limit["limit"]
            limit = {
                **limit,
                "median": float(sign * reached[(len(reached) - 1) // 2]),
                "worst": float(sign * reached[-1]),
                "share": float(np.mean(reached > most + 1e-9 * (1.0 + abs(most)))),
            }
        found.append(limit)
    return found


def _reached(runs: Mapping[str, Any], stops: Mapping[str, tuple[str, Any]]) -> bool:
    """Whether any roll-out reaches a stop or leaves a range; those that diverge do."""
    names = {reported for reported, _ in stops.values()}
    return runs["diverged"] > 0 or any(limit.share > 0.0 for limit in runs["limits"] if limit.name in names)


def _of(task: NativeTask, name: str, controls: list[list[float]]) -> NativeTask:
    """The task file with the parameters that one of its tasks sets, and the plan of that task."""
    tasks: list[dict[str, Any]] = json.loads(task.tables()).get("tasks", [])
    numbers: dict[str, float] = next((one.get("set", {}) for one in tasks if one["name"] == name), {})
    if not numbers:
        return task
    return task.changed([], list(numbers.items()), None).knowing([(name, controls)])


def _truth(task: NativeTask, factors: Mapping[str, float], substeps: int | None = None) -> NativeTask:
    """The task with the numbers of its compliance and its mounts varied, and with so many sub-steps."""
    if not factors and substeps is None:
        return task
    values = task.values()
    varied = _varied(task, factors)
    parameters = {
        entry: factor * values[entry] for _, _, _, entries, factor in varied for entry in entries if entry in values
    }
    changes = [
        (kept, name, key, [_scaled(entry, factor, values) for entry in entries])
        for kept, name, key, entries, factor in varied
    ]
    return task.changed(changes, list(parameters.items()), substeps)


def _varied(task: NativeTask, factors: Mapping[str, float]) -> list[tuple[str, str, str, list[float | str], float]]:
    """Numbers of the task's compliance and mounts that factors multiply: list and name of the element, key, entries, factor."""
    found: list[tuple[str, str, str, list[float | str], float]] = []
    model = json.loads(task.tables()).get("model", {})
    elements = [(kept, element) for kept in ("compliance", "insert") for element in model.get(kept, [])]
    for kept, element in elements:
        kind = element["kind"] if kept == "compliance" else kept
        for name, factor in factors.items():
            for key in [key for kinds, keys in VARY[name] if kind in kinds for key in keys]:
                given = element.get(key, 0.0)
                entries = given if isinstance(given, list) else [given]
                if any(entries):
                    found.append((kept, element["name"], key, entries, factor))
    return found


def _scaled(entry: float | str, factor: float, values: Mapping[str, float]) -> float | str:
    """A number or an expression times a factor; parameters are multiplied themselves."""
    if not isinstance(entry, str):
        return factor * float(entry)
    return entry if entry in values else f"{factor!r} * ({entry})"


class _Values(Mapping[str, float]):
    """Parameters by name, and the values of expressions of them."""

    def __init__(self, task: NativeTask) -> None:
        self._task, self._parameters = task, task.values()

    def __getitem__(self, text: str) -> float:
        return self._parameters[text] if text in self._parameters else self._task.number(text)

    def __iter__(self) -> Iterator[str]:
        return iter(self._parameters)

    def __len__(self) -> int:
        return len(self._parameters)


@dataclass(frozen=True)
class _Trial:
    """A robot on MuJoCo at points of a plan.

    Attributes:
        make: Makes the robot.
        robot: The robot.
        points: Numbers of the steps of the plan.
        plant: Copies of the robot for these points.
        is_settled: Whether their steps are short enough.
    """

    make: Callable[..., Robot]
    robot: Robot
    points: Array
    plant: Plant
    is_settled: bool

    def with_stops(self, stops: Mapping[str, tuple[str, tuple[float, float]]]) -> Robot:
        """The robot that stops where :func:`_stops` says."""
        return self.make(stops={of: ends for of, (_, ends) in stops.items()})


def _trial(
    truth: NativeTask,
    name: str,
    planned: tuple[Linearisation, int],
    own_contacts: bool,
    factors: Mapping[str, float],
    steps: int | None = None,
) -> _Trial:
    """The robot on MuJoCo at points of the plan, in so many steps where that is given. The plan is given with the sub-steps of
    the task."""
    plan, substeps = planned
    model = json.loads(truth.tables())["model"]
    sources = truth.sources()
    folder = Path(sources[0][0]).parent
    file = next((path for path, _ in sources[1:] if Path(path) == folder / str(model.get("file"))), "")
    channels = truth.channels(name)
    states, controls = ([channel["name"] for channel in channels[kind]] for kind in ("states", "controls"))
    own = {key: factor for key, factor in factors.items() if key in FACTORS}
    make = partial(Robot, model, (file, dict(sources[1:])), _Values(truth), (states, controls), own)
    robot = make()
    points = np.unique(np.linspace(0, len(plan.controls) - 1, LOOKED_AT).astype(int))
    trial = Plant(robot, len(points), plan.time_step, FEWEST)
    if own_contacts and robot.contacts:
        make = partial(make, presses=trial.mean_forces(plan.states[points], plan.controls[points]))
        robot = make()
        trial = Plant(robot, len(points), plan.time_step, FEWEST)
    if steps is not None:
        trial.substeps = steps
        return _Trial(make, robot, points, trial, is_settled=True)
    # About the plan, contacts slip and stick as they do not on it.
    x, u = sampled(plan)
    most = max(MOST, 4 * substeps)
    is_settled = settle(trial, (x[points], u[points]), most, lambda errors: enlarged(plan, points, errors))
    return _Trial(make, robot, points, trial, is_settled)


def settle(plant: Plant, at: tuple[Array, Array], most: int, size: Callable[[Array], float]) -> bool:
    """Increases a plant's steps until halving them changes velocities by no more than :data:`CONVERGED`, as root mean square
    over points, relative to their change in a step of the task, and what the filter sees, by ``size``, by no more than
    :data:`ENLARGED`. There are at most so many; returns false if these are too few for the velocities."""
    states, rates = at[0], slice(plant.moving, 2 * plant.moving)
    plant.substeps = FEWEST
    coarse, moves_alike = plant.step(*at), False
    while plant.substeps < most:
        plant.substeps *= 2
        fine = plant.step(*at)
        change = np.sqrt(np.nanmean((fine - states)[:, rates] ** 2, axis=0))
        differs = np.sqrt(np.mean((fine - coarse)[:, rates] ** 2, axis=0))
        moves_alike = bool((differs <= CONVERGED * change + 1e-12).all())
        if moves_alike and size(fine - coarse) <= ENLARGED:
            break
        coarse = fine
    return moves_alike


def deviations(plan: Linearisation) -> Array:
    """Standard deviations (n,) of the last state's entries about the plan's, in closed loop.

    The estimate has the covariance ``M`` about the plan and the state ``Sigma`` about the estimate: ``M+ = F M F' + P - Sigma``
    with ``F = A + B K`` and the covariance ``P`` before the measurement.
    """
    M = plan.initial_covariance - plan.belief_covariance[0]
    for t, (A, B, K) in enumerate(zip(plan.A, plan.B, plan.feedback)):
        before = A @ plan.belief_covariance[t] @ A.T + plan.process_covariance[t]
        F = A + B @ K
        M = F @ M @ F.T + before - plan.belief_covariance[t + 1]
    return np.asarray(np.sqrt(np.maximum(np.diag(M + plan.belief_covariance[-1]), 0.0)))


def _off(runs: Mapping[str, Any], end: Array) -> Array:
    """How far the last states are from that of the plan, (R, n)."""
    return np.asarray(np.abs(np.asarray(runs["last_states"], dtype=np.float64) - end))


def _loop(runs: Mapping[str, Any], off: Array) -> SampledLoop:
    costs = np.asarray(runs["costs"], dtype=np.float64)
    well = (off <= 1.0).all(axis=1) & np.isfinite(costs)
    bits = runs.get("realised_bits")
    mean, interval = _mean(costs)
    within = bits["interval_95"] if bits else None
    consistency = runs.get("consistency")
    return SampledLoop(
        cost_mean=mean,
        cost_interval_95=interval,
        cost_median=float(np.median(costs)),
        realised_bits=float(bits["mean"]) if bits else None,
        realised_bits_interval_95=np.array([] if within is None else within, dtype=np.float64),
        consistency=build(Consistency, consistency) if consistency else None,
        touched={entry["name"]: float(entry["share"]) for entry in runs["touched"]},
        limits=runs["limits"],
        diverged=int(runs["diverged"]),
        ends_well=float(np.mean(well)),
    )


def _mean(samples: Array) -> tuple[float, Array]:
    """The mean, and where the expectation is with 95 %."""
    if not np.isfinite(samples).all() or len(samples) < 2:
        mean = float("inf") if len(samples) > 1 else float("nan")
        return mean, np.array([np.nan, np.nan])
    mean, interval = mean_and_interval(samples)
    return mean, np.array(interval)
