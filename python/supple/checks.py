"""Derivatives compared with finite differences, and the linearisation of a task along its plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ._records import Array, Record

__all__ = ["CheckReport", "CheckedDerivative", "Fact", "Linearisation", "TaskCheck"]


@dataclass(frozen=True, eq=False, repr=False)
class CheckedDerivative(Record):
    """A derivative compared with finite differences, represented by its worst entry relative to the tolerance.

    Attributes:
        name: Name of the derivative.
        error: Difference of the worst entry, relative to the scale of that entry.
        tolerance: Its largest allowed value, including the uncertainty of the finite difference.
        place: Location of the worst entry: a parameter, or states and a step.
        analytic: The worst entry.
        numeric: Its finite difference.
        unresolved: Entries too small, relative to rounding, to resolve an error of a thousandth.
        not_compared: Entries without a finite difference: no point next to the design could be evaluated.
        passed: Whether every entry was compared and is within its tolerance.
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
    """A property of the linearisation that affects how far the numbers can be trusted.

    Attributes:
        name: Name of the property.
        value: Its value.
        note: Its meaning here.
    """

    name: str
    value: float
    note: str


@dataclass(frozen=True, eq=False, repr=False)
class TaskCheck(Record):
    """The result of checking one task.

    Attributes:
        name: Its name.
        status: How its plan ended.
        stationarity: The largest derivative of the Hamiltonian with respect to a control.
        rows: One entry per derivative.
        left_out: Neighbouring designs that finite differences had to omit, with reasons.
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
        passed: Whether all derivatives agree.
        tasks: Each task by name.
    """

    passed: bool
    tasks: dict[str, TaskCheck]


@dataclass(frozen=True, eq=False, repr=False)
class Linearisation(Record):
    """The linearisation of a task along its plan; ``n`` states, ``m`` controls, ``p`` measurements, ``N`` steps.

    ``dx+ = A dx + B du + w`` and ``dy = C dx + v``, where ``dx`` and ``du`` are deviations from the plan.

    Attributes:
        status: How the plan ended; do not use the numbers of a plan that is not ``converged``.
        time_step: Length of a step, s.
        states: States of the plan, (N+1, n).
        controls: Its controls, (N, m).
        dynamics: ``A``, (N, n, n).
        input: ``B``, (N, n, m).
        measurement: ``C``, (N+1, p, n).
        cost_hessian: Second derivatives of the costs with respect to state and control, (N+1, n+m, n+m).
        cost_gradient: First derivatives of the costs with respect to state and control, (N+1, n+m).
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
        """The arguments of :func:`supple.linear` that define the system: ``A``, ``B``, ``C``, ``W``, ``V``, ``X0``."""
        return {
            "A": self.dynamics,
            "B": self.input,
            "C": self.measurement,
            "W": self.process_covariance,
            "V": self.measurement_covariance,
            "X0": self.initial_covariance,
        }
