//! Risk-sensitive plans: the least exponential of the cost that the controller will come to expect (theory, section P,
//! "Risk-sensitive plans").

mod sweep;

use std::time::Instant;

use supple_kernels::{Matrices, Scratch, rows};
use supple_lqg::Noise;
use supple_lqg::{Belief, kalman};
use supple_model::Trajectory;
use supple_model::system::Curvature;

use super::descent::is_over;
use super::{Plan, PlanMode, PlanSettings, PlanStatus, rollout};
use crate::Error;
use crate::knots::Linearise;
use crate::problem::Task;
use sweep::{Failure, Found, Given, price, risk_sweep};

/// Halvings of an interval to find the largest sensitivity that works.
const BISECTIONS: usize = 20;

const LEAST_SHIFT: f64 = 1e-9;
const MOST_SHIFT: f64 = 1e9;

/// Finds the risk-sensitive plan (theory, equation P.17) from the nominal one in `plan`. The cost-to-go and value of
/// information that it stores there are those of its gains for the expected cost, so that the parts of the expected cost
/// are correct for it.
///
/// # Errors
/// Where the sensitivity is so large that the exponential of the cost has no finite mean, with the largest that works;
/// or where controls have bounds that must be kept.
pub(crate) fn plan_risk(
    (task, phi): (&Task, &[f64]),
    (settings, deadline): (&PlanSettings, Option<Instant>),
    plan: &mut Plan,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    if task.control_bounds.is_some() {
        return Err(Error::Planning {
            plan: "risk",
            problem: "does not support control limits".to_owned(),
            advice: "set `enforce_effort_limits = false`, or use plan = \"nominal\"",
        });
    }
    let mut search = Search::new(task, phi, (settings, deadline));
    let nominal = plan.clone();
    match search.run(settings.risk_sensitivity, plan, scratch)? {
        Ok(()) => Ok(()),
        Err(step) => {
            let (mut works, mut fails) = (0.0, settings.risk_sensitivity);
            for _ in 0..BISECTIONS {
                let between = 0.5 * (works + fails);
                *plan = nominal.clone();
                let worked = search.run(between, plan, scratch)?.is_ok();
                *(if worked { &mut works } else { &mut fails }) = between;
            }
            let largest = if works > 0.0 { format!("; the largest valid value is {works:.4e}") } else { String::new() };
            Err(Error::Planning {
                plan: "risk",
                problem: format!(
                    "has no solution with risk_sensitivity = {}: the expected exponential cost is infinite from step {step} on{largest}",
                    settings.risk_sensitivity
                ),
                advice: "lower risk_sensitivity, or the noise",
            })
        }
    }
}

struct Search<'a> {
    task: &'a Task,
    phi: &'a [f64],
    settings: &'a PlanSettings,
    deadline: Option<Instant>,
    noise: Noise,
    belief: Belief,
    /// `[l_zz | l_z]` of Gauss-Newton curvature.
    convex: Matrices,
    candidate: Trajectory,
}

impl<'a> Search<'a> {
    fn new(task: &'a Task, phi: &'a [f64], (settings, deadline): (&'a PlanSettings, Option<Instant>)) -> Self {
        let size = task.system.dimensions();
        Self {
            task,
            phi,
            settings,
            deadline,
            noise: Noise::zeros(size.states, size.measurements),
            belief: Belief::zeros(size.states, size.measurements, task.steps),
            convex: Matrices::zeros(task.steps + 1, size.joint(), size.joint() + 1),
            candidate: Trajectory::zeros(size, task.steps),
        }
    }

    /// Searches from the plan; returns the step of a breakdown, if the search ends in one.
    fn run(&mut self, sensitivity: f64, plan: &mut Plan, scratch: &mut Scratch) -> Result<Result<(), usize>, Error> {
        let (mut shift, mut stalled) = (0.0, 0);
        plan.mode = PlanMode::Risk;
        let mut found = match self.law(sensitivity, shift, plan, scratch)? {
            Ok(found) => found,
            Err(Failure::Breakdown(step)) => return Ok(Err(step)),
            Err(Failure::Indefinite(_)) => {
                plan.status = PlanStatus::Indefinite;
                return Ok(Ok(()));
            }
        };
        let status = loop {
            let stationarity = found.residual / (1.0 + found.scale);
            if stationarity <= self.settings.tolerance {
                break PlanStatus::Converged;
            }
            let loose = stationarity <= 1e3 * self.settings.tolerance;
            if plan.iterations >= self.settings.max_iterations {
                break if loose { PlanStatus::Converged } else { PlanStatus::MaxIterations };
            }
            if is_over(self.deadline) {
                break PlanStatus::TimeLimit;
            }
            plan.iterations += 1;
            match self.step(sensitivity, shift, (plan, found.residual), scratch)? {
                Some(better) => {
                    stalled = if better.residual > 0.5 * found.residual && loose { stalled + 1 } else { 0 };
                    found = better;
                    shift = if shift <= LEAST_SHIFT { 0.0 } else { 0.1 * shift };
                    if stalled > 3 {
                        break PlanStatus::Converged;
                    }
                }
                None if loose => break PlanStatus::Converged,
                None => {
                    plan.regularised += 1;
                    shift = (10.0 * shift).max(LEAST_SHIFT);
                    if shift > MOST_SHIFT {
                        break PlanStatus::LineSearchStalled;
                    }
                    // The law of the trajectory with shorter steps.
                    if let Ok(again) = self.law(sensitivity, shift, plan, scratch)? {
                        found = again;
                    }
                }
            }
        };
        self.finish(sensitivity, status, plan, scratch)
    }

    /// Knots, belief and law of the plan's trajectory; with exact curvature of the cost where that has a law.
    fn law(
        &mut self,
        sensitivity: f64,
        shift: f64,
        plan: &mut Plan,
        scratch: &mut Scratch,
    ) -> Result<Result<Found, Failure>, Error> {
        let (system, at) = (&*self.task.system, plan.trajectory.points());
        plan.knots.linearise_plan(system, at, self.phi, Curvature::Exact, scratch);
        plan.knots.linearise_measurement(system, at, self.phi, scratch);
        plan.knots.check_finite()?;
        self.task.noise.resolve_along(self.phi, &plan.trajectory.states, &mut self.noise)?;
        kalman(&plan.knots, &self.noise, &mut self.belief)?;
        let (knots, belief) = (&plan.knots, &self.belief);
        let exact = Given { knots, cost: &knots.cost, belief, sensitivity, shift };
        let found = risk_sweep(exact, &mut plan.policy, &mut plan.costates);
        if !matches!(found, Err(Failure::Indefinite(_))) {
            return Ok(found);
        }
        system.cost_quadratics(at, self.phi, Curvature::GaussNewton, &mut self.convex, scratch);
        let convex = Given { cost: &self.convex, ..exact };
        Ok(risk_sweep(convex, &mut plan.policy, &mut plan.costates))
    }

    /// The longest step of those halved that brings the plan closer to stationary, and its law.
    fn step(
        &mut self,
        sensitivity: f64,
        shift: f64,
        (plan, residual): (&mut Plan, f64),
        scratch: &mut Scratch,
    ) -> Result<Option<Found>, Error> {
        let before = plan.clone();
        let mut share = 1.0;
        for _ in 0..=self.settings.max_halvings {
            let law = (&before.policy, share);
            let cost = rollout(&*self.task.system, self.phi, &before.trajectory, law, &mut self.candidate, scratch);
            if cost.is_finite() {
                plan.trajectory.clone_from(&self.candidate);
                plan.nominal_cost = cost;
                if let Ok(Ok(found)) = self.law(sensitivity, shift, plan, scratch)
                    && found.residual <= (1.0 - self.settings.sufficient_decrease * share) * residual
                {
                    return Ok(Some(found));
                }
            }
            share *= 0.5;
        }
        let (iterations, regularised) = (plan.iterations, plan.regularised);
        *plan = before;
        (plan.iterations, plan.regularised) = (iterations, regularised);
        Ok(None)
    }

    /// The law without a shift and with exact curvature, and what it costs.
    fn finish(
        &mut self,
        sensitivity: f64,
        status: PlanStatus,
        plan: &mut Plan,
        scratch: &mut Scratch,
    ) -> Result<Result<(), usize>, Error> {
        let found = self.law(sensitivity, 0.0, plan, scratch)?;
        let given = Given { knots: &plan.knots, cost: &plan.knots.cost, belief: &self.belief, sensitivity, shift: 0.0 };
        let exact = risk_sweep(given, &mut plan.policy, &mut plan.costates);
        plan.status = status;
        match (found, exact) {
            (Err(Failure::Breakdown(step)), _) | (_, Err(Failure::Breakdown(step))) => return Ok(Err(step)),
            (Ok(found), exact) => {
                plan.stationarity = found.residual;
                plan.relative_stationarity = found.residual / (1.0 + found.scale);
                plan.objective = plan.nominal_cost + found.value + self.belief_alone(plan);
                if exact.is_err() {
                    plan.status = PlanStatus::Indefinite;
                }
            }
            (Err(Failure::Indefinite(_)), _) => plan.status = PlanStatus::Indefinite,
        }
        price(&plan.knots, &mut plan.policy);
        Ok(Ok(()))
    }

    /// `1/2 sum Tr(l_xx Sigma)`: what the covariance of the belief costs at any controls.
    fn belief_alone(&self, plan: &Plan) -> f64 {
        let (cost, sigma) = (&plan.knots.cost, &self.belief.corrected);
        let n = sigma.rows();
        let at = |t: usize| {
            let row = |i: usize| &cost.at(t)[i * cost.stride()..][..n];
            (0..n).map(|i| rows::dot(row(i), &sigma.at(t)[i * sigma.stride()..][..n])).sum::<f64>()
        };
        0.5 * (0..sigma.count()).map(at).sum::<f64>()
    }
}
