//! The globalised loop of nominal planning: linearise, solve, search along the step, stop.

use std::time::Instant;
use supple_kernels::{Scratch, halt};
use supple_model::system::Curvature;

use super::nominal::{linearise, sweep};
use super::{NominalProblem, Plan, PlanSettings, PlanStatus, PlanWorkspace, rollout_within};

/// The least regularisation that is tried after none, and the most, as shares of the curvature.
const FIRST_MU: f64 = 1e-4;
const MOST_MU: f64 = 1e8;
/// How often what second derivatives add to Gauss-Newton's is halved, where they are not positive or lead nowhere.
const CURVATURE_HALVINGS: usize = 5;
/// Halvings of a Newton step at most: more of them, and Gauss-Newton does better.
const NEWTON_HALVINGS: usize = 3;
/// Stationarity above which no plan counts as stationary for rounding.
const NEARLY: f64 = 1e-6;
/// Below this share regularisation is dropped.
const LEAST_MU: f64 = 1e-6;

/// Iterations at most of a search that gives up early.
const FEW_ITERATIONS: usize = 12;

/// How long a search is kept up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Patience {
    /// As long as the settings say.
    Full,
    /// Until whole steps do not serve, or a few iterations.
    Little,
    /// As long as the settings say, from close to an optimum: second derivatives are of use from the start.
    Close,
    /// A few iterations, from the plan of a problem that differs little.
    Continued,
}

impl Patience {
    fn is_close(self) -> bool {
        matches!(self, Self::Close | Self::Continued)
    }
}

/// The search's state between iterations.
pub(super) struct Search<'a> {
    problem: NominalProblem<'a>,
    settings: &'a PlanSettings,
    patience: Patience,
    plan: &'a mut Plan,
    work: &'a mut PlanWorkspace,
    scratch: &'a mut Scratch,
    mu: f64,
    newton: Readiness,
    progress: Progress,
}

/// When second derivatives are used: where the last step changed the cost little, and not just after they failed.
#[derive(Clone, Copy, Debug, Default)]
struct Readiness {
    close: bool,
    failures: u32,
    wait: usize,
}

impl Readiness {
    fn is_ready(&self) -> bool {
        self.close && self.wait == 0
    }

    fn tried(&mut self, succeeded: bool) {
        self.failures = if succeeded { 0 } else { self.failures + 1 };
        self.wait = if succeeded { 0 } else { (1 << self.failures.min(5)) - 1 };
    }
}

/// How the search came along since its last milestone.
#[derive(Clone, Copy, Debug)]
struct Progress {
    iteration: usize,
    cost: f64,
    stationarity: f64,
}

impl Progress {
    /// Iterations between milestones.
    const STRIDE: usize = 30;

    /// Whether neither cost nor stationarity came along since the last milestone; sets a new one where it is time to.
    fn creeps(&mut self, plan: &Plan) -> bool {
        if plan.iterations < self.iteration + Self::STRIDE {
            return false;
        }
        let gained = self.cost - plan.nominal_cost;
        let creeps =
            gained <= 1e-6 * (1.0 + plan.nominal_cost.abs()) && plan.relative_stationarity > 0.1 * self.stationarity;
        *self = Self { iteration: plan.iterations, cost: plan.nominal_cost, stationarity: plan.relative_stationarity };
        creeps
    }
}

/// How one iteration went.
#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    Accepted,
    /// No step lowered the cost.
    Rejected,
    /// The curvature is not positive.
    Indefinite,
    /// The predicted decrease is below what the cost can resolve.
    Resolved,
}

impl<'a> Search<'a> {
    pub fn new(
        problem: NominalProblem<'a>,
        (settings, patience): (&'a PlanSettings, Patience),
        plan: &'a mut Plan,
        work: &'a mut PlanWorkspace,
        scratch: &'a mut Scratch,
    ) -> Self {
        let progress = Progress { iteration: 0, cost: f64::INFINITY, stationarity: f64::INFINITY };
        let newton = Readiness { close: patience.is_close(), ..Readiness::default() };
        Self { problem, settings, patience, plan, work, scratch, mu: 0.0, newton, progress }
    }

    /// Searches from the trajectory of the plan, which is rolled out; leaves the best one there.
    pub fn run(mut self) -> PlanStatus {
        let (mut unresolved, mut least) = (0, f64::INFINITY);
        loop {
            let newton = self.settings.newton && self.newton.is_ready();
            self.linearise();
            if self.plan.relative_stationarity <= self.settings.tolerance {
                return PlanStatus::Converged;
            }
            if self.plan.iterations >= self.settings.max_iterations {
                return self.ended(PlanStatus::MaxIterations);
            }
            if halt::is_requested() || self.work.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
                return self.ended(PlanStatus::TimeLimit);
            }
            if self.progress.creeps(self.plan) || self.gives_up() {
                return self.ended(PlanStatus::SlowProgress);
            }
            self.plan.iterations += 1;
            match self.advance(newton) {
                Outcome::Accepted => unresolved = 0,
                Outcome::Resolved => {
                    // Rounding hides the cost's decrease. Steps that still bring the plan closer to stationary go on; one
                    // other is enough where it is stationary but for rounding, and a few elsewhere.
                    let closer = self.plan.relative_stationarity < 0.5 * least;
                    least = least.min(self.plan.relative_stationarity);
                    unresolved = if closer { 0 } else { unresolved + 1 };
                    if unresolved > 3 || unresolved > 0 && self.is_nearly_stationary() {
                        return self.ended(PlanStatus::LineSearchStalled);
                    }
                }
                Outcome::Rejected => return self.ended(PlanStatus::LineSearchStalled),
                Outcome::Indefinite => return self.ended(PlanStatus::Indefinite),
            }
        }
    }

    fn gives_up(&self) -> bool {
        match self.patience {
            Patience::Full | Patience::Close => false,
            Patience::Little => self.mu > 0.0 || self.plan.iterations > FEW_ITERATIONS,
            Patience::Continued => self.plan.iterations > FEW_ITERATIONS,
        }
    }

    /// One iteration: with second derivatives, or as large a part of them as serves, where they were asked for; and otherwise
    /// by Gauss-Newton.
    fn advance(&mut self, newton: bool) -> Outcome {
        self.newton.wait = self.newton.wait.saturating_sub(1);
        if newton {
            self.find_curvature();
            for halvings in 0..=CURVATURE_HALVINGS {
                if halvings > 0 {
                    self.halve_curvature();
                }
                let outcome = self.attempt(true, 0.0);
                if matches!(outcome, Outcome::Accepted | Outcome::Resolved) {
                    self.newton.tried(true);
                    return outcome;
                }
            }
            self.newton.tried(false);
        }
        let mut mu = self.mu;
        loop {
            let outcome = self.attempt(false, mu);
            if matches!(outcome, Outcome::Accepted | Outcome::Resolved) {
                return outcome;
            }
            if mu == self.mu {
                self.plan.regularised += 1;
            }
            mu = (mu * 10.0).max(FIRST_MU);
            if mu > MOST_MU {
                return outcome;
            }
        }
    }

    /// Second derivatives of the Lagrangian at the trajectory, in the workspace.
    fn find_curvature(&mut self) {
        let Self { problem, plan, work, scratch, .. } = self;
        let (at, phi) = (plan.trajectory.points(), problem.phi);
        work.hessian.clear();
        problem.system.cost_quadratics(at, phi, Curvature::Exact, &mut work.hessian, scratch);
        problem.system.add_dynamics_curvature(at, phi, &plan.costates, &mut work.hessian, scratch);
    }

    /// Halves what second derivatives add to Gauss-Newton's.
    fn halve_curvature(&mut self) {
        let (hessian, base) = (self.work.hessian.as_mut_slice(), self.plan.knots.cost.as_slice());
        for (h, b) in hessian.iter_mut().zip(base) {
            *h = 0.5 * (*h + b);
        }
    }

    /// The status at a place where no progress is made: converged where it is stationary but for rounding.
    fn ended(&mut self, status: PlanStatus) -> PlanStatus {
        self.linearise();
        if self.is_nearly_stationary() { PlanStatus::Converged } else { status }
    }

    /// Whether the plan is as stationary as rounding may allow.
    fn is_nearly_stationary(&self) -> bool {
        let tolerance = self.settings.tolerance;
        self.plan.relative_stationarity <= (1e3 * tolerance).min(tolerance.max(NEARLY))
    }

    fn linearise(&mut self) {
        linearise(self.problem, self.plan, Curvature::GaussNewton, self.scratch);
    }

    /// A sweep and a line search along its step, with the second derivatives that were found or by Gauss-Newton.
    fn attempt(&mut self, newton: bool, mu: f64) -> Outcome {
        let Self { problem, settings, plan, work, scratch, .. } = self;
        let hessian = newton.then_some(&work.hessian);
        let Ok(decrease) = sweep(*problem, settings.regularisation.of(mu), hessian, plan) else {
            return Outcome::Indefinite;
        };
        let resolution = 1e-14 * (1.0 + plan.nominal_cost.abs());
        let mut step = 1.0;
        let halvings = if newton { settings.max_halvings.min(NEWTON_HALVINGS) } else { settings.max_halvings };
        for _ in 0..=halvings {
            let predicted = -(step * decrease.linear + step * step * decrease.quadratic);
            let around = (problem.system, problem.phi, problem.bounds);
            let law = (&plan.policy, step);
            let cost = rollout_within(around, &plan.trajectory, law, &mut work.candidate, scratch);
            let actual = plan.nominal_cost - cost;
            let resolved = predicted <= 10.0 * resolution;
            let enough = settings.sufficient_decrease * predicted;
            if cost.is_finite() && (actual >= enough && actual > 0.0 || resolved && actual >= -resolution * 10.0) {
                std::mem::swap(&mut plan.trajectory, &mut work.candidate);
                plan.nominal_cost = cost;
                self.newton.close = actual <= 0.05 * (1.0 + cost.abs());
                if !newton {
                    self.mu =
                        if self.patience == Patience::Little && step < 0.5 { FIRST_MU } else { next_mu(mu, step) };
                }
                return if resolved { Outcome::Resolved } else { Outcome::Accepted };
            }
            step *= 0.5;
        }
        Outcome::Rejected
    }
}

/// The regularisation after a step of a length: less where the whole step served, more where little of it did.
fn next_mu(mu: f64, step: f64) -> f64 {
    let next = match step {
        1.0 => mu * 0.1,
        step if step < 0.1 => (mu * 3.0).max(FIRST_MU),
        _ => mu,
    };
    if next < LEAST_MU { 0.0 } else { next }
}
