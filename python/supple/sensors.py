"""Results of sensor selection."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from . import _frames
from ._records import Record, build
from .reports import PlanCheck, plan_rows
from .results import Result
from .table import Table

__all__ = ["SensorSet", "SensorValue", "Sensors", "SensorsCertificate"]


@dataclass(frozen=True, eq=False, repr=False)
class SensorSet(Record):
    """A set of sensors.

    Attributes:
        sensors: Names, in the order of selection.
        expected_cost: Expected cost, summed over the tasks considered.
        information_bits: Directed information, bits.
        price: Total price.
        by: How it was obtained: ``given``, ``gain`` or ``gain_per_price`` (greedy), or ``search``.
    """

    sensors: list[str]
    expected_cost: float
    information_bits: float
    price: float
    by: str


@dataclass(frozen=True, eq=False, repr=False)
class SensorsCertificate(Record):
    """Bounds on any set within the limits, in units of the goal: expected cost from below, bits from above, or price
    from below.

    Attributes:
        bound: No set is better, according to the relaxed problem alone.
        certified_ratio: Guaranteed share of the best possible gain that the greedy set achieves; for prices, the bound divided by
            its price. ``None`` without a greedy set.
        search: How all sets were searched, ``exhaustive`` or ``branch_and_bound``; ``None`` if they were not.
        searched_bound: No set is better, according to the search.
        proved: Whether the search proved its set to be the best.
        ratio: The greedy set's share of the gain that is possible according to the search: exact if that is proved.
        tried: Number of sets and regions tried.
    """

    bound: float
    certified_ratio: float | None
    search: str | None
    searched_bound: float | None
    proved: bool
    ratio: float | None
    tried: int


@dataclass(frozen=True, eq=False, repr=False)
class SensorValue(Record):
    """The worth of one sensor.

    Attributes:
        name: Its name.
        kind: Its kind.
        price: Its price.
        chosen: Whether it is in the chosen set.
        saved_alone: Expected cost that it saves as the only candidate.
        saved_beyond_others: Expected cost that it saves in addition to all other candidates.
        saved_in_set: Expected cost that it saves, or would save, in the chosen set.
        bits_alone: Bits that it measures as the only candidate.
        bits_beyond_others: Bits that it measures in addition to all other candidates.
        saved_alone_per_price: Expected cost that it saves alone, per unit of price; ``None`` without a price.
        weight: Its weight in the relaxed problem at the point of the certificate, 0 to 1.
    """

    name: str
    kind: str
    price: float
    chosen: bool
    saved_alone: float
    saved_beyond_others: float
    saved_in_set: float
    bits_alone: float
    bits_beyond_others: float
    saved_alone_per_price: float | None
    weight: float


class Sensors(Result):
    """The best set of sensors, the worth of each sensor, and a bound on any set."""

    kind = "sensors"

    @cached_property
    def chosen(self) -> SensorSet:
        """The chosen set: the better of the greedy set and the set of the search."""
        return build(SensorSet, self._data["chosen"])

    @cached_property
    def greedy(self) -> SensorSet | None:
        """The greedy set; ``None`` if it does not meet the cost limit."""
        return self._set("greedy")

    @cached_property
    def best(self) -> SensorSet | None:
        """The best set of the search; ``None`` if there was no search."""
        return self._set("best")

    @cached_property
    def none(self) -> SensorSet:
        """Without candidates, but with the measurements that are always present."""
        return build(SensorSet, self._data["none"])

    @cached_property
    def all(self) -> SensorSet:
        """With all candidates, regardless of the limits."""
        return build(SensorSet, self._data["all"])

    @cached_property
    def certificate(self) -> SensorsCertificate:
        """Bounds on any set."""
        return build(SensorsCertificate, self._data["certificate"])

    @cached_property
    def sensors(self) -> dict[str, SensorValue]:
        """The worth of every candidate, by name."""
        return {sensor["name"]: build(SensorValue, sensor) for sensor in self._data["sensors"]}

    @property
    def tasks(self) -> list[str]:
        """The tasks considered."""
        return list(self._data["tasks"])

    @property
    def remarks(self) -> list[str]:
        """What a reader should know: which measurements are one candidate, as their noise is correlated; that the plan depends on
        the sensors; that a budget limits nothing."""
        return list(self._data.get("remarks", []))

    @cached_property
    def plans(self) -> dict[str, PlanCheck]:
        """What speaks against the plan of each task, which is made with all candidates, by task."""
        return {plan["task"]: build(PlanCheck, plan) for plan in self._data.get("plans", [])}

    def _set(self, name: str) -> SensorSet | None:
        found = self._data[name]
        return None if found is None else build(SensorSet, found)

    def _table(self) -> Table:
        return _frames.sensors(self)

    def _summary(self) -> list[tuple[str, str]]:
        rows = [
            ("chosen", ", ".join(self.chosen.sensors) or "none"),
            ("expected cost", f"{self.chosen.expected_cost:.6g}, {self.none.expected_cost:.6g} without"),
            ("information", f"{self.chosen.information_bits:.6g} bits"),
            ("price", f"{self.chosen.price:.6g}"),
        ]
        for name, sensor in self.sensors.items():
            rows.append(
                (name, f"saves {sensor.saved_alone:.6g} alone, {sensor.saved_beyond_others:.6g} beyond all others")
            )
        rows += [("note", remark) for remark in self.remarks]
        for plan in self.plans.values():
            rows += plan_rows(plan.warnings, plan.trust)
        return rows
