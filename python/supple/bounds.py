"""How little information would do."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from . import _frames
from ._records import Array, Record, build
from .errors import UsageError
from .results import Result
from .table import Table

__all__ = [
    "BoundReport",
    "Bounds",
    "CurvePoint",
    "Direction",
    "MeasuredState",
    "OrderLine",
    "SensorWindow",
    "VirtualSensor",
]


@dataclass(frozen=True, eq=False, repr=False)
class OrderLine(Record):
    """A line of the order of bounds.

    Attributes:
        what: Which number.
        bits_per_step: Bits by decision; ``None`` where it is not known.
        assumption: What it holds for.
        ordered: Whether it takes part in the order: each line that does is at most the next that does.
    """

    what: str
    bits_per_step: float | None
    assumption: str
    ordered: bool


@dataclass(frozen=True, eq=False, repr=False)
class Direction(Record):
    """A combination of states that is measured apart from the others: what they give adds up.

    Attributes:
        bits: What it gives, bits.
        coefficients: Those of the states, n; that of the state which counts most is 1.
        unit: The unit of the combination.
        deviation: The standard deviation of the noise, in this unit.
        text: The same in words.
    """

    bits: float
    coefficients: Array
    unit: str
    deviation: float
    text: str


@dataclass(frozen=True, eq=False, repr=False)
class SensorWindow(Record):
    """What the virtual sensor measures in a part of the time.

    Attributes:
        first: Its first decision.
        last: Its last one.
        from_s: Time of the first one, s.
        until_s: Time of the last one, s.
        bits: Bits over the window.
        rank: How many numbers are measured at a decision, at most.
        strongest: The decision with the most bits.
        directions: What is measured there, that with the most bits first.
    """

    first: int
    last: int
    from_s: float
    until_s: float
    bits: float
    rank: int
    strongest: int
    directions: list[Direction]


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredState(Record):
    """How much of the information is about one state: bits over all decisions.

    Attributes:
        state: Its name.
        unit: Its unit.
        bits: Bits over all decisions.
    """

    state: str
    unit: str
    bits: float


@dataclass(frozen=True, eq=False, repr=False)
class VirtualSensor(Record):
    """A sensor that attains the minimum with a Kalman filter and the optimal regulator.

    Attributes:
        rank: How many numbers it measures at a decision, at most.
        rank_per_step: How many at each decision, T.
        states: Names of the states, n.
        units: Their units, n; empty where they are not known.
        measured: Each state that it measures, that with the most bits first.
        windows: What it measures in each part of the time.
        measurement: ``C`` at each decision, rank x n, T of them.
        variances: The diagonal of ``V`` at each decision, rank, T of them.
        gain: The Kalman gain at each decision, n x rank, T of them.
    """

    rank: int
    rank_per_step: list[int]
    states: list[str]
    units: list[str]
    measured: list[MeasuredState]
    windows: list[SensorWindow]
    measurement: list[Array]
    variances: list[Array]
    gain: list[Array]


@dataclass(frozen=True, eq=False, repr=False)
class BoundReport(Record):
    """How little information would do for one task; the command line's JSON has the same keys.

    All rates are bits by decision: of T controls, or of one step where it is stationary.

    Attributes:
        name: The task.
        stationary: Whether all of it is about the steady state, per step.
        status: How its plan ended.
        steps: T, decisions that costs and totals are over; 1 where it is stationary.
        time_step_s: Time step, s.
        cost: The expected cost that is kept, D.
        own_cost: That of the design with its own sensors; ``None`` where its filter has no steady state.
        minimum_cost: That with the state known exactly: no information keeps less.
        open_loop_cost: That with nothing measured; ``None`` where it is infinite.
        floor_bits_per_step: Stationary: the data-rate theorem. Else the growth of the open loop, which is no bound.
        floor_is_bound: Whether the floor is a bound.
        kostina_hassibi_bits_per_step: The bound of Kostina and Hassibi, stationary only.
        kostina_hassibi_vacuous: Why it says nothing, where it does not.
        closed_form_bits_per_step: The best bound in closed form.
        minimum_bits_per_step: The least directed information at the cost D over all sensors and controllers.
        minimum_lower_bits_per_step: What is proved that it is not below; 0 where nothing is.
        proved: Whether that is proved, by intervals from a point of the dual.
        not_proved: Why it is not, where it is not.
        proof_distance: How far, relatively, the numbers that it is proved for are from those given.
        achieved_bits_per_step: What the virtual sensor achieves, by its Kalman filter.
        achieved_cost: The expected cost that the virtual sensor keeps.
        minimum_bits: The same over all T decisions.
        duality_gap_bits: Between ``minimum_bits_per_step`` and its lower bound, bits by decision.
        price_bits_per_cost: Bits over all decisions that a unit more of cost would save.
        newton_steps: Newton steps of the search.
        minimum_per_step_bits: Bits at each decision, T.
        quantiser_bits_per_step: What prefix-free codes with scalar quantisers need at most.
        control_bits_per_step: ``DI(x -> u)`` of the design.
        control_per_step_bits: The same at each decision, T.
        measurement_bits_per_step: ``DI(x -> y)`` of the design, of measurements that a decision follows.
        measurement_per_step_bits: The same at each decision, T.
        last_measurement_bits: Of the measurement at the end, which no decision follows.
        efficiency: The minimum over ``DI(x -> y)``, at the design's own cost.
        control_efficiency: The minimum over ``DI(x -> u)``, at the design's own cost.
        order: The bounds from the least to the greatest.
        remarks: What to know about these numbers.
        virtual_sensor: A sensor that needs no more than the minimum.
    """

    name: str
    stationary: bool
    status: str
    steps: int
    time_step_s: float
    cost: float
    own_cost: float | None
    minimum_cost: float
    open_loop_cost: float | None
    floor_bits_per_step: float
    floor_is_bound: bool
    kostina_hassibi_bits_per_step: float | None
    kostina_hassibi_vacuous: str | None
    closed_form_bits_per_step: float
    minimum_bits_per_step: float
    minimum_lower_bits_per_step: float
    proved: bool
    not_proved: str | None
    proof_distance: float | None
    achieved_bits_per_step: float | None
    achieved_cost: float | None
    minimum_bits: float
    duality_gap_bits: float
    price_bits_per_cost: float
    newton_steps: int
    minimum_per_step_bits: Array
    quantiser_bits_per_step: float
    control_bits_per_step: float | None
    control_per_step_bits: Array
    measurement_bits_per_step: float | None
    measurement_per_step_bits: Array
    last_measurement_bits: float | None
    efficiency: float | None
    control_efficiency: float | None
    order: list[OrderLine]
    remarks: list[str]
    virtual_sensor: VirtualSensor


@dataclass(frozen=True, eq=False, repr=False)
class CurvePoint(Record):
    """The least information at one cost, bits by decision; NaN where it could not be found.

    Attributes:
        cost: The expected cost to keep.
        minimum_bits_per_step: The least information, bits by decision.
        minimum_lower_bits_per_step: What it is certified to be at least.
        closed_form_bits_per_step: A floor in closed form.
        error: Why it could not be found; ``None`` where it was.
    """

    cost: float
    minimum_bits_per_step: float
    minimum_lower_bits_per_step: float
    closed_form_bits_per_step: float
    error: str | None


class Bounds(Result):
    """How little information would do for each task of a design. Of one task, its report's names are at hand here too."""

    kind = "bound"

    @cached_property
    def parameters(self) -> dict[str, float]:
        """All parameters by name."""
        return dict(self._data["parameters"])

    @cached_property
    def tasks(self) -> dict[str, BoundReport]:
        """The bounds of each task by name."""
        return {task["name"]: build(BoundReport, task) for task in self._data["tasks"]}

    @cached_property
    def curves(self) -> dict[str, list[CurvePoint]]:
        """The minimum over the cost of each task by name; empty where it was not asked for."""
        curves = self._data.get("curves") or []
        return {curve["task"]: [build(CurvePoint, point) for point in curve["points"]] for curve in curves}

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in BoundReport.__dataclass_fields__:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        if len(self.tasks) != 1:
            raise UsageError(f"{name}: there are several tasks; take one of .tasks: {', '.join(self.tasks)}")
        (report,) = self.tasks.values()
        return getattr(report, name)

    def _table(self) -> Table:
        return _frames.bounds(self)

    def _summary(self) -> list[tuple[str, str]]:
        rows = []
        for name, task in self.tasks.items():
            rows.append((name, f"cost {task.cost:.6g}, least {task.minimum_cost:.6g}"))
            rows += [
                (line.what, "not known" if line.bits_per_step is None else f"{line.bits_per_step:.6g} bits per step")
                for line in task.order
            ]
            if task.efficiency is not None:
                rows.append(("efficiency", f"{100.0 * task.efficiency:.4g} %"))
        return rows
