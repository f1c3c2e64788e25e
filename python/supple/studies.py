"""Results of studies of many designs or noise levels, and loading of results of any kind."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _frames, _html
from ._records import Array, Record, build
from ._supple import Kept
from .bounds import Bounds
from .reports import Trust
from .results import Design, Evaluation, Result
from .sensors import Sensors
from .table import Table, dataset

__all__ = ["Comparison", "Pareto", "ParetoPoint", "RobustDesign", "Robustness", "RobustnessCell"]
__all__ += ["Sweep", "Trace", "TracePoint", "TraceRun", "load_result"]


class Sweep(Result):
    """Designs on a grid, each evaluated."""

    kind = "sweep"

    @cached_property
    def table(self) -> Table:
        """One row per design; the last axis changes fastest."""
        columns = self._data["columns"]
        return Table(
            self._kept.columns(),
            units={column["name"]: column["unit"] for column in columns},
            descriptions={column["name"]: column["description"] for column in columns},
            kinds=dict(self._kept.kinds()),
        )

    def _table(self) -> Table:
        return self.table

    def to_xarray(self) -> Any:
        """The table as an xarray ``Dataset`` along the axes of the grid, with units and descriptions as attributes."""
        axes = tuple(self.axes)
        variables = {name: (axes, self.grid(name)) for name in self.table if name not in axes}
        return dataset(variables, self.table.units, self.table.descriptions, self.axes)

    @property
    def axes(self) -> dict[str, Array]:
        """Values along each axis."""
        return {axis["parameter"]: axis["values"] for axis in self._data["options"]["axes"]}

    def grid(self, column: str) -> NDArray[Any]:
        """A column in the shape of the grid; strings, such as ``press.status``, as an array of objects."""
        values = self.table[column]
        if isinstance(values, list):
            texts = np.empty(len(values), dtype=object)
            texts[:] = values
            values = texts
        found: NDArray[Any] = values.reshape([len(values) for values in self.axes.values()])
        return found

    def _summary(self) -> list[tuple[str, str]]:
        rows = [
            (name, f"{len(values)} values, {min(values):.6g} to {max(values):.6g}")
            for name, values in self.axes.items()
        ]
        return [("designs", str(len(self.table))), *rows]

    def _repr_html_(self) -> str:
        return _html.table("Sweep", self._summary()) + self.table._repr_html_()


@dataclass(frozen=True, eq=False, repr=False)
class RobustDesign(Record):
    """A design of a robustness study.

    Attributes:
        name: Its name.
        parameters: All parameters.
        information_nats: Its information, nats.
        status: How its search ended; ``None`` if it was given.
        warnings: Reasons not to trust its numbers.
    """

    name: str
    parameters: dict[str, float]
    information_nats: float
    status: str | None
    warnings: list[str]


@dataclass(frozen=True, eq=False, repr=False)
class RobustnessCell(Record):
    """Costs of one design in one task at one level of noise, planned for the ``nominal`` noise or the ``truth``.

    Attributes:
        design: Index of the design.
        task: Index of the task.
        planned_for: ``nominal`` or ``truth``: the noise that the controller is planned for.
        level: Index of the level.
        mean: Mean cost; NaN if a roll-out diverged.
        deviation: Standard deviation of the cost over roll-outs.
        half_width_95: Half-width of the 95 % confidence interval of the mean, in units of cost.
        quantiles: Quantiles of the cost at 5, 25, 50, 75 and 95 %, (5,).
        diverged: Number of roll-outs that diverged.
        expected: Predicted expected cost; ``None`` if the controller is not planned for the truth.
        error: Why it could not be computed; ``None`` on success.
    """

    design: int
    task: int
    planned_for: str
    level: int
    mean: float
    deviation: float
    half_width_95: float
    quantiles: Array
    diverged: int
    expected: float | None
    error: str | None


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Record):
    """Comparison of the growth of cost between two designs, roll-out by roll-out.

    Attributes:
        task: Index of the task.
        planned_for: ``nominal`` or ``truth``.
        design: Index of the design.
        other: Index of the design with which it is compared.
        levels: Indices of the least and the greatest level.
        growths: Growth of the design's cost and of the other's, (2,).
        difference: Growth of the design's cost minus growth of the other's.
        interval_95: Its 95 % confidence interval, (2,).
        p_value: p-value of the hypothesis that there is no difference.
    """

    task: int
    planned_for: str
    design: int
    other: int
    levels: list[int]
    growths: Array
    difference: float
    interval_95: Array
    p_value: float


class Robustness(Result):
    """Closed-loop costs as a noise grows."""

    kind = "robustness"

    @cached_property
    def designs(self) -> list[RobustDesign]:
        """The designs."""
        return [build(RobustDesign, design) for design in self._data["designs"]]

    @cached_property
    def cells(self) -> list[RobustnessCell]:
        """Costs by design, task, planning and level, in this order of nesting."""
        return [build(RobustnessCell, cell) for cell in self._data["cells"]]

    @cached_property
    def comparisons(self) -> list[Comparison]:
        """Pairwise comparisons of designs."""
        return [build(Comparison, comparison) for comparison in self._data["comparisons"]]

    def _table(self) -> Table:
        return _frames.robustness(self)

    @property
    def levels(self) -> Array:
        """Values of the parameter that grows."""
        levels: Array = self._data["options"]["vary"]["values"]
        return levels

    @property
    def varied(self) -> str:
        """The parameter that grows."""
        return str(self._data["options"]["vary"]["parameter"])

    def _summary(self) -> list[tuple[str, str]]:
        levels = self.levels
        rows = [("varied", f"{self.varied}, {levels.min():.3g} to {levels.max():.3g} in {len(levels)} levels")]
        return rows + [(design.name, f"{design.information_nats / math.log(2):.6g} bits") for design in self.designs]


@dataclass(frozen=True, eq=False, repr=False)
class ParetoPoint(Record):
    """A point of a Pareto front; the command line's JSON has the same keys.

    Attributes:
        factor: The factor by which all cost limits of the task are multiplied.
        bounds: The cost limits here; infinite if a task has none, (tasks,).
        status: How the search ended.
        parameters: All parameters.
        information_nats: The information that is minimised, by the weights in the task file, nats.
        task_nats: Measured information of each task, nats, (tasks,).
        costs: Expected cost of each task, (tasks,).
        prices: Shadow prices: nats that one more unit of each task's cost limit would save, (tasks,).
        price: Total price of its parameters; ``None`` if none has a price.
        at_ends: Parameters at a bound of their range.
        warnings: Reasons not to trust its numbers.
        trust: What roll-outs say of the linearisation of each task; empty without roll-outs.
    """

    factor: float
    bounds: Array
    status: str
    parameters: dict[str, float]
    information_nats: float
    task_nats: Array
    costs: Array
    prices: Array
    price: float | None
    at_ends: list[str]
    warnings: list[str]
    trust: list[Trust] = field(default_factory=list)


class Pareto(Result):
    """The Pareto front of information and cost."""

    kind = "pareto"

    @cached_property
    def points(self) -> list[ParetoPoint]:
        """Points by increasing factor of the cost limits: the tightest first."""
        return [build(ParetoPoint, point) for point in self._data["points"]]

    def _table(self) -> Table:
        return _frames.pareto(self)

    @property
    def remarks(self) -> list[str]:
        """Where cost limits become active along the front."""
        return [remark["text"] for remark in self._data["remarks"]]

    def _summary(self) -> list[tuple[str, str]]:
        rows = [(f"{point.factor:.6g}", f"{point.information_nats / math.log(2):.6g} bits") for point in self.points]
        return [("factor of bounds", "information"), *rows]


@dataclass(frozen=True, eq=False, repr=False)
class TracePoint(Record):
    """A visited design.

    Attributes:
        parameters: All parameters.
        information_nats: Its information, nats.
        costs: Expected cost of each task, (tasks,).
    """

    parameters: dict[str, float]
    information_nats: float
    costs: Array


@dataclass(frozen=True, eq=False, repr=False)
class TraceRun(Record):
    """One search from one start.

    Attributes:
        method: The optimiser.
        gradient: The gradient that it followed.
        start: Number of the start.
        status: How it ended.
        path: Designs in the order in which they were visited.
        steps: Indices in ``path`` of the designs to which the optimiser stepped.
        end: Where it ended: the best design.
        error: Why it ended early; ``None`` if it did not.
    """

    method: str
    gradient: str
    start: int
    status: str
    path: list[TracePoint]
    steps: list[int]
    end: TracePoint
    error: str | None


class Trace(Result):
    """The paths of searches."""

    kind = "trace"

    @cached_property
    def runs(self) -> list[TraceRun]:
        """One run per method, gradient and start."""
        return [build(TraceRun, run) for run in self._data["runs"]]

    def _table(self) -> Table:
        return _frames.trace(self)

    def _summary(self) -> list[tuple[str, str]]:
        return [
            (
                f"{run.method}, {run.gradient}, {run.start}",
                f"{run.status}, {run.end.information_nats / math.log(2):.6g} bits",
            )
            for run in self.runs
        ]


_ALL: tuple[type[Result], ...] = (Bounds, Design, Evaluation, Pareto, Robustness, Sensors, Sweep, Trace)
_KINDS = {kind.kind: kind for kind in _ALL}


def load_result(folder: str | os.PathLike[str]) -> Result:
    """Loads a result of any kind that ``save`` or the command line wrote."""
    kept = Kept.load(folder)
    return _KINDS.get(kept.kind, Result)(kept)
