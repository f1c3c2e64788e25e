"""Tasks: a robot, its tasks, and the parameters to design."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, overload

from numpy.typing import ArrayLike

from . import _html
from ._arrays import finite_array
from ._asked import (
    MOST_WORKERS,
    axis_values,
    bound_points,
    changed,
    check_choice,
    check_counts,
    check_name,
    check_out,
    designs_of,
    finite,
    logged,
    pairs,
)
from ._records import build
from ._supple import NativeTask
from .bounds import Bounds
from .checks import CheckReport, Linearisation
from .closed_loop import Plant, Rollouts, roll_out
from .errors import UsageError
from .parameter import CatalogueEntry, Parameter
from .progress import Progress, watching
from .results import Design, Evaluation
from .sensors import Sensors
from .studies import Pareto, Robustness, Sweep, Trace

if TYPE_CHECKING:
    from ._asked import Axes, Vary
    from ._crew import Workers
    from ._records import Array
    from ._supple import Kept
    from .explorer import Explorer
    from .model import DerivativeError

__all__ = ["CatalogueEntry", "Grid", "Parameter", "Task"]

#: Axes by parameter: values, or a text such as ``"log:50:600:100"``.
Grid = Mapping[str, ArrayLike]

Gradient = Literal["total", "frozen", "both"]

METHODS = ("sqp", "cobyla", "barrier")
GRADIENTS = ("total", "frozen")


class Task:
    """A problem: a model with named parameters, and one or more tasks that share them.

    Made by :func:`supple.load`, :class:`supple.Model`, :func:`supple.linear` or :class:`supple.mujoco.Model`.
    Methods take parameter values as keyword arguments, or in ``at`` if a name is not a valid Python identifier or is the
    name of an option.
    """

    def __init__(self, native: NativeTask, recipe: tuple[str, Any], changed: Mapping[str, float] | None = None) -> None:
        self._native = native
        # How another process rebuilds the task.
        self._recipe = recipe
        self._changed = dict(changed or {})
        about = native.about()
        self._title = str(about["title"])
        self._tasks = {str(task["name"]): dict(task) for task in about["tasks"]}
        self._parameters = {
            entry["name"]: Parameter(
                initial=entry["initial"],
                bounds=(float(entry["bounds"][0]), float(entry["bounds"][1])),
                scale=entry["scale"],
                unit=entry["unit"],
                role=entry["role"],
                catalogue=tuple(CatalogueEntry(**listed) for listed in entry.get("catalogue", ())),
                price=entry.get("price"),
            )
            for entry in about["parameters"]
        }

    @property
    def title(self) -> str:
        """The title; may be empty."""
        return self._title

    @property
    def parameters(self) -> dict[str, Parameter]:
        """All parameters by name, as declared."""
        return dict(self._parameters)

    @property
    def values(self) -> dict[str, float]:
        """Current values of all parameters by name."""
        return self._native.values()

    @property
    def tasks(self) -> list[str]:
        """Names of the tasks."""
        return list(self._tasks)

    @property
    def derivative_error(self) -> DerivativeError | None:
        """Errors of the derivatives of a :class:`supple.Model`; ``None`` for other tasks."""
        kind, what = self._recipe
        return what.get("derivative_error") if kind == "own" else None

    @property
    def warnings(self) -> list[str]:
        """Parts of the files that are ignored or probably wrong."""
        return self._native.warnings()

    def at(self, values: Mapping[str, float] | None = None, /, **parameters: float) -> Task:
        """The same task with other values of some parameters."""
        asked = changed(values, parameters)
        return Task(self._native.with_values(pairs(asked)), self._recipe, {**self._changed, **asked})

    def evaluate(
        self,
        *,
        gradient: Gradient | None = None,
        needed: bool = True,
        rollouts: int | None = None,
        branches: int = 0,
        seed: int = 0,
        trajectories: bool = True,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Evaluation:
        """Evaluates a design: information, cost, controller, and optional results.

        Args:
            gradient: Gradients to compute: ``total``, in which plan, feedback and filter all vary; ``frozen``, the paper's; or
                ``both``.
            needed: Whether to compute the minimum information over all sensors and controllers at the task's cost limit.
            rollouts: Closed-loop roll-outs with an extended Kalman filter; default: as set in the task: 256, fewer with
                more than 32 states, or none for models whose functions are in Python.
            branches: Attempts to find a plan of lower cost among other local minima. Without them, two attempts warn of a plan
                that costs 1 % less.
            seed: Seed of roll-outs and attempts.
            trajectories: Whether to keep the trajectories.
            at: Values of parameters.
            **parameters: Values of parameters.
        """
        check_choice("gradient", [gradient], ["total", "frozen", "both", None])
        task = self.at(at, **parameters)
        rollouts = task._native.rollouts() if rollouts is None else rollouts
        check_counts(rollouts=rollouts, branches=branches, seed=seed)
        options: dict[str, Any] = {
            "total_gradient": gradient in ("total", "both"),
            "frozen_gradient": gradient in ("frozen", "both"),
            "needed": bool(needed),
            "rollouts": int(rollouts),
            "branches": int(branches),
            "seed": int(seed),
            "trajectories": bool(trajectories),
        }
        return Evaluation(task._conduct("evaluate", options), task)

    @overload
    def simulate(
        self,
        controls: ArrayLike,
        *,
        plant: None = None,
        rollouts: int = 1,
        seed: int = 0,
        noise: bool = True,
        initial_state: ArrayLike | None = None,
        task: str | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Array: ...

    @overload
    def simulate(
        self,
        controls: None = None,
        *,
        plant: Plant,
        rollouts: int = 1,
        seed: int = 0,
        noise: bool = True,
        initial_state: ArrayLike | None = None,
        task: str | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Rollouts: ...

    def simulate(
        self,
        controls: ArrayLike | None = None,
        *,
        plant: Plant | None = None,
        rollouts: int = 1,
        seed: int = 0,
        noise: bool = True,
        initial_state: ArrayLike | None = None,
        task: str | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Array | Rollouts:
        """Simulates the model under given controls, without noise or feedback; or the plan's controller on a plant.

        Args:
            controls: One row for each step, (N, m). The number of rows is the number of steps; limits of the controls are not
                applied.
            plant: Instead of ``controls``: a function of a state (n,), controls (m,) and the step number that returns the next
                state. The controller and filter of the plan run on it, and use only the plan.
            rollouts: Roll-outs on the plant.
            seed: Seed of the noise of these roll-outs.
            noise: Whether initial state, process and measurements of these roll-outs have the task's noise.
            initial_state: The initial state, (n,); default: the task's.
            task: Name of the task. Required if there are several.
            at: Values of parameters.
            **parameters: Values of parameters.

        Returns:
            The states at steps 0 to N, (N+1, n), in the order of ``state_names`` of trajectories; with a plant,
            :class:`supple.Rollouts`.
        """
        name = self._one_task(task)
        if plant is not None:
            if controls is not None:
                raise UsageError("controls= simulates the model and plant= runs the plan's controller: give only one")
            if not callable(plant):
                raise UsageError(f"plant={plant!r}: a function of state, controls and step")
            check_counts(rollouts=rollouts, seed=seed)
            first = None if initial_state is None else finite_array("initial_state", initial_state, ("n",))
            found = self.linearise(task=name, at=at, **parameters)
            return roll_out(found, plant, int(rollouts), int(seed), first, bool(noise))
        if controls is None:
            raise UsageError("give controls=, one row for each step, or plant=, a function that returns the next state")
        rows = finite_array("controls", controls, ("N", "m"))
        start = None if initial_state is None else finite_array("initial_state", initial_state, ("n",)).tolist()
        return self.at(at, **parameters)._native.simulate(name, rows, start)

    def check(self, at: Mapping[str, float] | None = None, /, **parameters: float) -> CheckReport:
        """Compares every derivative with finite differences, as ``supple check`` does.

        Args:
            at: Values of parameters.
            **parameters: Values of parameters.
        """
        with logged("check"):
            return build(CheckReport, self.at(at, **parameters)._native.check())

    def linearise(
        self, *, task: str | None = None, at: Mapping[str, float] | None = None, **parameters: float
    ) -> Linearisation:
        """The linearisation of a task along its plan: dynamics, costs, noise and controller as arrays.

        Args:
            task: Name of the task. Required if there are several.
            at: Values of parameters.
            **parameters: Values of parameters.
        """
        name = self._one_task(task)
        return build(Linearisation, self.at(at, **parameters)._native.linearise(name))

    def _one_task(self, task: str | None) -> str:
        """The task with this name, or the only one."""
        check_name("task", task)
        if task is None and len(self._tasks) > 1:
            raise UsageError(f"there are several tasks: give task= one of {', '.join(self._tasks)}")
        return task or self.tasks[0]

    def design(
        self,
        *,
        starts: int | None = None,
        seed: int | None = None,
        method: Literal["sqp", "cobyla", "barrier"] | None = None,
        gradient: Literal["total", "frozen"] | None = None,
        information: Literal["needed", "used", "measured"] | Mapping[str, float] | None = None,
        rollouts: int | None = None,
        settings: Mapping[str, Any] | None = None,
        out: str | os.PathLike[str] | None = None,
        executor: Workers | None = None,
        progress: bool | Progress | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Design:
        """Searches for the design with the least information that stays within every cost limit.

        Args:
            starts: Number of starts: the current parameter values, then seeded random values; default: as set in the task.
            seed: Seed of random starts and of searches for other local minima.
            method: The optimiser.
            gradient: The gradient that it follows.
            information: The information that is minimised: ``"needed"``, the minimum over all sensors and controllers;
                ``"used"``, by the controller; ``"measured"``, by the sensors; or weights of these. If no information is
                needed, the search minimises the used information.
            rollouts: Closed-loop roll-outs at the start and at the optimum.
            settings: Other settings of the search, by the names in the task file's ``[design]``.
            out: A folder for the result, whose journal stores finished starts meanwhile: the same call resumes from it.
            executor: Where the searches run: a ``concurrent.futures`` executor, a number of processes, or a function that makes
                an executor; default: the threads of this process. The result is the same. Not with `out`.
            progress: ``True`` for a tqdm bar, or a custom object (:class:`supple.Progress`).
            at: Values of parameters to start from.
            **parameters: Values of parameters to start from.
        """
        task = self.at(at, **parameters)
        check_choice("method", [method], [*METHODS, None])
        check_choice("gradient", [gradient], [*GRADIENTS, None])
        wanted = {**task._native.design_settings(), **(settings or {})}
        given = {"starts": starts, "seed": seed, "method": method, "gradient": gradient, "rollouts": rollouts}
        aim = dict(information) if isinstance(information, Mapping) else information
        wanted.update({key: value for key, value in {**given, "information": aim}.items() if value is not None})
        check_out(out, executor)
        with watching(progress) as seer, logged("design"):
            if executor is None:
                return Design(task._conduct("design", wanted, out=out, progress=seer), task)
            from . import executors

            return Design(executors.design(task, json.dumps(wanted), executor, seer), task)

    def sweep(
        self,
        grid: Grid,
        *,
        rollouts: int = 0,
        starts: int = 0,
        branches: int = 0,
        seed: int = 0,
        jobs: int | None = None,
        out: str | os.PathLike[str] | None = None,
        executor: Workers | None = None,
        progress: bool | Progress | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Sweep:
        """Evaluates every design of a grid.

        Args:
            grid: Values by parameter; the last axis changes fastest. Values may be a string:
                ``"50:600:100"``, ``"log:50:600:100"``.
            rollouts: Closed-loop roll-outs at every point.
            starts: At every point, design the parameters that are not on an axis, from this many starts.
            branches: At every point, attempts to find a plan of lower cost among other local minima; not with ``starts``.
            seed: Seed of roll-outs and searches.
            jobs: Points to evaluate at once; default: all cores.
            out: A folder whose journal stores completed work: the same call resumes from it.
            executor: Where points are evaluated: a ``concurrent.futures`` executor, a number of processes, or a function that
                makes an executor, which is called again if a worker process ends; default: the threads of this process.
                The table is bit-identical.
            progress: ``True`` for a tqdm bar, or a custom object.
            at: Values of parameters that are not on an axis.
            **parameters: Values of parameters that are not on an axis.
        """
        check_counts(rollouts=rollouts, starts=starts, branches=branches, seed=seed)
        if jobs is not None and not 1 <= jobs <= MOST_WORKERS:
            raise UsageError(f"jobs={jobs}: must be at least 1 and at most {MOST_WORKERS}")
        if jobs is not None and executor is not None:
            raise UsageError("jobs sets threads of this process and executor has its own workers: give only one")
        task = self.at(at, **parameters)
        axes: Axes = [(name, axis_values(name, values)) for name, values in grid.items()]
        sizes = (rollouts, starts, branches, seed)
        with watching(progress) as seer, logged("sweep"):
            if executor is None:
                return Sweep(task._native.sweep(axes, sizes=sizes, place=(jobs, out), progress=seer), task)
            from . import executors

            found = Sweep(executors.sweep(task, axes, sizes, executor, out, seer), task)
        if out is not None:
            found.save(out)
        return found

    def robustness(
        self,
        designs: Mapping[str, Mapping[str, float]] | Iterable[str] = ("start", "optimum"),
        *,
        vary: Grid,
        rollouts: int = 20,
        seed: int = 0,
        out: str | os.PathLike[str] | None = None,
        executor: Workers | None = None,
        progress: bool | Progress | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Robustness:
        """Closed-loop costs of several designs as a noise grows, with the same random numbers.

        Args:
            designs: Designs by name: parameter values, ``{"soft": {"k1": 50.0}}``; the names ``start``, the current values, and
                ``optimum``, the result of a design search from there, take no values: ``{"optimum": {}}``.
            vary: The parameter that grows, with the role ``study``, and its values: ``{"wall_variance": [1e-5, 1e-3]}``.
            rollouts: Roll-outs at every level.
            seed: Seed of the roll-outs.
            out: A folder for the result, whose journal stores finished parts meanwhile: the same call resumes from it.
            executor: Where designs and levels are simulated, as in :meth:`sweep`; not with `out`.
            progress: ``True`` for a tqdm bar, or a custom object.
            at: Values of parameters of ``start``.
            **parameters: Values of parameters of ``start``.
        """
        check_counts(rollouts=rollouts, seed=seed)
        if len(vary) != 1:
            raise UsageError(f"vary names {len(vary)} parameters: one is varied at a time")
        check_out(out, executor)
        task = self.at(at, **parameters)
        ((name, values),) = vary.items()
        axis: Vary = (name, axis_values(name, values))
        chosen = designs_of(designs)
        with watching(progress) as seer, logged("robustness"):
            if executor is None:
                kept = task._native.robustness((chosen, axis), sizes=(rollouts, seed), out=out, progress=seer)
            else:
                from . import executors

                kept = executors.robustness(task, chosen, axis, (rollouts, seed), executor, seer)
        return Robustness(kept, task)

    def pareto(
        self,
        *,
        points: int = 20,
        starts: int = 4,
        seed: int = 0,
        out: str | os.PathLike[str] | None = None,
        progress: bool | Progress | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Pareto:
        """Traces the Pareto front of information and cost: designs of least information as all cost limits vary together.

        Args:
            points: Points of the front.
            starts: Starts of the searches for its ends.
            seed: Seed of the starts.
            out: A folder for the result, whose journal stores finished parts meanwhile: the same call resumes from it.
            progress: ``True`` for a tqdm bar, or a custom object.
            at: Values of parameters.
            **parameters: Values of parameters.
        """
        check_counts(points=points, starts=starts, seed=seed)
        task = self.at(at, **parameters)
        options = {"points": int(points), "starts": int(starts), "seed": int(seed)}
        with watching(progress) as seer, logged("pareto"):
            return Pareto(task._conduct("pareto", options, out=out, progress=seer), task)

    def bound(
        self,
        *,
        cost: float | None = None,
        curve: bool | int = False,
        stationary: bool = False,
        task: str | None = None,
        progress: bool | Progress | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Bounds:
        """Computes the minimum information required, over all sensors and controllers that stay within an expected cost.

        Args:
            cost: The expected cost that must not be exceeded, over the task, or per step if stationary; default: the design's
                own.
            curve: Whether to compute the minimum over a range of costs too: ``True`` for 20 points, or the number of points.
            stationary: Bounds per step in the steady state, for time-invariant linear models.
            task: The task, if there are several; default: all of them.
            progress: ``True`` for a tqdm bar, or a custom object.
            at: Values of parameters whose names are not valid Python identifiers.
            **parameters: Values of parameters.
        """
        check_name("task", task)
        options: dict[str, Any] = {"task": task, "cost": finite("cost", cost), "stationary": bool(stationary)}
        options["curve"] = bound_points(curve)
        found = self.at(at, **parameters)
        with watching(progress) as seer, logged("bound"):
            return Bounds(found._conduct("bound", options, progress=seer), found)

    def sensors(
        self,
        *,
        budget: float | None = None,
        count: int | None = None,
        cost: float | None = None,
        goal: Literal["cost", "information"] = "cost",
        method: Literal["greedy", "exhaustive", "both"] = "both",
        task: str | None = None,
        progress: bool | Progress | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Sensors:
        """Finds the best set of sensors in the task's catalogue, the worth of each sensor, and a bound on any set.

        Without a catalogue the candidates are the task's own measurements, without prices.

        Args:
            budget: Limit on the total price of the chosen sensors.
            count: Maximum number of chosen sensors.
            cost: Choose the cheapest set with an expected cost of at most this; the smallest set if there are no prices.
            goal: The criterion: the least expected cost, or the most information.
            method: Greedy selection, all sets (beyond 15 candidates by branch and bound until the best set is proved), or both
                (branch and bound gives up after 2,000 regions).
            task: The only task to consider, if there are several; default: the sum of all.
            progress: ``True`` for a tqdm bar, or a custom object.
            at: Values of parameters.
            **parameters: Values of parameters.
        """
        if count is not None:
            check_counts(count=count)
        check_name("task", task)
        check_choice("goal", [goal], ["cost", "information"])
        check_choice("method", [method], ["greedy", "exhaustive", "both"])
        options: dict[str, Any] = {"budget": finite("budget", budget), "cost": finite("cost", cost)}
        options |= {"count": None if count is None else int(count), "goal": goal, "method": method, "task": task}
        found = self.at(at, **parameters)
        with watching(progress) as seer, logged("sensors"):
            return Sensors(found._conduct("sensors", options, progress=seer), found)

    def trace(
        self,
        *,
        starts: int = 10,
        methods: Sequence[Literal["sqp", "cobyla", "barrier"]] = ("sqp", "barrier"),
        gradients: Sequence[Literal["total", "frozen"]] = ("total", "frozen"),
        seed: int = 0,
        out: str | os.PathLike[str] | None = None,
        progress: bool | Progress | None = None,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Trace:
        """Records the paths of searches, for every method and gradient from every start.

        Args:
            starts: Starts of every method and gradient.
            methods: Optimisers.
            gradients: Gradients that they are given.
            seed: Seed of the starts.
            out: A folder for the result, whose journal stores finished parts meanwhile: the same call resumes from it.
            progress: ``True`` for a tqdm bar, or a custom object.
            at: Values of parameters.
            **parameters: Values of parameters.
        """
        check_counts(starts=starts, seed=seed)
        methods, gradients = list(methods), list(gradients)
        check_choice("methods", methods, METHODS)
        check_choice("gradients", gradients, GRADIENTS)
        task = self.at(at, **parameters)
        options = {"starts": int(starts), "methods": methods, "gradients": gradients, "seed": int(seed)}
        with watching(progress) as seer, logged("trace"):
            return Trace(task._conduct("trace", options, out=out, progress=seer), task)

    def explore(
        self,
        *,
        port: int | None = None,
        browser: bool = True,
        at: Mapping[str, float] | None = None,
        **parameters: float,
    ) -> Explorer:
        """Opens the page of ``supple explore``: sliders for parameters, cost limits and noise, with results at once.

        The page runs in threads of this process and ends with it; Ctrl-C does not end it. In a notebook it appears in the
        output of the cell; elsewhere its address is printed and opened in a browser. Python remains available.

        Args:
            port: Port of 127.0.0.1; default: any that is free.
            browser: Whether to show the page; if not, it waits at ``url``.
            at: Values of parameters to begin with.
            **parameters: Values of parameters to begin with.

        Raises:
            UsageError: If the port is taken.
        """
        from .explorer import explore

        return explore(self.at(at, **parameters), port, browser)

    def _conduct(
        self,
        study: str,
        options: Mapping[str, Any],
        *,
        out: str | os.PathLike[str] | None = None,
        progress: Progress | None = None,
    ) -> Kept:
        """Does a study with these options."""
        work = json.dumps({"run": study, "options": options})
        return self._native.conduct(work, out=out, progress=progress)

    def __reduce__(self) -> tuple[Any, ...]:
        from ._recipes import make

        return make, (*self._packed(), self._changed)

    def _calls_jax(self) -> bool:
        """Whether its computations call functions compiled by JAX."""
        kind, what = self._recipe
        backends = [system.get("backend") for system in what["systems"]] if kind == "own" else []
        return any(getattr(backend, "calls_jax", False) for backend in backends)

    def _packed(self) -> tuple[str, Any]:
        kind, what = self._recipe
        if kind != "own":
            # Includes the texts of its files, which other machines need not have.
            return kind, (what, self._native.sources())
        return kind, what

    def _summary(self) -> list[tuple[str, str]]:
        rows = [(name, f"{task['steps']} steps of {task['time_step']:.6g} s") for name, task in self._tasks.items()]
        for name, value in self.values.items():
            parameter = self._parameters[name]
            lower, upper = parameter.bounds
            unit = f" {parameter.unit}" if parameter.unit else ""
            rows.append((name, f"{value:.6g}{unit} in [{lower:.6g}, {upper:.6g}], {parameter.scale}, {parameter.role}"))
        return rows

    def __repr__(self) -> str:
        rows = self._summary()
        width = max((len(name) for name, _ in rows), default=0)
        return "\n".join([f"Task {self._title}".rstrip(), *(f"  {name:<{width}}  {text}" for name, text in rows)])

    def _repr_html_(self) -> str:
        return _html.table(f"Task {self._title}".rstrip(), self._summary())
