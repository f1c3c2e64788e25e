use supple_kernels::{Matrices, Scratch};

use super::costates::Stationarity;
use super::{PlanSettings, PlanStatus, Policy, Regularisation, rollout, simulate_controls, solve_riccati};
use crate::knots::Knots;
use crate::system::{Curvature, System};
use crate::trajectory::Trajectory;
use crate::{Dimensions, Error};

/// A reference trajectory with its control law, and how the search for it ended.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The trajectory.
    pub trajectory: Trajectory,
    /// Its linearisation, with exact second derivatives of the cost.
    pub knots: Knots,
    /// The control law and cost-to-go of the final sweep, without regularisation.
    pub policy: Policy,
    /// Costates `lambda` of the trajectory, length n, N + 1 of them.
    pub costates: Matrices,
    /// Cost of the trajectory without noise.
    pub nominal_cost: f64,
    /// How the search ended.
    pub status: PlanStatus,
    /// Iterations made.
    pub iterations: usize,
    /// The largest `|l_u + B' lambda|` on the trajectory.
    pub stationarity: f64,
    /// The same, relative to 1 plus the largest `|l_u|`.
    pub relative_stationarity: f64,
    /// How many iterations had to raise the regularisation.
    pub regularised: usize,
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
            status: PlanStatus::default(),
            iterations: 0,
            stationarity: f64::NAN,
            relative_stationarity: f64::NAN,
            regularised: 0,
        }
    }
}

/// Memory that planning reuses.
#[derive(Clone, Debug)]
pub struct PlanWorkspace {
    candidate: Trajectory,
    hessian: Matrices,
}

impl PlanWorkspace {
    /// Memory for `steps` steps.
    pub fn new(dimensions: Dimensions, steps: usize) -> Self {
        let joint = dimensions.joint();
        Self { candidate: Trajectory::zeros(dimensions, steps), hessian: Matrices::zeros(steps + 1, joint, joint + 1) }
    }
}

const LEAST_MU: f64 = 1e-9;
const MOST_MU: f64 = 1e12;

/// The search's state between iterations.
struct Search<'a> {
    system: &'a dyn System,
    phi: &'a [f64],
    settings: &'a PlanSettings,
    plan: &'a mut Plan,
    work: &'a mut PlanWorkspace,
    scratch: &'a mut Scratch,
    mu: f64,
    /// Whether the last step was a full one that lowered the cost little: Newton's neighbourhood.
    close: bool,
}

/// How one iteration went.
enum Outcome {
    Accepted,
    /// No step lowered the cost.
    Rejected,
    /// The curvature is not positive.
    Indefinite,
    /// The predicted decrease is below what the cost can resolve.
    Resolved,
}

/// Finds the nominal plan of partially observed iLQG by line search and regularisation (theory, section P).
///
/// Starts from the first state and the controls in `plan.trajectory`, and leaves the whole plan in `plan`. Allocates
/// nothing once workspace and scratch have been used.
///
/// # Errors
/// Where the first guess already leads to a cost or derivative that is not finite.
pub fn plan(
    system: &dyn System,
    phi: &[f64],
    settings: &PlanSettings,
    plan: &mut Plan,
    work: &mut PlanWorkspace,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    plan.nominal_cost = simulate_controls(system, phi, &mut plan.trajectory, scratch);
    plan.iterations = 0;
    plan.regularised = 0;
    if !plan.nominal_cost.is_finite() {
        return Err(Error::NotFinite { what: "the cost of the first guess", step: 0 });
    }
    let mut search = Search { system, phi, settings, plan, work, scratch, mu: 0.0, close: false };
    let status = search.run();
    finish(system, phi, search.plan, status, search.scratch)
}

/// Linearises dynamics and cost at the plan's trajectory, and finds its costates and stationarity.
pub(super) fn linearise(
    system: &dyn System,
    phi: &[f64],
    plan: &mut Plan,
    curvature: Curvature,
    scratch: &mut Scratch,
) {
    plan.knots.linearise_plan(system, plan.trajectory.points(), phi, curvature, scratch);
    let Stationarity { residual, scale } =
        super::sweep_costates(&plan.knots.dynamics, &plan.knots.cost, &mut plan.costates);
    plan.stationarity = residual;
    plan.relative_stationarity = residual / (1.0 + scale);
}

/// The final sweep: exact curvature of the cost, no second derivatives of the dynamics, no regularisation.
pub(super) fn finish(
    system: &dyn System,
    phi: &[f64],
    plan: &mut Plan,
    status: PlanStatus,
    scratch: &mut Scratch,
) -> Result<(), Error> {
    linearise(system, phi, plan, Curvature::Exact, scratch);
    plan.knots.linearise_measurement(system, plan.trajectory.points(), phi, scratch);
    plan.knots.check_finite()?;
    plan.status = status;
    let mut mu = 0.0;
    while let Err(step) = sweep_with(mu, plan) {
        // A law that is defined everywhere, for people to look at; the status says that it is no optimum.
        plan.status = PlanStatus::Indefinite;
        mu = (10.0 * mu).max(LEAST_MU);
        if mu > MOST_MU {
            return Err(Error::NotPositiveDefinite { what: "the control's curvature", step });
        }
    }
    Ok(())
}

fn sweep_with(mu: f64, plan: &mut Plan) -> Result<(), usize> {
    let regularisation = Regularisation { control: mu, state: 0.0 };
    solve_riccati(&plan.knots.dynamics, &plan.knots.cost, regularisation, &mut plan.policy).map(drop)
}

impl Search<'_> {
    fn run(&mut self) -> PlanStatus {
        let (mut unresolved, mut last_stationarity) = (0, f64::INFINITY);
        while self.plan.iterations < self.settings.max_iterations {
            let newton = self.settings.newton && self.close;
            self.linearise(if newton { Curvature::Exact } else { Curvature::GaussNewton });
            if self.is_stationary() {
                return PlanStatus::Converged;
            }
            self.plan.iterations += 1;
            let mut outcome = self.iterate(newton);
            if newton && !matches!(outcome, Outcome::Accepted | Outcome::Resolved) {
                self.linearise(Curvature::GaussNewton);
                outcome = self.iterate(false);
                self.close = false;
            }
            match outcome {
                Outcome::Accepted => unresolved = 0,
                Outcome::Resolved => {
                    // Rounding hides the cost's decrease. Steps that still bring the plan closer to stationary go on; a
                    // few others settle the last digits.
                    let closer = self.plan.relative_stationarity < 0.5 * last_stationarity;
                    unresolved = if closer { 0 } else { unresolved + 1 };
                    last_stationarity = self.plan.relative_stationarity;
                    if unresolved > 3 {
                        return self.stalled(PlanStatus::LineSearchStalled);
                    }
                }
                Outcome::Rejected | Outcome::Indefinite => {
                    self.plan.regularised += 1;
                    self.mu = (self.mu * 10.0).max(LEAST_MU);
                    if self.mu > MOST_MU {
                        let indefinite = matches!(outcome, Outcome::Indefinite);
                        let status = if indefinite { PlanStatus::Indefinite } else { PlanStatus::LineSearchStalled };
                        return self.stalled(status);
                    }
                }
            }
        }
        self.stalled(PlanStatus::MaxIterations)
    }

    /// The status at a place where no progress is made: converged where it is stationary but for rounding.
    fn stalled(&mut self, status: PlanStatus) -> PlanStatus {
        self.linearise(Curvature::GaussNewton);
        let loose = self.plan.relative_stationarity <= 1e3 * self.settings.tolerance;
        if loose { PlanStatus::Converged } else { status }
    }

    fn linearise(&mut self, curvature: Curvature) {
        linearise(self.system, self.phi, self.plan, curvature, self.scratch);
    }

    fn is_stationary(&self) -> bool {
        self.plan.relative_stationarity <= self.settings.tolerance
    }

    fn iterate(&mut self, newton: bool) -> Outcome {
        let mu = self.settings.regularisation.of(self.mu);
        let Self { system, phi, plan, work, scratch, .. } = self;
        let swept = if newton {
            work.hessian.copy_from(&plan.knots.cost);
            let at = plan.trajectory.points();
            system.add_dynamics_curvature(at, phi, &plan.costates, &mut work.hessian, scratch);
            solve_riccati(&plan.knots.dynamics, &work.hessian, mu, &mut plan.policy)
        } else {
            solve_riccati(&plan.knots.dynamics, &plan.knots.cost, mu, &mut plan.policy)
        };
        let decrease = match swept {
            Ok(decrease) => decrease,
            Err(_) => return Outcome::Indefinite,
        };
        let resolution = 1e-14 * (1.0 + plan.nominal_cost.abs());
        let mut step = 1.0;
        for _ in 0..=self.settings.max_halvings {
            let predicted = -(step * decrease.linear + step * step * decrease.quadratic);
            let cost = rollout(
                self.system,
                self.phi,
                &self.plan.trajectory,
                (&self.plan.policy, step),
                &mut self.work.candidate,
                self.scratch,
            );
            let actual = self.plan.nominal_cost - cost;
            let resolved = predicted <= 10.0 * resolution;
            let enough = self.settings.sufficient_decrease * predicted;
            if cost.is_finite() && (actual >= enough && actual > 0.0 || resolved && actual >= -resolution * 10.0) {
                self.close = step == 1.0 && actual <= 0.05 * (1.0 + cost.abs());
                std::mem::swap(&mut self.plan.trajectory, &mut self.work.candidate);
                self.plan.nominal_cost = cost;
                self.mu = if self.mu <= LEAST_MU { 0.0 } else { self.mu * 0.2 };
                return if resolved { Outcome::Resolved } else { Outcome::Accepted };
            }
            step *= 0.5;
        }
        Outcome::Rejected
    }
}
