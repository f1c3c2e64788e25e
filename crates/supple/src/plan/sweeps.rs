//! Operations shared by all searches for nominal plans: roll out the first guess, linearise, sweep, and finish.

use supple_kernels::{Matrices, Scratch};
use supple_lqg::{Decrease, Limits, Lq, Regularisation, solve_limited};
use supple_model::system::{Curvature, RollOut};

use super::costates::{Stationarity, sweep_costates};
use super::{CostCurvature, NominalProblem, Plan, PlanMode, PlanStatus};
use crate::Error;
use crate::knots::Linearise;

/// Regularisation of a final sweep whose curvature is indefinite: the first that is tried, and the most.
const LEAST_MU: f64 = 1e-9;

const MOST_MU: f64 = 1e12;

/// Rolls the first guess out, moved inside the bounds.
///
/// # Errors
/// If its cost is not finite.
pub(crate) fn roll_out(problem: NominalProblem, plan: &mut Plan, scratch: &mut Scratch) -> Result<(), Error> {
    if let Some(bounds) = problem.bounds {
        bounds.clamp_all(&mut plan.trajectory.controls);
    }
    plan.nominal_cost = problem.system.roll_out(RollOut::Controls, problem.phi, &mut plan.trajectory, scratch);
    plan.iterations = 0;
    plan.regularised = 0;
    plan.passed_over = None;
    // Values that an earlier plan left there would change the last digits of this one.
    plan.policy.feedback.as_mut_slice().fill(0.0);
    let finite = plan.nominal_cost.is_finite();
    if finite { Ok(()) } else { Err(Error::NotFinite { what: "the cost of the first guess" }) }
}

/// Linearises dynamics and cost at the plan's trajectory, and finds its costates and stationarity.
pub(crate) fn linearise(problem: NominalProblem, plan: &mut Plan, curvature: Curvature, scratch: &mut Scratch) {
    let NominalProblem { system, phi, bounds } = problem;
    plan.knots.linearise_plan(system, plan.trajectory.points(), phi, curvature, scratch);
    let controls = &plan.trajectory.controls;
    let slopes = &mut plan.control_slopes;
    let left = |t: usize, a: usize, slope| match bounds {
        None => slope,
        Some(bounds) => {
            slopes.vector_mut(t)[a] = slope;
            bounds.project(a, controls.vector(t)[a], slope)
        }
    };
    let (dynamics, cost, feedback) = (&plan.knots.dynamics, &plan.knots.cost, Some(&plan.policy.feedback));
    let Stationarity { residual, scale, step, control } =
        sweep_costates(dynamics, cost, feedback, &mut plan.costates, left);
    plan.steepest = (step, control);
    plan.stationarity = residual;
    plan.relative_stationarity = residual / (1.0 + scale);
}

/// The final sweep: no second derivatives of the dynamics, no regularisation. With automatic choice, the curvature
/// of the cost is exact, or Gauss-Newton's if a converged plan has no control law with the exact one. Returns by how much
/// the law would lower the cost further, as it predicts.
pub(crate) fn finish(
    problem: NominalProblem,
    curvature: CostCurvature,
    plan: &mut Plan,
    status: PlanStatus,
    scratch: &mut Scratch,
) -> Result<f64, Error> {
    linearise(problem, plan, Curvature::Exact, scratch);
    plan.knots.linearise_measurement(problem.system, plan.trajectory.points(), problem.phi, scratch);
    plan.knots.check_finite()?;
    plan.status = status;
    plan.mode = PlanMode::Nominal;
    plan.curvature = Curvature::Exact;
    plan.objective = plan.nominal_cost;
    let left = |found: Decrease| -(found.linear + found.quadratic);
    let law = |plan: &mut Plan| solve(problem, Regularisation::default(), true, None, plan).map(left);
    let convex = match curvature {
        CostCurvature::Exact => false,
        CostCurvature::GaussNewton => true,
        CostCurvature::Auto => match law(plan) {
            Ok(left) => return Ok(left),
            Err(_) => status.is_converged() && problem.system.has_smooth_gauss_newton(),
        },
    };
    if convex {
        set_curvature(problem, Curvature::GaussNewton, plan, scratch);
        if let Ok(left) = law(plan) {
            return Ok(left);
        }
        set_curvature(problem, Curvature::Exact, plan, scratch);
    }
    let mut mu = 0.0;
    loop {
        let error = match solve(problem, Regularisation { control: mu, state: 0.0 }, true, None, plan) {
            Ok(found) => return Ok(left(found)),
            Err(error) => error,
        };
        // A law that is defined everywhere, for inspection; the status says that it is no optimum, or that time was up.
        if plan.status != PlanStatus::TimeLimit {
            plan.status = PlanStatus::Indefinite;
        }
        mu = (10.0 * mu).max(LEAST_MU);
        if mu > MOST_MU {
            return Err(error);
        }
    }
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
) -> Result<Decrease, Error> {
    solve(problem, regularisation, false, hessian, plan)
}

fn solve(
    problem: NominalProblem,
    regularisation: Regularisation,
    with_value: bool,
    hessian: Option<&Matrices>,
    plan: &mut Plan,
) -> Result<Decrease, Error> {
    let limits = problem.bounds.map(|bounds| Limits::Bounds(bounds, &plan.trajectory.controls));
    let cost = hessian.unwrap_or(&plan.knots.cost);
    Ok(solve_limited(
        Lq { dynamics: &plan.knots.dynamics, cost, regularisation, limits, with_value },
        &mut plan.policy,
    )?)
}
