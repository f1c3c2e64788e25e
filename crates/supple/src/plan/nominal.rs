//! Nominal plans with no limits other than control bounds.

use supple_kernels::Scratch;
use supple_lqg::Regularisation;
use supple_model::system::RollOut;

use super::first_guess::start_fed_back;
use super::search::{Asked, minimise};
use super::sweeps::{finish, roll_out, sweep};
use super::{NominalProblem, Plan, PlanStatus, PlanWorkspace};
use crate::Error;

/// Slopes of the cost up to this are tiny; the most of its cost that a converged plan may then still be able to save, the
/// factor by which the tolerance is tightened where it is more, and below which it is not.
const TINY: f64 = 1e-4;
const MOST_LEFT: f64 = 1e-9;
const TIGHTER: f64 = 1e-4;
const LEAST_TOLERANCE: f64 = 1e-40;

/// Like [`plan`](super::plan), with the given patience and no limits other than control bounds.
///
/// # Errors
/// As those of [`plan`](super::plan).
pub(super) fn search_free(
    problem: NominalProblem,
    asked: Asked,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    let controls = &plan.trajectory.controls;
    let free_first = problem.bounds.is_some_and(|bounds| !(bounds.hold(controls) && bounds.are_met(controls)));
    let before = if free_first {
        start_from_free(problem, asked, plan, work, scratch)?
    } else {
        match asked.fed_back {
            true => start_fed_back(problem, plan, work, scratch)?,
            false => roll_out(problem, plan, scratch)?,
        }
        0
    };
    let mut settings = asked.settings.clone();
    loop {
        let found = minimise(problem, Asked { settings: &settings, ..asked }, plan, work, scratch);
        let is_finer = settings.tolerance < asked.settings.tolerance;
        // The plan has met the tolerance that was asked for, whatever ends the search for a finer one.
        let status = if is_finer { PlanStatus::Converged } else { found };
        let left = finish(problem, asked.settings.curvature, plan, status, scratch)?;
        // Stationarity is relative to 1 plus the slopes of the cost: where these are tiny, any plan may meet it.
        let is_absolute = plan.stationarity <= (1.0 + TINY) * plan.relative_stationarity;
        let is_far = left > MOST_LEFT * plan.nominal_cost.abs();
        if !(is_absolute && is_far && found.is_converged() && settings.tolerance > LEAST_TOLERANCE) {
            break;
        }
        settings.tolerance *= TIGHTER;
    }
    plan.iterations += before;
    Ok(())
}

/// Starts from the plan without bounds, its control law kept within them; or from the guess moved inside, where that
/// costs no more or there is no such plan. Returns the iterations it took.
///
/// Far from an optimum, bounds clip much of the control law's output, and the search easily ends in another local
/// minimum. A plan that stays within the bounds is the same with and without them.
fn start_from_free(
    problem: NominalProblem,
    asked: Asked,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<usize, Error> {
    let free = NominalProblem { bounds: None, ..problem };
    work.guess.copy_from(&plan.trajectory.controls);
    let mut found = roll_out(free, plan, scratch).is_ok();
    if found {
        let status = minimise(free, asked, plan, work, scratch);
        found = status.is_converged() && sweep(free, Regularisation::default(), None, plan).is_ok();
    }
    let (iterations, regularised) = (plan.iterations, plan.regularised);
    let mut cost = f64::NAN;
    if found {
        let NominalProblem { system, phi, bounds } = problem;
        let law = RollOut::Law { reference: &plan.trajectory, policy: &plan.policy, step: 0.0, bounds };
        cost = system.roll_out(law, phi, &mut work.candidate, scratch);
    }
    plan.trajectory.controls.copy_from(&work.guess);
    let started = roll_out(problem, plan, scratch);
    plan.regularised = regularised;
    if cost.is_finite() && (started.is_err() || cost < plan.nominal_cost) {
        std::mem::swap(&mut plan.trajectory, &mut work.candidate);
        plan.nominal_cost = cost;
        return Ok(iterations);
    }
    started.map(|()| iterations)
}
