"""Contents of evaluations. Names are those of the command line's JSON."""

from __future__ import annotations

from dataclasses import dataclass, field

from ._records import Array, Record
from .trajectories import ContactCurve, CostCurve, MeasurementReport, QuantityCurve, SampleRun, TrajectoryReport

__all__ = [
    "Consistency",
    "ContactCurve",
    "ContactReport",
    "ControllerReport",
    "CostCurve",
    "CostReport",
    "CostTerm",
    "Estimate",
    "FinerSteps",
    "FrozenGradient",
    "GradientReport",
    "InformationReport",
    "LimitReached",
    "LimitShare",
    "LimitViolation",
    "MeasurementReport",
    "MonteCarlo",
    "NeededInformation",
    "PlanCheck",
    "QuantityCurve",
    "SampleRun",
    "Split",
    "Stability",
    "TargetReport",
    "TaskReport",
    "TotalGradient",
    "TouchShare",
    "TrajectoryReport",
    "Trust",
]


@dataclass(frozen=True, eq=False, repr=False)
class TargetReport(Record):
    """A number that a cost weighs, along the plan without noise.

    Attributes:
        name: Its name.
        unit: Its unit; empty where there is none.
        target: What it should be.
        start: At step 0.
        mean: Mean over all steps.
        end: At step N, or N - 1 if it depends on the control.
        in_final_cost: Whether the final cost weighs it.
    """

    name: str
    unit: str
    target: float
    start: float
    mean: float
    end: float
    in_final_cost: bool


@dataclass(frozen=True, eq=False, repr=False)
class CostTerm(Record):
    """A term of the cost along the plan without noise.

    Attributes:
        name: Its place among the costs of the task, from 1, and its kind: ``2 contact_force``.
        stages: Its cost in stages 0 to N - 1.
        last: Its cost at the end.
        targets: The numbers that it weighs, by name; empty if they are not known.
    """

    name: str
    stages: float
    last: float
    targets: dict[str, TargetReport] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, repr=False)
class CostReport(Record):
    """The expected cost of a task.

    Attributes:
        expected: The sum of the four parts.
        nominal: Cost of the trajectory without noise.
        belief: Cost of estimation error, ``1/2 sum Tr(Xi Sigma)``.
        process: Cost of process noise, ``1/2 sum Tr(S W)``.
        initial: Cost of initial uncertainty, ``1/2 Tr(S_0 X_0)``.
        terms: The terms of the nominal cost by name, in the order of the costs of the task; empty if the model does not tell them.
        second_order: The expected cost with the second derivatives of dynamics and cost, to second order in deviations;
            ``None`` without roll-outs, at limits of quantities, and for plans that are not nominal.
        bound: The cost limit; ``None`` if there is none.
        belief_per_step: ``1/2 Tr(Xi_t Sigma_t)``, (N,).
        value_of_information_per_step: ``Tr(Xi_t)``, (N,).
    """

    expected: float
    nominal: float
    belief: float
    process: float
    initial: float
    second_order: float | None
    bound: float | None
    belief_per_step: Array
    value_of_information_per_step: Array
    terms: dict[str, CostTerm] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, repr=False)
class UsedInformation(Record):
    """The directed information from the state to the controls, exact for the linearised closed loop.

    Attributes:
        total_nats: Over the whole task, nats.
        total_bits: The same in bits.
        bits_per_step: Bits per control: the total divided by N.
        per_step_nats: Nats at each control, (N,).
    """

    total_nats: float
    total_bits: float
    bits_per_step: float
    per_step_nats: Array


@dataclass(frozen=True, eq=False, repr=False)
class NeededInformation(Record):
    """The minimum directed information over all sensors and controllers that stay within an expected cost.

    Attributes:
        total_nats: Over the whole task, nats.
        total_bits: The same in bits.
        lower_bits: Its lower bound, bits: the value of a dual point.
        cost: The expected cost that is not exceeded: the task's limit, or the plan's own cost if there is no limit or no
            information achieves it.
        limit_out_of_reach: Whether no information achieves the task's cost limit along this plan.
    """

    total_nats: float
    total_bits: float
    lower_bits: float
    cost: float
    limit_out_of_reach: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class InformationReport(Record):
    """The directed information of a task.

    Attributes:
        total_nats: Over the whole task, nats.
        total_bits: The same in bits.
        bits_per_step: Bits per measurement: the total divided by N + 1.
        bits_per_second: Bits per measurement divided by the time step.
        entropy_form_nats: The entropy form, for comparison; ``None`` if a covariance is singular.
        paper_form_nats: The paper's printed form, for comparison; ``None`` if a covariance is singular.
        per_step_nats: Nats at each measurement, (N+1,).
        used: The information the controller uses; ``None`` in results of versions that did not compute it.
        needed: The minimum over all sensors and controllers; ``None`` if it was not requested or not found.
        needed_not_found: Why ``needed`` was not found although it was requested; ``None`` otherwise.
        needed_takes_long: Whether ``needed`` was skipped because it takes long with so many states; ``task.bound()`` computes it.
    """

    total_nats: float
    total_bits: float
    bits_per_step: float
    bits_per_second: float
    entropy_form_nats: float | None
    paper_form_nats: float | None
    per_step_nats: Array
    used: UsedInformation | None = None
    needed: NeededInformation | None = None
    needed_takes_long: bool = False
    needed_not_found: str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class TotalGradient(Record):
    """Derivatives with respect to each parameter, with plan, feedback and filter all varying.

    Attributes:
        valid: Whether the plan is stationary enough for the gradient to hold.
        information_nats: Of the directed information, nats per unit of the parameter.
        expected_cost: Of the expected cost.
        nominal_cost: Of its nominal part.
        belief_cost: Of its belief part.
        process_cost: Of its process noise part.
        initial_cost: Of its initial part.
        used_nats: Of the information that the controller uses.
        needed_nats: Of the information that any sensors and any controller need; ``None`` where that was not computed, or is not
            the minimum at the cost limit.
    """

    valid: bool
    information_nats: dict[str, float]
    expected_cost: dict[str, float]
    nominal_cost: dict[str, float]
    belief_cost: dict[str, float]
    process_cost: dict[str, float]
    initial_cost: dict[str, float]
    used_nats: dict[str, float] | None = None
    needed_nats: dict[str, float] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class FrozenGradient(Record):
    """Derivatives with respect to each parameter, with trajectory and controller held fixed, as in the paper.

    Attributes:
        information_nats: Of the directed information, nats per unit of the parameter.
        belief_cost: Of the belief's part of the expected cost.
        recursion_spectral_radius: The paper's recursion is stable if this is below 1.
    """

    information_nats: dict[str, float]
    belief_cost: dict[str, float]
    recursion_spectral_radius: float | None


@dataclass(frozen=True, eq=False, repr=False)
class GradientReport(Record):
    """Gradients of a task, if they were requested.

    Attributes:
        total: With everything varying; ``None`` if it was not requested.
        frozen: With the trajectory frozen; ``None`` if it was not requested.
    """

    total: TotalGradient | None
    frozen: FrozenGradient | None


@dataclass(frozen=True, eq=False, repr=False)
class Stability(Record):
    """Whether the time step is short enough for the model.

    Attributes:
        time_step: Time step, s.
        spectral_radius: The largest spectral radius of ``A`` over the steps examined.
        step: The step at which it occurs.
        numerically_unstable: Whether the time step is too large there, as opposed to the system itself being unstable.
        suggested_time_step: A time step that is short enough, s; ``None`` if the present one is.
        suggested_substeps: A sufficient number of sub-steps; ``None`` if the model has none or requires no more.
    """

    time_step: float
    spectral_radius: float
    step: int
    numerically_unstable: bool
    suggested_time_step: float | None
    suggested_substeps: int | None

    def _advice(self) -> str:
        """What is wrong with it, and what to do."""
        use = [] if self.suggested_time_step is None else [f"use at most {self.suggested_time_step:g} s"]
        use += [] if self.suggested_substeps is None else [f"substeps = {self.suggested_substeps}"]
        advice = f"; {', or '.join(use)}" if use else ""
        return f"time_step = {self.time_step:g} s is too large for the stiff parts of the model{advice}"


@dataclass(frozen=True, eq=False, repr=False)
class LimitReached(Record):
    """A limit that a plan keeps and is held at.

    Attributes:
        name: The limited quantity.
        limit: The limit, in its unit.
        upper: Whether it is an upper limit.
        step: The first step at which the plan is held there.
        steps: Number of steps at which it is.
        price: Decrease of the nominal cost per unit by which the limit is wider.
        unit: The unit of the limit; empty where there is none.
    """

    name: str
    limit: float
    upper: bool
    step: int
    steps: int
    price: float
    unit: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class LimitViolation(Record):
    """A limit that a plan violates.

    Attributes:
        name: The limited quantity.
        worst: The value furthest outside the limit.
        limit: The limit.
        step: The first step at which the value is ``worst``.
        steps: Number of steps at which the value is outside.
        unit: The unit of both; empty where there is none.
        is_of_task: Whether the task sets the limit, and not the robot's file.
    """

    name: str
    worst: float
    limit: float
    step: int
    steps: int
    unit: str = ""
    is_of_task: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class ContactReport(Record):
    """A contact of the model along the nominal trajectory, states 0 to N.

    It touches at a step if its clearance is below one smoothing length and its normal force is above 1e-6 of stiffness
    times smoothing.

    Attributes:
        name: Its name.
        touches: Whether it touches at any step.
        first_s: Time of the first step at which it touches, s; ``None`` if it never touches.
        last_s: Time of the last step at which it touches, s; ``None`` if it never touches.
        share_of_time: Share of the N + 1 steps at which it touches, from 0 to 1.
        peak_force_N: The greatest normal force over the steps at which it touches, N; 0 if it never touches.
        mean_force_N: The mean normal force over the steps at which it touches, N; 0 if it never touches.
        least_clearance_m: The least clearance, m; negative if the body penetrates the wall, by the greatest penetration.
        greatest_force_apart_N: The greatest norm of the total force, friction included, over steps with a clearance of more
            than one smoothing length, N; 0 if there are none.
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
        feedback_variation: Its root divided by the root mean square of the gains, from 0 to 1.
        feedforward_variance: Temporal variance of the feedforward.
        feedforward_variation: Its root divided by the root mean square of the feedforward, from 0 to 1.
    """

    feedback_variance: float
    feedback_variation: float
    feedforward_variance: float
    feedforward_variation: float


@dataclass(frozen=True, eq=False, repr=False)
class Consistency(Record):
    """The normalised innovation squared, a mean over measurements and roll-outs: 1 for a consistent filter.

    Attributes:
        mean: The mean; above 1 if the filter is overconfident.
        lower_95: Lower end of the band that contains 95 % of the means of a consistent filter.
        upper_95: Upper end of this band.
    """

    mean: float
    lower_95: float
    upper_95: float


@dataclass(frozen=True, eq=False, repr=False)
class Estimate(Record):
    """A mean of samples, in their unit.

    Attributes:
        mean: The mean.
        standard_error: Its standard error.
        interval_95: 95 % confidence interval of the expectation, by Student's t, (2,); ``None`` for a single sample.
    """

    mean: float
    standard_error: float
    interval_95: Array | None = None


@dataclass(frozen=True, eq=False, repr=False)
class TouchShare(Record):
    """How often a contact touched in roll-outs.

    Attributes:
        name: The contact.
        share: Share of the roll-outs.
    """

    name: str
    share: float


@dataclass(frozen=True, eq=False, repr=False)
class LimitShare(Record):
    """One side of a limit of the robot or the task in roll-outs. Plans keep limits without noise; roll-outs leave them by chance.

    Attributes:
        name: The limited quantity.
        limit: The limit, in its unit.
        upper: Whether it is an upper limit.
        planned: The least and the greatest value along the plan, (2,).
        median: Half of the roll-outs go at least as far as this towards the limit, or beyond it.
        worst: How far the worst roll-out goes.
        share: Share of the roll-outs that are ever beyond the limit.
        share_of_time: Share of the time that roll-outs are beyond it, on average.
        unit: The unit of the limit; empty where there is none.
    """

    name: str
    limit: float
    upper: bool
    planned: Array
    median: float
    worst: float
    share: float
    share_of_time: float
    unit: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Trust(Record):
    """Whether roll-outs agree with the predictions.

    Attributes:
        verdict: ``"holds"``, ``"doubtful"`` or ``"broken"``, as where roll-outs exceed the limit that the expected cost keeps.
        reasons: The findings, and what to try.
        rollouts_needed: About how many roll-outs are needed, if there are too few to tell.
        substeps_advised: The ``substeps`` of the model to try, if roll-outs differ on finer steps.
        shorter_steps_advised: Whether to try a smaller ``time_step`` instead, as the model has about 1000 sub-steps.
        bits_unknown: Whether there are too few roll-outs to tell their information, which is then one of the reasons.
    """

    verdict: str
    reasons: list[str]
    rollouts_needed: int | None = None
    substeps_advised: int | None = None
    shorter_steps_advised: bool = False
    bits_unknown: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class PlanCheck(Record):
    """What speaks against the plan of a task, about which other numbers are computed.

    Attributes:
        task: The task.
        status: How the search for its plan ended.
        warnings: Why its numbers cannot be trusted.
        trust: What roll-outs with all of the task's sensors say of the linearisation; ``None`` without roll-outs.
    """

    task: str
    status: str
    warnings: list[str]
    trust: Trust | None = None


def plan_rows(warnings: list[str], trust: Trust | None) -> list[tuple[str, str]]:
    """What speaks against a plan, as rows of a summary."""
    rows = [("warning", warning) for warning in warnings]
    if trust is not None and trust.verdict != "holds":
        rows.append(("roll-outs", ": ".join([trust.verdict, "; ".join(trust.reasons)])))
    return rows


@dataclass(frozen=True, eq=False, repr=False)
class Split(Record):
    """Where the change of a task's measured information comes from, between the start and the optimum of a design.

    The four parts add up to the total. They are integrals along the path between both designs that is straight in the
    coordinates of the search.

    Attributes:
        task: The task.
        total_bits: The change, bits.
        sensors_bits: Part that is due to what the sensors are sensitive to and to their noise: ``C`` and ``V`` along a plan
            held fixed, bits.
        uncertainty_bits: Part that is due to how uncertainty propagates: ``A``, ``W`` and ``X_0`` along a plan held fixed,
            bits.
        plan_bits: Part that is due to the change of the plan, bits.
        jumps_bits: The rest, bits: the plan of the optimum, led back to the start, ends at another local minimum than the
            plan of the start, or jumps on the way; and the error of the integrals, which is below 1e-5 of the total.
        evaluations: Designs evaluated on the path.
    """

    task: str
    total_bits: float
    sensors_bits: float
    uncertainty_bits: float
    plan_bits: float
    jumps_bits: float
    evaluations: int


@dataclass(frozen=True, eq=False, repr=False)
class FinerSteps(Record):
    """Roll-outs whose plant takes finer steps than the task, with the noise of those on the task's own steps.

    Attributes:
        times: Plant steps per step of the task (or per sub-step).
        rollouts: Number of roll-outs.
        diverged: Number of those that diverged.
        cost_mean: Mean cost.
        own_cost_mean: Mean cost of the roll-outs with the same numbers on the task's own steps.
        median_difference: Median of the differences between the two.
        difference_standard_error: Standard error of the mean difference.
        consistency: Whether the covariance of the filter, which uses the task's own steps, matches its errors.
        realised_bits: Information that the measurements gave to a filter of finer steps, which does not control.
        bits_difference: That minus the bits of the roll-outs with the same numbers on the task's own steps.
        limits: The limits of the robot and the task, looked at after each of the finer steps; empty if a roll-out diverged.
    """

    times: int
    rollouts: int
    diverged: int
    cost_mean: float
    own_cost_mean: float
    median_difference: float
    difference_standard_error: float
    consistency: Consistency | None = None
    realised_bits: Estimate | None = None
    bits_difference: Estimate | None = None
    limits: list[LimitShare] = field(default_factory=list)


@dataclass(frozen=True, eq=False, repr=False)
class MonteCarlo(Record):
    """A task in closed loop, sampled: with an extended Kalman filter, or with a :class:`supple.Controller`.

    Attributes:
        rollouts: Number of roll-outs.
        seed: Seed of their noise.
        diverged: Number of roll-outs that diverged.
        cost_mean: Mean cost.
        cost_standard_error: Its standard error.
        cost_interval_95: 95 % confidence interval of the expected cost, by Student's t, (2,); ``None`` for a single
            roll-out, or if one diverged.
        difference: Mean minus expected cost.
        consistency: Whether the filter's covariance matches its errors; ``None`` if a roll-out diverged.
        realised_bits: Measured information, bits; ``None`` if a roll-out diverged or noise depends on the state.
        touched: Share of the roll-outs in which each contact touched.
        limits: The limits of the robot and the task, looked at in every step; empty if a roll-out diverged.
        finer: The roll-outs repeated on a plant with finer steps; ``None`` for models that are not robots.
    """

    rollouts: int
    seed: int
    diverged: int
    cost_mean: float
    cost_standard_error: float
    difference: float
    cost_interval_95: Array | None = None
    consistency: Consistency | None = None
    realised_bits: Estimate | None = None
    touched: dict[str, TouchShare] = field(default_factory=dict)
    limits: list[LimitShare] = field(default_factory=list)
    finer: FinerSteps | None = None


@dataclass(frozen=True, eq=False, repr=False)
class TaskReport(Record):
    """One task at one design.

    Attributes:
        name: Its name.
        status: How its plan ended: ``converged``, ``max_iterations``, ``line_search_stalled``, ``slow_progress``,
            ``time_limit``, ``indefinite`` or ``limits_exceeded``.
        iterations: Iterations of its plan, from the initial guess that led to it.
        stationarity: The largest derivative of the Hamiltonian with respect to a control.
        relative_stationarity: The same, relative to 1 plus the largest ``|l_u|``.
        regularised_iterations: Iterations that had to raise the regularisation.
        cost_curvature: Second derivatives of the cost in its control law and expected cost: ``exact`` or
            ``gauss_newton``.
        belief_repairs: Number of repairs of rounding errors in the belief.
        branches: Number of different local minima of the plan encountered, if they were searched for.
        limits_violated: Limits that its plan violates.
        limits_reached: Limits that its plan keeps and is held at (``enforce`` or
            ``enforce_effort_limits`` in a task file, or bounds of its controls).
        contacts: The contacts along its plan: every contact of the model by name; empty if the model has none or does not
            report them.
        warnings: Reasons not to trust its numbers: a cost asks for a force from a contact that the plan never makes. Empty if
            there are none.
        stability: Whether the time step is short enough.
        cost: Its expected cost.
        information: Its directed information.
        controller: Variation of its controller over time.
        gradient: Its gradients, if they were requested.
        monte_carlo: Results of closed-loop roll-outs, if they were requested.
        trust: Whether the roll-outs agree with its predictions.
        trajectory: Its trajectory, if it was kept.
        set: Parameters that it sets for itself, by name, whatever those of the design are.
    """

    name: str
    status: str
    iterations: int
    stationarity: float
    relative_stationarity: float
    regularised_iterations: int
    cost_curvature: str
    belief_repairs: int
    branches: int | None
    limits_violated: list[LimitViolation]
    limits_reached: list[LimitReached]
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
    set: dict[str, float] = field(default_factory=dict)
