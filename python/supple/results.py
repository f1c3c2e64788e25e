"""Results: plain objects that can be saved, loaded, plotted and displayed."""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from . import _frames, _html
from ._asked import check_choice
from ._files import written
from ._records import Array, Record, build
from ._supple import Kept, NativeController
from .controller import Controller
from .errors import UsageError
from .plots import Plots
from .reports import Split, TaskReport
from .table import Table

if TYPE_CHECKING:
    from typing_extensions import Self

    from .task import Task

__all__ = ["Design", "Evaluation", "Information", "Result", "Start"]


class Result:
    """A result with everything that determined it. The command line reads results that ``save`` wrote, and vice versa.

    Attributes:
        task: The task that it was computed from, if it was computed in this process; ``None`` after :func:`load_result`.
    """

    kind: ClassVar[str] = ""

    def __init__(self, kept: Kept, task: Task | None = None) -> None:
        if self.kind and kept.kind != self.kind:
            raise UsageError(
                f"this is a result of `{kept.kind}`, not of `{self.kind}`: read it with supple.load_result"
            )
        self._kept = kept
        self.task = task

    @cached_property
    def _data(self) -> dict[str, Any]:
        return self._kept.data()

    @cached_property
    def made(self) -> dict[str, Any]:
        """Everything that determined it: version, study with all options, texts of files, title and parameters."""
        return self._kept.made()

    @property
    def command_line(self) -> list[str]:
        """The equivalent command line; empty if the task is not a file."""
        of_file = self.task is None or self.task._recipe[0] == "load"
        return self._kept.words() if of_file and self.made["study"]["task"] != "own model" else []

    def to_json(self) -> str:
        """The result as the command line prints it with ``--json``."""
        return self._kept.json()

    def to_dict(self) -> Any:
        """The same as dicts, lists, numbers and strings."""
        return json.loads(self.to_json())

    def _table(self) -> Table:
        raise UsageError(f"a result of `{self._kept.kind}` is not a table")

    def to_pandas(self) -> Any:
        """The result as a pandas ``DataFrame``: its table, one row per step, level, point, visited design or sensor."""
        return self._table().to_pandas()

    def to_polars(self) -> Any:
        """The same table as a polars ``DataFrame``."""
        return self._table().to_polars()

    def to_xarray(self) -> Any:
        """The result as an xarray ``Dataset``, with units as attributes."""
        return self._table().to_xarray()

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Saves the result in a folder that the command line can also read, and returns the folder."""
        self._kept.save(folder)
        return Path(folder)

    @classmethod
    def load(cls, folder: str | os.PathLike[str]) -> Self:
        """Loads a result that :meth:`save` or the command line wrote."""
        return cls(Kept.load(folder))

    def report(self, path: str | os.PathLike[str], *others: Result) -> Path:
        """Writes one HTML page with this result and others, which requires no network, and returns the path.

        Raises:
            StorageError: If it cannot be written.
        """
        page = self._kept.report([other._kept for other in others])
        return written(path, page.encode())

    @property
    def plot(self) -> Plots:
        """Figures of this result."""
        return Plots(self)

    def __reduce__(self) -> tuple[Any, ...]:
        with tempfile.TemporaryDirectory() as folder:
            self.save(folder)
            files = {path.name: path.read_bytes() for path in Path(folder).iterdir()}
        return _unpacked, (type(self), files)

    def _summary(self) -> list[tuple[str, str]]:
        return []

    def __repr__(self) -> str:
        rows = self._summary()
        width = max((len(name) for name, _ in rows), default=0)
        return "\n".join([type(self).__name__, *(f"  {name:<{width}}  {text}" for name, text in rows)])

    def _repr_html_(self) -> str:
        return _html.table(type(self).__name__, self._summary())


def _unpacked(kind: type[Result], files: Mapping[str, bytes]) -> Result:
    with tempfile.TemporaryDirectory() as folder:
        for name, content in files.items():
            (Path(folder) / name).write_bytes(content)
        return kind.load(folder)


@dataclass(frozen=True, eq=False, repr=False)
class Information(Record):
    """The information that designs minimise, measured, used or needed as the goal says: the weighted sum over the tasks.

    Attributes:
        nats: In nats.
        bits: In bits.
        bits_per_second: Bits divided by the time that the measurements of all tasks take, weighted alike, s.
    """

    nats: float
    bits: float
    bits_per_second: float


@dataclass(frozen=True, eq=False, repr=False)
class Prices(Record):
    """Prices of the parameters of a design.

    Attributes:
        total: The sum, in units of the budget.
        budget: Limit on the sum; ``None`` if there is no budget.
        weight_nats_per_unit: Weight of one unit of price in the objective, nats.
        objective_nats: The objective: information plus weighted price, nats.
        parameters: The price of each parameter that has one.
    """

    total: float
    budget: float | None
    weight_nats_per_unit: float
    objective_nats: float
    parameters: dict[str, float]


class _Evaluated:
    """The attributes of one evaluated design, from the dict of an evaluation."""

    def __init__(self, data: Mapping[str, Any], about: Mapping[str, Any]) -> None:
        self.parameters: dict[str, float] = dict(data["parameters"])
        self.feasible: bool = data["feasible"]
        self.feasibility = float(data["feasibility"])
        self.price: Prices | None = build(Prices, data["price"]) if data.get("price") else None
        self.tasks: dict[str, TaskReport] = {task["name"]: build(TaskReport, task) for task in data["tasks"]}
        objective = data["objective"]
        nats, bits = objective["information_nats"], objective["information_bits"]
        reports = [task.information for task in self.tasks.values()]
        weights = [task["information_weight"] for task in about["tasks"]]
        seconds = sum(
            weight * report.total_bits / report.bits_per_second
            for weight, report in zip(weights, reports, strict=True)
            if report.bits_per_second > 0
        )
        # Where nothing is measured, nothing is used or needed.
        rate = bits / seconds if seconds > 0 else 0.0
        self.information = Information(nats=nats, bits=bits, bits_per_second=rate)
        self._is_weighted = any(weight != 1.0 for weight in weights)
        kinds: dict[str, list[float | None]] = {
            "measured": [report.total_bits for report in reports],
            "used": [None if report.used is None else report.used.total_bits for report in reports],
            "needed": [None if report.needed is None else report.needed.total_bits for report in reports],
        }
        self._kind = next((kind for kind, each in kinds.items() if _adds_up(weights, each, bits)), "minimised")

    def summary(self) -> list[tuple[str, str]]:
        rows = [(name, f"{value:.6g}") for name, value in self.parameters.items()]
        label = f"{'weighted ' if self._is_weighted else ''}information {self._kind}"
        rows.append((label, f"{self.information.bits:.6g} bits, {self.information.bits_per_second:.6g} bits/s"))
        for name, task in self.tasks.items():
            bound = "" if task.cost.bound is None else f" of at most {task.cost.bound:.6g}"
            status = "" if task.status == "converged" else f" ({task.status})"
            rows.append(
                (name, f"{task.information.total_bits:.6g} bits measured, cost {task.cost.expected:.6g}{bound}{status}")
            )
        rows.append(("feasible", "yes" if self.feasible else "no"))
        if all(task.monte_carlo is None for task in self.tasks.values()):
            rows.append(("roll-outs", "none: with `rollouts=200`, they tell whether these predictions hold"))
        rows.extend(("warning", warning) for name, task in self.tasks.items() for warning in _doubts(name, task))
        return rows


def _adds_up(weights: list[float], bits: list[float | None], total: float) -> bool:
    """Whether a total is the weighted sum of one kind of information of each task."""
    known = [one for one in bits if one is not None]
    return len(known) == len(bits) and math.isclose(
        sum(weight * one for weight, one in zip(weights, known, strict=True)), total, rel_tol=1e-9, abs_tol=1e-12
    )


def _doubts(name: str, task: TaskReport) -> list[str]:
    """Why the numbers of a task cannot be trusted."""
    trust = task.trust
    reasons = list(trust.reasons) if trust is not None and trust.verdict != "holds" else []
    if task.stability.numerically_unstable:
        reasons.append(task.stability._advice())
    return [*task.warnings, *(f"task `{name}`: {reason}" for reason in reasons)]


class _OfDesign(Result):
    """A result that mainly concerns one design."""

    def _whole(self) -> Mapping[str, Any]:
        """The dict of its evaluation."""
        return self._data

    @cached_property
    def _evaluated(self) -> _Evaluated:
        return _Evaluated(self._whole(), self.made["about"])

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters of the design by name."""
        return self._evaluated.parameters

    @property
    def information(self) -> Information:
        """The weighted sum of the tasks' information of the kind that is minimised."""
        return self._evaluated.information

    @property
    def feasible(self) -> bool:
        """Whether every plan converged, every task is within its cost limit, and the price is within the budget."""
        return self._evaluated.feasible

    @property
    def feasibility(self) -> float:
        """The relative tolerance by which an expected cost may exceed its limit and still count as feasible."""
        return self._evaluated.feasibility

    @property
    def price(self) -> Prices | None:
        """Prices of the parameters; ``None`` if none has a price."""
        return self._evaluated.price

    @property
    def tasks(self) -> dict[str, TaskReport]:
        """Each task by name."""
        return self._evaluated.tasks

    @property
    def warnings(self) -> list[str]:
        """Reasons not to trust the numbers, for all tasks; empty if there are none.

        The reasons of roll-outs are among them where their verdict is ``"doubtful"`` or ``"broken"``.
        """
        return [warning for name, task in self.tasks.items() for warning in _doubts(name, task)]

    def _table(self) -> Table:
        return _frames.trajectories(self.tasks.values())

    def to_xarray(self, task: str | None = None) -> Any:
        """The plan of a task as an xarray ``Dataset`` over time, states and controls, with units.

        Args:
            task: Name of the task. Required if there are several.
        """
        return _frames.trajectory_dataset(self.tasks[self._task_name(task)])

    def controller(self, task: str | None = None) -> Controller:
        """The controller of a task at this design, for use on a robot; :class:`Controller` describes what it computes.

        Args:
            task: Name of the task. Required if there are several.
        """
        return self._controller(task, None)

    def _controller(self, task: str | None, at: str | None) -> Controller:
        name = self._task_name(task)
        if self.tasks[name].trajectory is None:
            raise UsageError("the result holds no trajectories: make it with `trajectories=True`")
        native = None if self.task is None else self.task._native
        return Controller._of(NativeController.of(self._kept, native, name=name, at=at), (self, name, at))

    def _task_name(self, task: str | None) -> str:
        """The name of the requested task, which is optional if there is only one."""
        if task is None and len(self.tasks) > 1:
            raise UsageError(f"there are several tasks: give task= one of {', '.join(self.tasks)}")
        name = next(iter(self.tasks)) if task is None else task
        if name not in self.tasks:
            raise UsageError(f"there is no task `{name}`: give task= one of {', '.join(self.tasks)}")
        return name

    def _summary(self) -> list[tuple[str, str]]:
        return self._evaluated.summary()


class Evaluation(_OfDesign):
    """One design, evaluated."""

    kind = "evaluate"


@dataclass(frozen=True, eq=False, repr=False)
class Start(Record):
    """One start of a search; the command line's JSON has the same keys.

    Attributes:
        status: How it ended.
        to: All parameters where it ended.
        information_nats: The information there, nats; NaN if nothing could be evaluated.
        price: The sum of the parameters' prices there.
        expected_costs: Expected cost of each task there, (tasks,).
        violation: How far the worst task exceeds its cost limit, relative to the limit.
        optimality: First-order optimality.
        branches: Number of different local minima of the plans encountered at the end, of the task that has most.
        evaluations: Designs evaluated.
        evaluations_without_contact: Number of these designs whose plan misses a contact.
        interrupted: Whether it ended on request before it was done, whatever its status.
        error: Why it ended early; ``None`` if it did not.
    """

    status: str
    to: dict[str, float]
    information_nats: float
    price: float
    expected_costs: Array
    violation: float
    optimality: float
    branches: int
    evaluations: int
    evaluations_without_contact: int
    interrupted: bool
    error: str | None


@dataclass(frozen=True, eq=False, repr=False)
class ChosenEntry(Record):
    """An entry of a catalogue that was chosen.

    Attributes:
        parameter: The parameter.
        value: The value, in its unit.
        name: The manufacturer's name for it.
        price: Its purchase price.
        continuous: The value of the best design without catalogues.
    """

    parameter: str
    value: float
    name: str | None
    price: float | None
    continuous: float


@dataclass(frozen=True, eq=False, repr=False)
class ContinuousOptimum(Record):
    """The best design without catalogues.

    Attributes:
        status: How its search ended.
        parameters: All parameters.
        information_bits: Its objective, bits.
        expected_costs: Expected cost of each task, (tasks,).
        violation: How far the worst task exceeds its cost limit, relative to the limit.
    """

    status: str
    parameters: dict[str, float]
    information_bits: float
    expected_costs: Array
    violation: float


@dataclass(frozen=True, eq=False, repr=False)
class CombinationReport(Record):
    """A combination of entries of catalogues, with the other parameters optimised.

    Attributes:
        status: How its search ended; if only catalogue parameters are designed, whether it meets every cost limit.
        parameters: All parameters.
        information_bits: Its objective, bits.
        violation: How far the worst task exceeds its cost limit, relative to the limit.
    """

    status: str
    parameters: dict[str, float]
    information_bits: float
    violation: float


@dataclass(frozen=True, eq=False, repr=False)
class CatalogueReport(Record):
    """The catalogue entries that a design search selected; the command line's JSON has the same keys.

    Attributes:
        method: ``all_combinations``: all were designed. ``neighbourhood``: rounded, and exchanged for better neighbours.
        combinations: Number of combinations of entries.
        designed: Number of combinations that were designed, including failures.
        feasible: Number of combinations that meet every cost limit.
        failed: Number of combinations that could not be designed.
        error: Why the first of these failed.
        complete: Whether the selection was completed: all were tried, or no neighbour of the chosen one is better.
        chosen: The chosen entry of each catalogue.
        price: Their total price; ``None`` if an entry has no price.
        continuous: The best design without catalogues.
        gap_bits: Objective of the chosen design minus that of ``continuous``, bits, with weighted prices included; ``None`` if
            either exceeds a cost limit, or if entries have prices that count, which ``continuous`` does not include.
        best: The best combinations, the chosen one first: at most 10.
    """

    method: str
    combinations: int
    designed: int
    feasible: int
    failed: int
    error: str | None
    complete: bool
    chosen: list[ChosenEntry]
    price: float | None
    continuous: ContinuousOptimum
    gap_bits: float | None
    best: list[CombinationReport]


class Design(_OfDesign):
    """The best design that a search found, and the record of the search; parameters, information and tasks are its own."""

    kind = "design"

    def _whole(self) -> Mapping[str, Any]:
        found: Mapping[str, Any] = self._data["optimum"]
        return found

    @property
    def status(self) -> str:
        """``converged``, ``not_optimal``, ``not_converged``, ``bound_violated`` or ``stopped``."""
        return str(self._data["status"])

    @property
    def active_bounds(self) -> list[str]:
        """Tasks whose cost limit is active."""
        return list(self._data["active_bounds"])

    @property
    def bound_prices(self) -> dict[str, float]:
        """Shadow prices: nats that one more unit of each task's cost limit would save."""
        return {price["task"]: price["nats_per_unit"] for price in self._data["bound_prices"]}

    @property
    def budget_nats_per_unit(self) -> float:
        """Nats that one more unit of budget would save; 0 if there is no budget or it is not exhausted."""
        return float(self._data["budget_nats_per_unit"])

    @property
    def evaluations(self) -> int:
        """Designs evaluated."""
        return int(self._data["evaluations"])

    @property
    def evaluations_without_contact(self) -> int:
        """Number of these designs whose plan never makes a contact whose force a cost tracks."""
        return int(self._data.get("evaluations_without_contact", 0))

    @property
    def seconds(self) -> float:
        """Wall time of the search, s."""
        return float(self._data["seconds"])

    @property
    def report_seconds(self) -> float:
        """Wall time of the evaluation of start and optimum after the search, s."""
        return float(self._data.get("report_seconds", 0.0))

    @cached_property
    def catalogue(self) -> CatalogueReport | None:
        """The selected entries, if parameters have catalogues."""
        found = self._data.get("catalogue")
        return None if found is None else build(CatalogueReport, found)

    @cached_property
    def split(self) -> dict[str, Split]:
        """Where the change of each task's measured information comes from; empty if the search was stopped, and for plans that
        have no total gradient."""
        return {of["task"]: build(Split, of) for of in self._data.get("split", [])}

    @cached_property
    def starts(self) -> list[Start]:
        """Every start; starts ignore catalogues."""
        return [build(Start, start) for start in self._data["starts"]]

    def controller(self, task: str | None = None, *, at: str = "optimum") -> Controller:
        """The controller of a task, for use on a robot; :class:`Controller` describes what it computes.

        Args:
            task: Name of the task. Required if there are several.
            at: The design: ``optimum``, the best design, or ``start``, the design at which the search began.
        """
        check_choice("at", [at], ["optimum", "start"])
        return self._controller(task, at)

    @cached_property
    def _start(self) -> _Evaluated:
        return _Evaluated(self._data["start"], self.made["about"])

    @property
    def start_parameters(self) -> dict[str, float]:
        """The design at which the first start began."""
        return self._start.parameters

    @property
    def start_information(self) -> Information:
        """Its information."""
        return self._start.information

    def _summary(self) -> list[tuple[str, str]]:
        found = f"{self.status}, {len(self.starts)} starts, {self.evaluations} designs in {self.seconds:.3g} s"
        rows = [("status", found)]
        if self.catalogue is not None:
            for entry in self.catalogue.chosen:
                named = "" if entry.name is None else f"{entry.name}, "
                rows.append(
                    (f"chosen {entry.parameter}", f"{named}{entry.value:.6g} (without: {entry.continuous:.6g})")
                )
            if self.catalogue.gap_bits is not None:
                rows.append(("more than without catalogues", f"{self.catalogue.gap_bits:.6g} bits"))
        return [*rows, *super()._summary()]
