"""What evaluations report. Names are those of the command line's JSON."""

from __future__ import annotations

from dataclasses import dataclass, field

from ._records import Array, Record

__all__ = [
    "Consistency",
    "ContactReport",
    "ControllerReport",
    "CostReport",
    "Estimate",
    "FrozenGradient",
    "GradientReport",
    "InformationReport",
    "LimitViolation",
    "MeasurementReport",
    "MonteCarlo",
    "NeededInformation",
    "SampleRun",
    "Stability",
    "TaskReport",
    "TotalGradient",
    "TouchShare",
    "TrajectoryReport",
    "Trust",
]


@dataclass(frozen=True, eq=False, repr=False)
class CostReport(Record):
    """The expected cost of a task.

    Attributes:
        expected: The sum of the four parts.
        nominal: Cost of the trajectory without noise.
        belief: Price of an uncertain belief, ``1/2 sum Tr(Xi Sigma)``.
        process: Price of process noise, ``1/2 sum Tr(S W)``.
        initial: Price of the unknown start, ``1/2 Tr(S_0 X_0)``.
        bound: The bound; ``None`` where there is none.
        belief_per_step: ``1/2 Tr(Xi_t Sigma_t)``, (N,).
        value_of_information_per_step: ``Tr(Xi_t)``, (N,).
    """

    expected: float
    nominal: float
    belief: float
    process: float
    initial: float
    bound: float | None
    belief_per_step: Array
    value_of_information_per_step: Array


@dataclass(frozen=True, eq=False, repr=False)
class ControlInformation(Record):
    """The directed information from the state to the controls, exact for the linearised closed loop.

    Attributes:
        total_nats: Over the whole task, nats.
        total_bits: The same in bits.
        bits_per_step: Bits per control: the total over N.
        per_step_nats: Nats at each control, (N,).
    """

    total_nats: float
    total_bits: float
    bits_per_step: float
    per_step_nats: Array


@dataclass(frozen=True, eq=False, repr=False)
class NeededInformation(Record):
    """The least directed information over all sensors and controllers that keep an expected cost.

    Attributes:
        total_nats: Over the whole task, nats.
        total_bits: The same in bits.
        lower_bits: What it is not below, bits: the value of a dual point.
        cost: The expected cost that is kept.
    """

    total_nats: float
    total_bits: float
    lower_bits: float
    cost: float


@dataclass(frozen=True, eq=False, repr=False)
class InformationReport(Record):
    """The directed information of a task.

    Attributes:
        total_nats: Over the whole task, nats.
        total_bits: The same in bits.
        bits_per_step: Bits per measurement: the total over N + 1.
        bits_per_second: Bits per measurement and time step.
        entropy_form_nats: The entropy form, for comparison; ``None`` where a covariance is singular.
        paper_form_nats: The paper's printed form, for comparison; ``None`` where a covariance is singular.
        per_step_nats: Nats at each measurement, (N+1,).
        control: What of it reaches the controls; ``None`` in results of versions that did not find it.
        needed: What any sensors and any controller need at the least; ``None`` where it was not asked for.
    """

    total_nats: float
    total_bits: float
    bits_per_step: float
    bits_per_second: float
    entropy_form_nats: float | None
    paper_form_nats: float | None
    per_step_nats: Array
    control: ControlInformation | None = None
    needed: NeededInformation | None = None


@dataclass(frozen=True, eq=False, repr=False)
class TotalGradient(Record):
    """Derivatives by each parameter with everything moving.

    Attributes:
        valid: Whether the plan is stationary enough for the gradient to hold.
        information_nats: Of the directed information, nats per unit of the parameter.
        expected_cost: Of the expected cost.
        nominal_cost: Of its nominal part.
        belief_cost: Of its belief part.
        process_cost: Of its process noise part.
        initial_cost: Of its initial part.
    """

    valid: bool
    information_nats: dict[str, float]
    expected_cost: dict[str, float]
    nominal_cost: dict[str, float]
    belief_cost: dict[str, float]
    process_cost: dict[str, float]
    initial_cost: dict[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class FrozenGradient(Record):
    """Derivatives by each parameter with trajectory and controller held fixed, as in the paper.

    Attributes:
        information_nats: Of the directed information, nats per unit of the parameter.
        belief_cost: Of the belief's part of the expected cost.
        recursion_spectral_radius: The paper's recursion is stable where this is below 1.
    """

    information_nats: dict[str, float]
    belief_cost: dict[str, float]
    recursion_spectral_radius: float | None


@dataclass(frozen=True, eq=False, repr=False)
class GradientReport(Record):
    """Gradients of a task, where they were asked for.

    Attributes:
        total: With everything moving; ``None`` where it was not asked for.
        frozen: With the trajectory frozen; ``None`` where it was not asked for.
    """

    total: TotalGradient | None
    frozen: FrozenGradient | None


@dataclass(frozen=True, eq=False, repr=False)
class Stability(Record):
    """Whether the time step is short enough for the model.

    Attributes:
        time_step: Time step, s.
        spectral_radius: The largest spectral radius of ``A`` over the steps looked at.
        step: The step where it is.
        numerically_unstable: Whether the time step is too large there, and not the system itself unstable.
        suggested_time_step: A time step that is short enough, s; ``None`` where the present one is.
        suggested_substeps: How many sub-steps are short enough; ``None`` where the model has none, or needs no more.
    """

    time_step: float
    spectral_radius: float
    step: int
    numerically_unstable: bool
    suggested_time_step: float | None
    suggested_substeps: int | None


@dataclass(frozen=True, eq=False, repr=False)
class LimitViolation(Record):
    """A limit of the model that a plan violates.

    Attributes:
        name: What is limited.
        worst: The value that is furthest outside, in the unit of the state or control.
        limit: The limit, in the same unit.
        step: The first step at which the value is ``worst``.
        steps: At how many steps the value is outside.
    """

    name: str
    worst: float
    limit: float
    step: int
    steps: int


@dataclass(frozen=True, eq=False, repr=False)
class ContactReport(Record):
    """A contact of the model along the nominal trajectory, states 0 to N.

    It touches at a step where its clearance is below one smoothing length and its normal force above 1e-6 of stiffness
    times smoothing.

    Attributes:
        name: Its name.
        touches: Whether it touches at any step.
        first_s: Time of the first step at which it touches, s; ``None`` where it never does.
        last_s: Time of the last step at which it touches, s; ``None`` where it never does.
        share_of_time: Share of the N + 1 steps at which it touches, from 0 to 1.
        peak_force_N: The greatest normal force at a step at which it touches, N; 0 where it never does.
        mean_force_N: The mean normal force over the steps at which it touches, N; 0 where it never does.
        least_clearance_m: The least clearance, m; negative where the body is inside, by the greatest penetration.
        greatest_force_apart_N: The greatest norm of the whole force, friction included, at steps with a clearance of more
            than one smoothing length, N; 0 where there are none.
    """

    name: str
    touches: bool
    first_s: float | None
    last_s: float | None
    share_of_time: float
    peak_force_N: float
    mean_force_N: float
    least_clearance_m: float
    greatest_force_apart_N: float


@dataclass(frozen=True, eq=False, repr=False)
class ControllerReport(Record):
    """How much a controller changes over time.

    Attributes:
        feedback_variance: Temporal variance of the feedback gains.
        feedback_variation: Its root over the root mean square of the gains, from 0 to 1.
        feedforward_variance: Temporal variance of the feedforward.
        feedforward_variation: Its root over the root mean square of the feedforward, from 0 to 1.
    """

    feedback_variance: float
    feedback_variation: float
    feedforward_variance: float
    feedforward_variation: float


@dataclass(frozen=True, eq=False, repr=False)
class Consistency(Record):
    """The normalised innovation squared, a mean over measurements and runs: 1 of a consistent filter.

    Attributes:
        mean: The mean; more than 1 where the filter is too sure.
        lower: Where 95 % of the means of a consistent filter begin.
        upper: Where they end.
    """

    mean: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False, repr=False)
class Estimate(Record):
    """A mean of samples.

    Attributes:
        mean: The mean.
        standard_error: Its standard error.
    """

    mean: float
    standard_error: float


@dataclass(frozen=True, eq=False, repr=False)
class TouchShare(Record):
    """In how many runs a contact touched.

    Attributes:
        name: The contact.
        share: Share of the runs.
    """

    name: str
    share: float


@dataclass(frozen=True, eq=False, repr=False)
class Trust(Record):
    """Whether what is predicted is what runs do.

    Attributes:
        verdict: ``"holds"``, ``"doubtful"`` or ``"broken"``.
        reasons: What was found, and what to try.
    """

    verdict: str
    reasons: list[str]


@dataclass(frozen=True, eq=False, repr=False)
class MonteCarlo(Record):
    """A task in closed loop, sampled: with an extended Kalman filter, or with a :class:`supple.Controller`.

    Attributes:
        rollouts: How many runs there were.
        seed: Seed of their noise.
        diverged: How many diverged.
        cost_mean: Mean cost.
        cost_standard_error: Its standard error.
        difference: Mean less expected cost.
        consistency: Whether the filter's covariance is that of its errors; ``None`` where a run diverged.
        realised_bits: Information that the measurements gave; ``None`` where a run diverged or noise varies with the state.
        touched: Share of the runs in which each contact touched.
    """

    rollouts: int
    seed: int
    diverged: int
    cost_mean: float
    cost_standard_error: float
    difference: float
    consistency: Consistency | None = None
    realised_bits: Estimate | None = None
    touched: dict[str, TouchShare] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, repr=False)
class MeasurementReport(Record):
    """What a measurement gives at each step.

    Attributes:
        name: Its name.
        alone_nats: Nats that it gives where there is no other measurement at this step, (N+1,).
        beyond_others_nats: Nats that it gives beyond the others, (N+1,).
        saved_cost: Expected cost that it saves, (N,).
    """

    name: str
    alone_nats: Array
    beyond_others_nats: Array
    saved_cost: Array


@dataclass(frozen=True, eq=False, repr=False)
class SampleRun(Record):
    """One run in closed loop: true states and estimates (N+1, n), their deviations, controls (N, m), cost.

    Attributes:
        seed: Seed of its noise.
        states: True states, (N+1, n).
        estimates: Estimates of the filter, (N+1, n).
        deviations: Standard deviations that the filter gives them, (N+1, n).
        controls: Controls, (N, m).
        measurements: What was measured, (N+1, p).
        cost: Its cost; infinite where it diverged.
    """

    seed: int
    states: Array
    estimates: Array
    deviations: Array
    controls: Array
    measurements: Array
    cost: float


@dataclass(frozen=True, eq=False, repr=False)
class TrajectoryReport(Record):
    """A plan's trajectory and controller; ``n`` states, ``m`` controls, ``N`` steps.

    Attributes:
        state_names: Names of the states.
        state_units: Their units; empty where they are not known.
        control_names: Names of the controls.
        control_units: Their units.
        time: Time of each state, s, (N+1,).
        states: (N+1, n).
        deviations: Standard deviations of the belief, (N+1, n).
        controls: Controls ``ubar``, (N, m).
        feedforward: ``k``, zero but for rounding where the plan is stationary, (N, m).
        feedback: Gains ``K`` of ``u = ubar + k + K (estimate - xbar)``, (N, m, n).
        measurements: What each measurement gives.
        sample: One run in closed loop.
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


@dataclass(frozen=True, eq=False, repr=False)
class TaskReport(Record):
    """One task at one design.

    Attributes:
        name: Its name.
        status: How its plan ended: ``converged``, ``max_iterations``, ``line_search_stalled``, ``slow_progress``,
            ``time_limit`` or ``indefinite``.
        iterations: Iterations of its plan, from the guess that led there.
        stationarity: The largest gradient of the Hamiltonian by a control.
        relative_stationarity: The same, relative to 1 plus the largest ``|l_u|``.
        regularised_iterations: Iterations that had to raise the regularisation.
        belief_repairs: How often rounding in the belief had to be mended.
        branches: Different local minima of the plan seen, where they were searched for.
        limits_violated: Limits of the model that its plan violates.
        contacts: What its plan touches: every contact of the model by name; empty where the model has none, or does not
            say.
        warnings: Why its numbers cannot be trusted: a cost wants a force from a contact that the plan never touches. Empty
            where all is well.
        stability: Whether the time step is short enough.
        cost: Its expected cost.
        information: Its directed information.
        controller: How much its controller changes over time.
        gradient: Its gradients, where they were asked for.
        monte_carlo: What runs in closed loop came to, where they were asked for.
        trust: Whether its predictions hold there.
        trajectory: Its trajectory, where that was kept.
    """

    name: str
    status: str
    iterations: int
    stationarity: float
    relative_stationarity: float
    regularised_iterations: int
    belief_repairs: int
    branches: int | None
    limits_violated: list[LimitViolation]
    contacts: dict[str, ContactReport]
    warnings: list[str]
    stability: Stability
    cost: CostReport
    information: InformationReport
    controller: ControllerReport
    gradient: GradientReport | None
    monte_carlo: MonteCarlo | None
    trust: Trust | None
    trajectory: TrajectoryReport | None
