"""The minimum information that a task requires."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from . import _frames
from ._records import Array, Record, build
from .errors import UsageError
from .reports import Trust, plan_rows
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
    """One line of the order of bounds.

    Attributes:
        what: Name of the number.
        bits_per_step: Bits per decision; ``None`` if it is not known.
        assumption: The assumptions under which it holds.
        ordered: Whether it belongs to the order: each such line is at most the next such line.
    """

    what: str
    bits_per_step: float | None
    assumption: str
    ordered: bool


@dataclass(frozen=True, eq=False, repr=False)
class Direction(Record):
    """A combination of states that is measured independently of the others: their information adds up.

    Attributes:
        bits: Its information, bits.
        coefficients: Coefficients of the states, n; the coefficient of the most significant state is 1.
        unit: The unit of the combination.
        deviation: The standard deviation of the noise, in this unit.
        text: The same as text.
    """

    bits: float
    coefficients: Array
    unit: str
    deviation: float
    text: str


@dataclass(frozen=True, eq=False, repr=False)
class SensorWindow(Record):
    """Measurements of the virtual sensor in a time window.

    Attributes:
        first: Its first decision.
        last: Its last decision.
        from_s: Time of the first decision, s.
        until_s: Time of the last decision, s.
        bits: Bits over the window.
        rank: Maximum number of quantities measured at a decision.
        strongest: The decision with the most bits.
        directions: The directions measured there, in descending order of bits.
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
    """The share of the information that concerns one state: bits over all decisions.

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
        rank: Maximum number of quantities that it measures at a decision.
        rank_per_step: Number of quantities at each decision, T.
        states: Names of the states, n.
        units: Their units, n; empty if they are not known.
        measured: The states that it measures, in descending order of bits.
        windows: Its measurements in each time window.
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
    """The minimum information that one task requires; the command line's JSON has the same keys.

    All rates are in bits per decision: of T controls, or of one step for a stationary task.

    Attributes:
        name: The task.
        stationary: Whether all numbers refer to the steady state, per step.
        status: How its plan ended.
        steps: T, the number of decisions that costs and totals cover; 1 for a stationary task.
        time_step_s: Time step, s.
        cost: The expected cost that is not exceeded, D.
        own_cost: The expected cost of the design with its own sensors; ``None`` if its filter has no steady state.
        minimum_cost: The expected cost with the state known exactly: no information achieves less.
        open_loop_cost: The expected cost without measurements; ``None`` if it is infinite.
        floor_bits_per_step: Stationary: the data-rate theorem. Otherwise the growth of the open loop, which is not a bound.
        floor_is_bound: Whether the floor is a bound.
        kostina_hassibi_bits_per_step: The bound of Kostina and Hassibi, stationary only.
        kostina_hassibi_vacuous: Why it does not apply, if it does not.
        closed_form_bits_per_step: The best closed-form bound.
        minimum_bits_per_step: The minimum directed information at the cost D over all sensors and controllers.
        minimum_lower_bits_per_step: The proved lower bound of the minimum; 0 if nothing is proved.
        proved: Whether the lower bound is proved, by interval arithmetic from a dual point.
        not_proved: Why it is not proved, if it is not.
        proof_distance: Relative distance of the numbers for which it is proved from the given ones.
        achieved_bits_per_step: The information of the virtual sensor, computed by its Kalman filter.
        achieved_cost: The expected cost with the virtual sensor.
        minimum_bits: The minimum over all T decisions.
        duality_gap_bits: Gap between ``minimum_bits_per_step`` and its lower bound, bits per decision.
        price_bits_per_cost: Bits over all decisions that one more unit of cost would save.
        newton_steps: Newton steps of the search.
        minimum_per_step_bits: Bits at each decision, T.
        quantiser_bits_per_step: Upper bound on the rate of prefix-free codes with scalar quantisers.
        control_bits_per_step: ``DI(x -> u)`` of the design.
        control_per_step_bits: The same at each decision, T.
        measurement_bits_per_step: ``DI(x -> y)`` of the design, for measurements that a decision follows.
        measurement_per_step_bits: The same at each decision, T.
        last_measurement_bits: Bits of the measurement at the end, which no decision follows.
        efficiency: The minimum divided by ``DI(x -> y)``, at the design's own cost.
        control_efficiency: The minimum divided by ``DI(x -> u)``, at the design's own cost.
        order: The bounds from the least to the greatest.
        remarks: Remarks on these numbers.
        warnings: Why the plan about which they hold cannot be trusted.
        trust: What roll-outs say of the linearisation about it; ``None`` without roll-outs, and in a steady state.
        virtual_sensor: A sensor that attains the minimum.
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
    warnings: list[str] = field(default_factory=list)
    trust: Trust | None = None


@dataclass(frozen=True, eq=False, repr=False)
class CurvePoint(Record):
    """The minimum information at one cost, bits per decision; NaN if it could not be computed.

    Attributes:
        cost: The expected cost that is not exceeded.
        minimum_bits_per_step: The minimum information, bits per decision.
        minimum_lower_bits_per_step: Its certified lower bound.
        closed_form_bits_per_step: A closed-form bound.
        error: Why it could not be computed; ``None`` on success.
    """

    cost: float
    minimum_bits_per_step: float
    minimum_lower_bits_per_step: float
    closed_form_bits_per_step: float
    error: str | None


class Bounds(Result):
    """The minimum information that each task of a design requires. With a single task, its attributes are also available here."""

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
        """The minimum against the cost of each task by name; empty if it was not requested."""
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
            rows += [("note", remark) for remark in task.remarks]
            rows += plan_rows(task.warnings, task.trust)
        return rows
