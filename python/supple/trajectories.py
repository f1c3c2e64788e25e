"""Plans over time. Names are those of the command line's JSON."""

from __future__ import annotations

from dataclasses import dataclass, field

from ._records import Array, Flags, Record

__all__ = ["ContactCurve", "CostCurve", "MeasurementReport", "QuantityCurve", "SampleRun", "TrajectoryReport"]


@dataclass(frozen=True, eq=False, repr=False)
class MeasurementReport(Record):
    """The information of a measurement at each step.

    Attributes:
        name: Its name.
        alone_nats: Nats without the other measurements at this step, (N+1,).
        beyond_others_nats: Nats in addition to the other measurements, (N+1,).
        saved_cost: Expected cost that it saves, (N,).
    """

    name: str
    alone_nats: Array
    beyond_others_nats: Array
    saved_cost: Array


@dataclass(frozen=True, eq=False, repr=False)
class SampleRun(Record):
    """One closed-loop roll-out: true states and estimates (N+1, n), their deviations, controls (N, m), cost.

    Attributes:
        seed: Seed of its noise.
        states: True states, (N+1, n).
        estimates: Estimates of the filter, (N+1, n).
        deviations: Standard deviations of the estimates according to the filter, (N+1, n).
        controls: Controls, (N, m).
        measurements: Measurements, (N+1, p).
        cost: Its cost; infinite if it diverged.
    """

    seed: int
    states: Array
    estimates: Array
    deviations: Array
    controls: Array
    measurements: Array
    cost: float


@dataclass(frozen=True, eq=False, repr=False)
class ContactCurve(Record):
    """A contact over time, along the plan and along the closed-loop roll-out ``sample``.

    Attributes:
        name: Its name.
        force_N: Normal force along the plan, N, (N+1,).
        clearance_m: Clearance along the plan, m, (N+1,); negative if the body penetrates the wall.
        touches: Whether it touches, as in :class:`supple.reports.ContactReport`, (N+1,).
        run_force_N: Normal force along the roll-out, N, (N+1,); shorter if it diverged.
        run_clearance_m: Clearance along the roll-out, m, (N+1,); shorter if it diverged.
    """

    name: str
    force_N: Array
    clearance_m: Array
    touches: Flags
    run_force_N: Array
    run_clearance_m: Array


@dataclass(frozen=True, eq=False, repr=False)
class CostCurve(Record):
    """A term of the cost along the plan, without noise.

    Attributes:
        name: Its place among the costs of the task, from 1, and its kind: ``2 contact_force``.
        per_step: What it adds at each step and at the end, (N+1,).
    """

    name: str
    per_step: Array


@dataclass(frozen=True, eq=False, repr=False)
class QuantityCurve(Record):
    """A number over time that a cost weighs, a limit bounds or the task shows.

    Attributes:
        name: Its name: ``normal force of wall``.
        unit: Its unit; empty if it is not known.
        of: What asks for it: ``cost 2``, ``limit 1`` or ``curve 3``, counted from 1.
        values: Along the plan, (N+1,), or (N,) if it depends on the control.
        run_values: Along the closed-loop roll-out ``sample``; shorter if it diverged.
        target: The target of a cost, if there is one.
        lower: The lower limit, if there is one.
        upper: The upper limit, if there is one.
    """

    name: str
    unit: str
    of: str
    values: Array
    run_values: Array
    target: float | None = None
    lower: float | None = None
    upper: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class TrajectoryReport(Record):
    """A plan's trajectory and controller; ``n`` states, ``m`` controls, ``N`` steps.

    Attributes:
        state_names: Names of the states.
        state_units: Their units; empty if they are not known.
        control_names: Names of the controls.
        control_units: Their units.
        time: Time of each state, s, (N+1,).
        states: (N+1, n).
        deviations: Standard deviations of the belief, (N+1, n).
        controls: Controls ``ubar``, (N, m).
        feedforward: ``k``, zero up to rounding if the plan is stationary, (N, m).
        feedback: Gains ``K`` of ``u = ubar + k + K (estimate - xbar)``, (N, m, n).
        measurements: The information of each measurement.
        sample: One closed-loop roll-out.
        threads: True states of further roll-outs, up to 20 of those requested, each (N+1, n); shorter if it diverged.
        contacts: The contacts over time by name; empty if the model has none or does not report them.
        costs: The terms of the cost over time by name; empty if the cost has only one.
        quantities: What costs weigh, limits bound and the task shows, over time.
    """

    state_names: list[str]
    state_units: list[str]
    control_names: list[str]
    control_units: list[str]
    time: Array
    states: Array
    deviations: Array
    controls: Array
    feedforward: Array
    feedback: Array
    measurements: dict[str, MeasurementReport]
    sample: SampleRun
    threads: list[Array] = field(default_factory=list)
    contacts: dict[str, ContactCurve] = field(default_factory=dict)
    costs: dict[str, CostCurve] = field(default_factory=dict)
    quantities: list[QuantityCurve] = field(default_factory=list)

    @property
    def t(self) -> Array:
        """Time of each state, s, (N+1,)."""
        return self.time

    @property
    def x(self) -> Array:
        """States, (N+1, n)."""
        return self.states

    @property
    def u(self) -> Array:
        """Controls, (N, m)."""
        return self.controls

    @property
    def K(self) -> Array:
        """Feedback gains, (N, m, n)."""
        return self.feedback
