use std::time::Instant;
use supple_kernels::{Matrices, Scratch};
use supple_lqg::Dimensions;
use supple_lqg::Knots;
use supple_lqg::Limits;
use supple_lqg::{Decrease, Lq, Policy, Regularisation, solve_limited};
use supple_model::Trajectory;
use supple_model::system::Curvature;

use super::costates::Stationarity;
use super::search::{Patience, minimise};
use super::{CostCurvature, NominalProblem, PlanMode, PlanSettings, PlanStatus, rollout_within, simulate_controls};
use crate::Error;
use crate::knots::Linearise;

/// A gradient counts as valid when the plan's relative stationarity is at most this.
pub const VALID_STATIONARITY: f64 = 1e-8;

/// A reference trajectory with its control law, and how the search for it ended.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The trajectory.
    pub trajectory: Trajectory,
    /// Its linearisation, with the second derivatives of the cost that [`Plan::curvature`] names.
    pub knots: Knots,
    /// The control law and cost-to-go of the final sweep, without regularisation.
    pub policy: Policy,
    /// Costates `lambda` of the trajectory, length n, N + 1 of them.
    pub costates: Matrices,
    /// Cost of the trajectory without noise.
    pub nominal_cost: f64,
    /// The objective minimised by the plan: nominal cost, or expected cost for belief-space plans.
    pub objective: f64,
    /// Which kind of plan it is.
    pub mode: PlanMode,
    /// Which second derivatives of the cost knots and policy have.
    pub curvature: Curvature,
    /// How the search ended.
    pub status: PlanStatus,
    /// Iterations made.
    pub iterations: usize,
    /// The largest `|l_u + B' lambda|` on the trajectory; for controls at a limit, only the inward component counts.
    pub stationarity: f64,
    /// The same, relative to 1 plus the largest `|l_u|`.
    pub relative_stationarity: f64,
    /// The step and the control where it is largest.
    pub steepest: (usize, usize),
    /// How many iterations had to raise the regularisation.
    pub regularised: usize,
    /// The objective of a discarded cheaper plan that did not converge, if any.
    pub passed_over: Option<f64>,
    /// Multipliers of the limits that it keeps, N + 1 vectors of length q, in the order of
    /// [`Constraints::ends`](supple_model::system::Constraints::ends): the cost of a unit of each. Empty where there
    /// are no such limits.
    pub multipliers: Matrices,
}

impl Plan {
    /// An empty plan over `steps` steps.
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        Self {
            trajectory: Trajectory::zeros(dimensions, steps),
            knots: Knots::zeros(dimensions, steps),
            policy: Policy::zeros(dimensions, steps),
            costates: Matrices::vectors(steps + 1, dimensions.states),
            nominal_cost: f64::NAN,
            objective: f64::NAN,
            mode: PlanMode::default(),
            curvature: Curvature::default(),
            status: PlanStatus::default(),
            iterations: 0,
            stationarity: f64::NAN,
            relative_stationarity: f64::NAN,
            steepest: (0, 0),
            regularised: 0,
            passed_over: None,
            multipliers: Matrices::vectors(0, 0),
        }
    }

    /// Whether it would cost less, were it not for limits that it keeps.
    pub fn is_at_limits(&self) -> bool {
        self.multipliers.as_slice().iter().any(|multiplier| *multiplier > 0.0)
    }
}

/// Memory that planning reuses.
#[derive(Clone, Debug)]
pub struct PlanWorkspace {
    pub(super) candidate: Trajectory,
    pub(super) hessian: Matrices,
    guess: Matrices,
    /// When searches stop where they are; none where they take the time they need.
    pub(crate) deadline: Option<Instant>,
}

impl PlanWorkspace {
    /// Memory for `steps` steps.
    pub fn new(dimensions: Dimensions, steps: usize) -> Self {
        let joint = dimensions.joint();
        Self {
            candidate: Trajectory::zeros(dimensions, steps),
            hessian: Matrices::zeros(steps + 1, joint, joint + 1),
            guess: Matrices::vectors(steps, dimensions.controls),
            deadline: None,
        }
    }
}

/// Regularisation of a final sweep whose curvature is indefinite: the first that is tried, and the most.
const LEAST_MU: f64 = 1e-9;
const MOST_MU: f64 = 1e12;

/// Finds the nominal plan of partially observed iLQG by line search and regularisation (theory, section P).
///
/// Starts from the first state and the controls in `plan.trajectory`, and leaves the whole plan in `plan`. Bounds are
/// left out of the search at first, unless the controls are within them and at some, as those of an earlier plan are.
/// Limits of the system that plans keep are kept. Allocates nothing once workspace and scratch have been used, but for
/// such limits.
///
/// # Errors
/// Where the first guess already leads to a cost or derivative that is not finite.
pub fn plan(
    problem: NominalProblem,
    settings: &PlanSettings,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    super::search(problem, (settings, Patience::Full), plan, work, scratch)
}

/// As [`plan`], with less patience, and without limits but the bounds of the controls.
///
/// # Errors
/// As those of [`plan`].
pub(super) fn search_free(
    problem: NominalProblem,
    (settings, patience): (&PlanSettings, Patience),
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    let controls = &plan.trajectory.controls;
    let free_first = problem.bounds.is_some_and(|bounds| !(bounds.hold(controls) && bounds.are_met(controls)));
    let before = if free_first {
        start_from_free(problem, (settings, patience), plan, work, scratch)?
    } else {
        start(problem, plan, scratch)?;
        0
    };
    let status = minimise(problem, (settings, patience), plan, work, scratch);
    plan.iterations += before;
    finish((problem, settings.curvature), plan, status, scratch)
}

/// Starts from the plan without bounds, its control law kept within them; or from the guess moved inside, where that
/// costs no more or there is no such plan. Says how many iterations it took.
///
/// Far from an optimum bounds cut much of what the control law asks for, and the search easily ends in another local
/// minimum; and a plan within the bounds is the same with and without them.
fn start_from_free(
    problem: NominalProblem,
    (settings, patience): (&PlanSettings, Patience),
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<usize, Error> {
    let free = NominalProblem { bounds: None, ..problem };
    work.guess.copy_from(&plan.trajectory.controls);
    let mut found = start(free, plan, scratch).is_ok();
    if found {
        let status = minimise(free, (settings, patience), plan, work, scratch);
        found = status.is_converged() && sweep(free, Regularisation::default(), None, plan).is_ok();
    }
    let (iterations, regularised) = (plan.iterations, plan.regularised);
    let mut cost = f64::NAN;
    if found {
        let (around, law) = ((problem.system, problem.phi, problem.bounds), (&plan.policy, 0.0));
        cost = rollout_within(around, &plan.trajectory, law, &mut work.candidate, scratch);
    }
    plan.trajectory.controls.copy_from(&work.guess);
    let started = start(problem, plan, scratch);
    plan.regularised = regularised;
    if cost.is_finite() && (started.is_err() || cost < plan.nominal_cost) {
        std::mem::swap(&mut plan.trajectory, &mut work.candidate);
        plan.nominal_cost = cost;
        return Ok(iterations);
    }
    started.map(|()| iterations)
}

/// Rolls the first guess out, moved inside the bounds.
pub(crate) fn start(problem: NominalProblem, plan: &mut Plan, scratch: &mut Scratch) -> Result<(), Error> {
    if let Some(bounds) = problem.bounds {
        bounds.clamp_all(&mut plan.trajectory.controls);
    }
    plan.nominal_cost = simulate_controls(problem.system, problem.phi, &mut plan.trajectory, scratch);
    plan.iterations = 0;
    plan.regularised = 0;
    plan.passed_over = None;
    // What an earlier plan left there would change the last digits of this one.
    plan.policy.feedback.as_mut_slice().fill(0.0);
    let finite = plan.nominal_cost.is_finite();
    if finite { Ok(()) } else { Err(Error::NotFinite { what: "the cost of the first guess", step: 0 }) }
}

/// Linearises dynamics and cost at the plan's trajectory, and finds its costates and stationarity.
pub(crate) fn linearise(problem: NominalProblem, plan: &mut Plan, curvature: Curvature, scratch: &mut Scratch) {
    let NominalProblem { system, phi, bounds } = problem;
    plan.knots.linearise_plan(system, plan.trajectory.points(), phi, curvature, scratch);
    let bounded = bounds.map(|bounds| (bounds, &plan.trajectory.controls));
    let (knots, feedback) = ((&plan.knots.dynamics, &plan.knots.cost), &plan.policy.feedback);
    let Stationarity { residual, scale, step, control } =
        super::sweep_costates(knots, feedback, bounded, &mut plan.costates);
    plan.steepest = (step, control);
    plan.stationarity = residual;
    plan.relative_stationarity = residual / (1.0 + scale);
}

/// The final sweep: no second derivatives of the dynamics, no regularisation. Where it is left to the plan, the curvature
/// of the cost is exact, and Gauss-Newton's where a plan that has converged has no control law with the exact one.
pub(crate) fn finish(
    (problem, curvature): (NominalProblem, CostCurvature),
    plan: &mut Plan,
    status: PlanStatus,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    linearise(problem, plan, Curvature::Exact, scratch);
    plan.knots.linearise_measurement(problem.system, plan.trajectory.points(), problem.phi, scratch);
    plan.knots.check_finite()?;
    plan.status = status;
    plan.mode = PlanMode::Nominal;
    plan.curvature = Curvature::Exact;
    plan.objective = plan.nominal_cost;
    let has_law = |plan: &mut Plan| solve(problem, (Regularisation::default(), true), None, plan).is_ok();
    let convex = match curvature {
        CostCurvature::Exact => false,
        CostCurvature::GaussNewton => true,
        CostCurvature::Auto if has_law(plan) => return Ok(()),
        CostCurvature::Auto => status.is_converged() && problem.system.has_smooth_gauss_newton(),
    };
    if convex {
        set_curvature(problem, Curvature::GaussNewton, plan, scratch);
        if has_law(plan) {
            return Ok(());
        }
        set_curvature(problem, Curvature::Exact, plan, scratch);
    }
    let mut mu = 0.0;
    while let Err(step) = solve(problem, (Regularisation { control: mu, state: 0.0 }, true), None, plan) {
        // A law that is defined everywhere, for people to look at; the status says that it is no optimum.
        plan.status = PlanStatus::Indefinite;
        mu = (10.0 * mu).max(LEAST_MU);
        if mu > MOST_MU {
            return Err(Error::NotPositiveDefinite { what: "the control's curvature", step });
        }
    }
    Ok(())
}

/// Linearises the cost anew, with this curvature: that of the problem, which may be another than the plan was swept for.
pub(crate) fn set_curvature(problem: NominalProblem, curvature: Curvature, plan: &mut Plan, scratch: &mut Scratch) {
    plan.curvature = curvature;
    plan.knots.cost.clear();
    let at = plan.trajectory.points();
    problem.system.cost_quadratics(at, problem.phi, curvature, &mut plan.knots.cost, scratch);
}

/// The Riccati sweep of a search along a plan within the bounds, with the second derivatives of the cost or others; without
/// the value of information, which only the final sweep computes.
pub(crate) fn sweep(
    problem: NominalProblem,
    regularisation: Regularisation,
    hessian: Option<&Matrices>,
    plan: &mut Plan,
) -> Result<Decrease, usize> {
    solve(problem, (regularisation, false), hessian, plan)
}

fn solve(
    problem: NominalProblem,
    (regularisation, with_value): (Regularisation, bool),
    hessian: Option<&Matrices>,
    plan: &mut Plan,
) -> Result<Decrease, usize> {
    let limits = problem.bounds.map(|bounds| Limits::Bounds(bounds, &plan.trajectory.controls));
    let cost = hessian.unwrap_or(&plan.knots.cost);
    solve_limited(Lq { dynamics: &plan.knots.dynamics, cost, regularisation, limits, with_value }, &mut plan.policy)
}
