//! Risk-sensitive plans: the least exponential of the cost that the controller will come to expect (theory, section P,
//! "Risk-sensitive plans").

use std::time::Instant;

use supple_kernels::{Matrices, Scratch, math};
use supple_lqg::risk::{Failure, Found, Given, belief_alone, price, solve};
use supple_lqg::{Belief, Noise, kalman};
use supple_model::system::{Curvature, RollOut};
use supple_text::short;

use super::{Descent, Model, Plan, PlanMode, PlanSettings, PlanStatus, Step, descend};
use crate::Error;
use crate::knots::Linearise;
use crate::problem::{Task, TaskAt};

/// Most sensitivities that are tried to find one that works.
const TRIES: usize = 20;
/// The search for it ends where this many times what works does not.
const CLOSE: f64 = 1.05;

/// Maximum number of consecutive steps near the end that do not halve the residual.
const MOST_STALLED: usize = 3;

/// Finds the risk-sensitive plan (theory, equation P.17) from the nominal one in `plan`. The cost-to-go and value of
/// information that it stores there are those of its gains for the expected cost, so that the parts of the expected cost
/// are correct for it.
///
/// # Errors
/// Where the sensitivity is so large that the exponential of the cost has no finite mean, with one that works.
pub(crate) fn plan_risk(
    TaskAt { task, phi }: TaskAt,
    settings: &PlanSettings,
    deadline: Option<Instant>,
    plan: &mut Plan,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    let nominal = plan.clone();
    let mut search = |sensitivity: f64, plan: &mut Plan| {
        Search::new(task.at(phi), settings, sensitivity, plan, scratch).run(deadline)
    };
    match search(settings.risk_sensitivity, plan)? {
        Ok(()) => Ok(()),
        Err(step) => {
            // Sizes of the sensitivity, whose sign stays.
            let (sign, size) = (settings.risk_sensitivity.signum(), settings.risk_sensitivity.abs());
            let (mut works, mut fails) = (0.0, size);
            for _ in 0..TRIES {
                if works > 0.0 && fails < CLOSE * works {
                    break;
                }
                // By orders of magnitude until one works.
                let between = if works > 0.0 { 0.5 * (works + fails) } else { 0.1 * fails };
                let between = rounded_down(between);
                *plan = nominal.clone();
                let worked = search(sign * between, plan)?.is_ok() && plan.status.is_converged();
                *(if worked { &mut works } else { &mut fails }) = between;
            }
            let largest = match works > 0.0 {
                true => format!("; {} has one, and {} has none", sign * works, short(sign * fails, 4)),
                false => String::new(),
            };
            Err(Error::Planning {
                plan: "risk",
                problem: format!(
                    "has no solution with risk_sensitivity = {}: the expected exponential cost is infinite from step {step} on{largest}",
                    short(settings.risk_sensitivity, 6)
                ),
                advice: match sign < 0.0 {
                    true => "choose a risk_sensitivity closer to 0, or less noise",
                    false => "lower risk_sensitivity, or the noise",
                },
            })
        }
    }
}

/// A positive number with three significant digits, not above it.
fn rounded_down(number: f64) -> f64 {
    let unit = 10f64.powi((math::ln(number) / std::f64::consts::LN_10).floor() as i32 - 2);
    format!("{:.2e}", (number / unit).floor() * unit).parse().unwrap_or(number)
}

/// The search for one sensitivity. Its merit is the residual of the law's equations: the risk-sensitive cost itself is not
/// what Newton's steps on them decrease.
struct Search<'a> {
    task: &'a Task,
    phi: &'a [f64],
    settings: &'a PlanSettings,
    sensitivity: f64,
    noise: Noise,
    belief: Belief,
    /// `[l_zz | l_z]` of Gauss-Newton curvature.
    convex: Matrices,
    plan: &'a mut Plan,
    /// What the sweep along the current plan found, and along the trial.
    found: Found,
    trial: Plan,
    found_there: Found,
    /// The shift of the current law.
    shift: f64,
    /// Consecutive steps near the end that did not halve the residual, and whether the last search along a step failed.
    stalled: usize,
    failed: bool,
    scratch: &'a mut Scratch,
    /// An error on the way.
    error: Option<Error>,
}

impl<'a> Search<'a> {
    fn new(
        TaskAt { task, phi }: TaskAt<'a>,
        settings: &'a PlanSettings,
        sensitivity: f64,
        plan: &'a mut Plan,
        scratch: &'a mut Scratch,
    ) -> Self {
        let size = task.system.dimensions();
        plan.mode = PlanMode::Risk;
        Self {
            task,
            phi,
            settings,
            sensitivity,
            noise: Noise::zeros(size.states, size.measurements),
            belief: Belief::zeros(size.states, size.measurements, task.steps),
            convex: Matrices::zeros(task.steps + 1, size.joint(), size.joint() + 1),
            trial: plan.clone(),
            plan,
            found: Found::default(),
            found_there: Found::default(),
            shift: 0.0,
            stalled: 0,
            failed: false,
            scratch,
            error: None,
        }
    }

    /// Searches from the plan; returns the step of a breakdown, if there is no law along it.
    fn run(mut self, deadline: Option<Instant>) -> Result<Result<(), usize>, Error> {
        self.found = match self.law(false)? {
            Ok(found) => found,
            Err(Failure::Breakdown(step)) => return Ok(Err(step)),
            Err(Failure::Indefinite(_)) => {
                self.plan.status = PlanStatus::Indefinite;
                return Ok(Ok(()));
            }
        };
        let settings = self.settings;
        let status = descend(&mut self, settings, deadline);
        match self.error.take() {
            Some(error) => Err(error),
            None => self.finish(status),
        }
    }

    /// Knots, belief and law along the plan, or along the trial; with exact curvature of the cost where that has a law.
    fn law(&mut self, of_trial: bool) -> Result<Result<Found, Failure>, Error> {
        let plan = if of_trial { &mut self.trial } else { &mut *self.plan };
        let (system, at) = (&*self.task.system, plan.trajectory.points());
        plan.knots.linearise_plan(system, at, self.phi, Curvature::Exact, self.scratch);
        plan.knots.linearise_measurement(system, at, self.phi, self.scratch);
        plan.knots.check_finite()?;
        self.task.noise.resolve_along(self.phi, &plan.trajectory.states, &mut self.noise)?;
        kalman(&plan.knots, &self.noise, &mut self.belief)?;
        let (knots, belief) = (&plan.knots, &self.belief);
        let exact = Given { knots, cost: &knots.cost, belief, sensitivity: self.sensitivity, shift: self.shift };
        let found = solve(exact, &mut plan.policy, &mut plan.costates);
        if !matches!(found, Err(Failure::Indefinite(_))) {
            return Ok(found);
        }
        system.cost_quadratics(at, self.phi, Curvature::GaussNewton, &mut self.convex, self.scratch);
        let convex = Given { cost: &self.convex, ..exact };
        Ok(solve(convex, &mut plan.policy, &mut plan.costates))
    }

    /// Whether the plan is almost as stationary as it should be.
    fn is_close(&self) -> bool {
        self.plan.relative_stationarity <= 1e3 * self.settings.tolerance
    }

    /// The law without a shift and with exact curvature, and what it costs.
    fn finish(mut self, status: PlanStatus) -> Result<Result<(), usize>, Error> {
        self.shift = 0.0;
        let found = self.law(false)?;
        let Self { belief, sensitivity, plan, .. } = self;
        let given = Given { knots: &plan.knots, cost: &plan.knots.cost, belief: &belief, sensitivity, shift: 0.0 };
        let exact = solve(given, &mut plan.policy, &mut plan.costates);
        plan.status = status;
        match (found, exact) {
            (Err(Failure::Breakdown(step)), _) | (_, Err(Failure::Breakdown(step))) => return Ok(Err(step)),
            (Ok(found), exact) => {
                plan.stationarity = found.residual;
                plan.relative_stationarity = found.relative();
                plan.objective = plan.nominal_cost + found.value + belief_alone(&plan.knots, &belief);
                if exact.is_err() {
                    plan.status = PlanStatus::Indefinite;
                }
            }
            (Err(Failure::Indefinite(_)), _) => plan.status = PlanStatus::Indefinite,
        }
        price(&plan.knots, &mut plan.policy);
        Ok(Ok(()))
    }
}

impl Descent for Search<'_> {
    const MU: (f64, f64) = (1e-9, 1e9);
    const ATTEMPTS: usize = 1;
    const MOST_HIDDEN_AT_END: usize = 0;

    fn plan(&mut self) -> &mut Plan {
        self.plan
    }

    fn merit(&self) -> f64 {
        self.found.residual
    }

    fn measure(&mut self) {
        (self.plan.stationarity, self.plan.relative_stationarity) = (self.found.residual, self.found.relative());
    }

    fn solve(&mut self, mu: f64) -> Result<Model, PlanStatus> {
        self.failed = true;
        if mu != self.shift {
            self.shift = mu;
            // The belief may be that of a trial.
            match self.law(false) {
                Ok(Ok(found)) => self.found = found,
                Ok(Err(_)) => return Err(PlanStatus::Indefinite),
                Err(error) => {
                    self.error = Some(error);
                    return Err(PlanStatus::Indefinite);
                }
            }
        }
        Ok(Model::Slope(-self.found.residual))
    }

    fn try_share(&mut self, share: f64) -> f64 {
        let Plan { trajectory, policy, .. } = &*self.plan;
        let law = RollOut::Law { reference: trajectory, policy, step: share, bounds: None };
        let cost = self.task.system.roll_out(law, self.phi, &mut self.trial.trajectory, self.scratch);
        self.trial.nominal_cost = cost;
        match cost.is_finite().then(|| self.law(true)) {
            Some(Ok(Ok(found))) => {
                self.found_there = found;
                found.residual
            }
            _ => f64::NAN,
        }
    }

    fn accept(&mut self, _: Step) {
        let close = self.is_close() && self.found_there.residual > 0.5 * self.found.residual;
        self.stalled = if close { self.stalled + 1 } else { 0 };
        let counts = (self.plan.iterations, self.plan.regularised);
        std::mem::swap(self.plan, &mut self.trial);
        (self.plan.iterations, self.plan.regularised) = counts;
        (self.found, self.failed) = (self.found_there, false);
    }

    fn ease(&self, mu: f64, _: Step) -> f64 {
        if mu <= Self::MU.0 { 0.0 } else { 0.1 * mu }
    }

    fn gives_up(&self) -> bool {
        self.is_close() && (self.failed || self.stalled > MOST_STALLED)
    }
}
