"""Derivatives compared with finite differences, and the linear system that a task is along its plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ._records import Array, Record

__all__ = ["CheckReport", "CheckedDerivative", "Fact", "Linearisation", "TaskCheck"]


@dataclass(frozen=True, eq=False, repr=False)
class CheckedDerivative(Record):
    """A derivative compared with finite differences, by the entry that is worst beside its tolerance.

    Attributes:
        name: Which derivative.
        error: Difference of the worst entry, relative to the scale of that entry.
        tolerance: How large it may be, with what the finite difference leaves uncertain.
        place: Where the worst entry is: a parameter, or states and a step.
        analytic: The worst entry.
        numeric: Its finite difference.
        unresolved: Entries too small beside rounding for an error of a thousandth to show.
        not_compared: Entries without a finite difference: no point beside the design could be evaluated.
        passed: Whether every entry was compared, and is within its tolerance.
    """

    name: str
    error: float
    tolerance: float
    place: str
    analytic: float
    numeric: float
    unresolved: list[str]
    not_compared: list[str]
    passed: bool


@dataclass(frozen=True, eq=False, repr=False)
class Fact(Record):
    """Something about the linearisation that decides how well the numbers can be trusted.

    Attributes:
        name: What it is.
        value: Its value.
        note: What it means here.
    """

    name: str
    value: float
    note: str


@dataclass(frozen=True, eq=False, repr=False)
class TaskCheck(Record):
    """What the check of one task found.

    Attributes:
        name: Its name.
        status: How its plan ended.
        stationarity: The largest gradient of the Hamiltonian by a control.
        rows: One entry per derivative.
        left_out: Designs beside this one that differences by parameters had to leave out, and why.
        facts: Conditioning and observability.
    """

    name: str
    status: str
    stationarity: float
    rows: list[CheckedDerivative]
    left_out: list[str]
    facts: list[Fact]


@dataclass(frozen=True, eq=False, repr=False)
class CheckReport(Record):
    """Every derivative of a problem compared with finite differences.

    Attributes:
        passed: Whether all agree.
        tasks: Each task by name.
    """

    passed: bool
    tasks: dict[str, TaskCheck]


@dataclass(frozen=True, eq=False, repr=False)
class Linearisation(Record):
    """The linear system that a task is along its plan; ``n`` states, ``m`` controls, ``p`` measurements, ``N`` steps.

    ``dx+ = A dx + B du + w`` and ``dy = C dx + v``, where ``dx`` and ``du`` are differences from the plan.

    Attributes:
        status: How the plan ended; numbers of a plan that is not ``converged`` are of no use.
        time_step: Length of a step, s.
        states: States of the plan, (N+1, n).
        controls: Its controls, (N, m).
        dynamics: ``A``, (N, n, n).
        input: ``B``, (N, n, m).
        measurement: ``C``, (N+1, p, n).
        cost_hessian: Second derivatives of the costs by state and control, (N+1, n+m, n+m).
        cost_gradient: First derivatives of the costs by state and control, (N+1, n+m).
        initial_covariance: ``X_0``, (n, n).
        process_covariance: ``W``, (N, n, n).
        measurement_covariance: ``V``, (N+1, p, p).
        feedback: ``K`` of ``du = K dx``, (N, m, n).
        cost_to_go: Curvature ``S`` of the cost-to-go, (N+1, n, n).
        belief_covariance: Covariance of the belief after each measurement, (N+1, n, n).
    """

    status: str
    time_step: float
    states: Array
    controls: Array
    dynamics: Array
    input: Array
    measurement: Array
    cost_hessian: Array
    cost_gradient: Array
    initial_covariance: Array
    process_covariance: Array
    measurement_covariance: Array
    feedback: Array
    cost_to_go: Array
    belief_covariance: Array

    @property
    def A(self) -> Array:
        """Dynamics, (N, n, n)."""
        return self.dynamics

    @property
    def B(self) -> Array:
        """Input, (N, n, m)."""
        return self.input

    @property
    def C(self) -> Array:
        """Measurement, (N+1, p, n)."""
        return self.measurement

    def system(self) -> dict[str, Any]:
        """The arguments of :func:`supple.linear` that are the system: ``A``, ``B``, ``C``, ``W``, ``V``, ``X0``."""
        return {
            "A": self.dynamics,
            "B": self.input,
            "C": self.measurement,
            "W": self.process_covariance,
            "V": self.measurement_covariance,
            "X0": self.initial_covariance,
        }
