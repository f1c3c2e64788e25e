//! Plans that keep limits of quantities, by the method of multipliers (theory, equations P.8 and P.9).

use supple_kernels::{Matrices, Scratch};

use super::augmented::Augmented;
use super::nominal::{finish, search_free, start};
use super::search::{Patience, Search};
use super::{NominalProblem, Plan, PlanSettings, PlanStatus, PlanWorkspace, simulate_controls};
use crate::Error;
use crate::limits::LIMIT_TOLERANCE;
use crate::system::{Constraints, RollOut, System};

/// Rounds at most.
const MOST_ROUNDS: usize = 60;
/// Stationarity that the first round is taken to, and what each round divides it by.
const FIRST_TOLERANCE: f64 = 1e-3;
const TIGHTER: f64 = 30.0;
/// By how much a round is to lower what is left of excesses, and what penalties grow by where it does not.
const ENOUGH: f64 = 0.2;
const GROWTH: f64 = 10.0;
/// How often penalties grow at most: beyond that, rounding hides what else the cost asks for.
const MOST_GROWTHS: usize = 9;
/// The part of a limit's tolerance that plans are taken to.
const SHARE: f64 = 0.3;

/// Finds a nominal plan that keeps the limits of its system: first without them, then, where that one does not keep
/// them, of the augmented Lagrangian round by round. As [`search_free`] where there are none to keep.
///
/// # Errors
/// As those of [`search_free`].
pub(crate) fn search(
    problem: NominalProblem,
    (settings, patience): (&PlanSettings, Patience),
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    let Some(limits) = problem.system.constraints() else {
        return search_free(problem, (settings, patience), plan, work, scratch);
    };
    let ends = limits.ends().len();
    // Limits of an earlier plan wrote entries that the cost itself leaves 0.
    plan.knots.cost.clear();
    let is_known = patience.is_close() && plan.multipliers.cols() == ends && plan.is_at_limits();
    if !is_known || start(problem, plan, scratch).is_err() {
        plan.multipliers = Matrices::vectors(plan.trajectory.steps() + 1, ends);
        search_free(problem, (settings, patience), plan, work, scratch)?;
        if patience == Patience::Little && !plan.status.is_converged() {
            return Ok(());
        }
    }
    Rounds::new(problem, limits, plan, scratch).run(settings, plan, work, scratch)
}

/// The search's state between rounds.
struct Rounds<'a> {
    problem: NominalProblem<'a>,
    limits: &'a dyn Constraints,
    /// How far beyond each end a number may be.
    tolerances: Vec<f64>,
    penalties: Vec<f64>,
    /// Iterations so far.
    iterations: usize,
    regularised: usize,
}

impl<'a> Rounds<'a> {
    fn new(problem: NominalProblem<'a>, limits: &'a dyn Constraints, plan: &Plan, scratch: &mut Scratch) -> Self {
        let bounds = limits.bounds(problem.phi);
        let tolerances = bounds.iter().map(|bound| SHARE * LIMIT_TOLERANCE * (1.0 + bound.abs())).collect();
        let mut rounds = Self { problem, limits, tolerances, penalties: Vec::new(), iterations: 0, regularised: 0 };
        rounds.penalties = rounds.first_penalties(plan, &bounds, scratch);
        (rounds.iterations, rounds.regularised) = (plan.iterations, plan.regularised);
        rounds
    }

    /// Penalties under which each end's excess in the plan without limits, or a hundredth of its bound, costs about what the
    /// whole plan does.
    fn first_penalties(&self, plan: &Plan, bounds: &[f64], scratch: &mut Scratch) -> Vec<f64> {
        let excesses = self.excesses(plan, scratch);
        let cost = plan.nominal_cost.abs().max(f64::MIN_POSITIVE.sqrt());
        let of_end = |(end, bound): (usize, &f64)| {
            let beyond = |t: usize| excesses.vector(t)[end].max(0.0).powi(2);
            let size = (0..excesses.count()).map(beyond).sum::<f64>().max((0.01 * bound).powi(2));
            2.0 * cost / if size > 0.0 { size } else { 1.0 }
        };
        bounds.iter().enumerate().map(of_end).collect()
    }

    fn excesses(&self, plan: &Plan, scratch: &mut Scratch) -> Matrices {
        let mut excesses = Matrices::vectors(plan.multipliers.count(), plan.multipliers.cols());
        self.limits.excesses(plan.trajectory.points(), self.problem.phi, &mut excesses, scratch);
        excesses
    }

    /// How far the plan is from keeping its limits, and its multipliers from being 0 where it is inside of them; in
    /// tolerances.
    fn missed(&self, plan: &Plan, scratch: &mut Scratch) -> f64 {
        let excesses = self.excesses(plan, scratch);
        let mut most: f64 = 0.0;
        for t in 0..excesses.count() {
            let parts = self.tolerances.iter().zip(&self.penalties);
            let ends = excesses.vector(t).iter().zip(plan.multipliers.vector(t)).zip(parts);
            for ((&excess, &multiplier), (&tolerance, &rho)) in ends {
                most = most.max(excess.max(-multiplier / rho).abs() / tolerance);
            }
        }
        most
    }

    fn run(
        mut self,
        settings: &PlanSettings,
        plan: &mut Plan,
        work: &mut PlanWorkspace,
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        let mut missed = self.missed(plan, scratch);
        if missed <= 1.0 && !plan.is_at_limits() {
            return Ok(());
        }
        let (mut tolerance, mut growths) = (FIRST_TOLERANCE, 0);
        let mut status = PlanStatus::LimitsExceeded;
        for _ in 0..MOST_ROUNDS {
            tolerance = (tolerance / TIGHTER).max(settings.tolerance);
            status = self.round(&settings.to_tolerance(tolerance), plan, work, scratch);
            if matches!(status, PlanStatus::TimeLimit | PlanStatus::MaxIterations) {
                break;
            }
            let left = self.missed(plan, scratch);
            if left <= 1.0 && tolerance <= settings.tolerance {
                break;
            }
            if left > 1.0 && left > ENOUGH * missed {
                if growths == MOST_GROWTHS {
                    break;
                }
                growths += 1;
                self.penalties.iter_mut().for_each(|rho| *rho *= GROWTH);
            }
            missed = left;
        }
        self.finish(plan, status, scratch)
    }

    /// One round: the least of the augmented Lagrangian, and the multipliers that its slopes are.
    fn round(
        &mut self,
        settings: &PlanSettings,
        plan: &mut Plan,
        work: &mut PlanWorkspace,
        scratch: &mut Scratch,
    ) -> PlanStatus {
        let multipliers = plan.multipliers.clone();
        let system = Augmented {
            system: self.problem.system,
            limits: self.limits,
            multipliers: &multipliers,
            penalties: Some(&self.penalties),
        };
        let problem = NominalProblem { system: &system, ..self.problem };
        let phi = problem.phi;
        plan.nominal_cost = system.roll_out(RollOut::Controls, phi, &mut plan.trajectory, scratch);
        (plan.iterations, plan.regularised) = (0, 0);
        let status = Search::new(problem, (settings, Patience::Close), plan, work, scratch).run();
        plan.multipliers = system.slopes(plan.trajectory.points(), phi, scratch);
        self.iterations += plan.iterations;
        self.regularised += plan.regularised;
        status
    }

    /// The final sweep, of the cost with the multipliers' slopes and the cost's own curvature.
    fn finish(self, plan: &mut Plan, status: PlanStatus, scratch: &mut Scratch) -> Result<(), Error> {
        let Self { problem, limits, .. } = self;
        let kept = self.missed(plan, scratch) <= 1.0 / SHARE;
        plan.nominal_cost = simulate_controls(problem.system, problem.phi, &mut plan.trajectory, scratch);
        (plan.iterations, plan.regularised) = (self.iterations, self.regularised);
        plan.passed_over = None;
        let multipliers = std::mem::replace(&mut plan.multipliers, Matrices::vectors(0, 0));
        let system = Augmented { system: problem.system, limits, multipliers: &multipliers, penalties: None };
        let status = if status.is_converged() && !kept { PlanStatus::LimitsExceeded } else { status };
        let finished = finish(NominalProblem { system: &system, ..problem }, plan, status, scratch);
        plan.multipliers = multipliers;
        finished
    }
}
