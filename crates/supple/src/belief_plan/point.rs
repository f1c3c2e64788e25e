use supple_kernels::{Matrices, Scratch, rows};
use supple_lqg::{Belief, Noise, Regularisation, cost_parts, kalman, solve_riccati};
use supple_model::system::RollOut;

use crate::Error;
use crate::gradient::Planned;
use crate::knots::Linearise;
use crate::plan::Plan;
use crate::problem::{Task, TaskAt};

/// One trajectory, with all quantities on which its expected cost depends.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    /// Trajectory, knots and policy; its `objective` is the expected cost, with its own curvature of the cost.
    pub plan: Plan,
    pub noise: Noise,
    pub belief: Belief,
}

impl Point {
    pub fn new(task: &Task) -> Self {
        let size = task.system.dimensions();
        Self {
            plan: Plan::zeros(size, task.steps),
            noise: Noise::zeros(size.states, size.measurements),
            belief: Belief::zeros(size.states, size.measurements, task.steps),
        }
    }

    /// Rolls out the controls of the trajectory from its first state, and assesses it.
    ///
    /// # Errors
    /// If it has no finite expected cost.
    pub fn simulate(&mut self, task: &Task, phi: &[f64], scratch: &mut Scratch) -> Result<(), Error> {
        self.plan.nominal_cost = task.system.roll_out(RollOut::Controls, phi, &mut self.plan.trajectory, scratch);
        self.assess(task, phi, scratch)
    }

    /// Rolls out `u = ubar + step v + K (x - xbar)`, with `v` the feedforward of the policy, and assesses it.
    ///
    /// # Errors
    /// Where it has no finite expected cost.
    pub fn follow(&mut self, TaskAt { task, phi }: TaskAt, law: RollOut, scratch: &mut Scratch) -> Result<(), Error> {
        let to = &mut self.plan.trajectory;
        self.plan.nominal_cost = task.system.roll_out(law, phi, to, scratch);
        self.assess(task, phi, scratch)
    }

    /// Computes knots, policy, belief and expected cost of the current trajectory; its nominal cost must be set (theory,
    /// equation P.10).
    ///
    /// # Errors
    /// If a number is not finite, or the control's curvature or a covariance is not positive definite.
    pub fn assess(&mut self, task: &Task, phi: &[f64], scratch: &mut Scratch) -> Result<(), Error> {
        let Self { plan, noise, belief } = self;
        let at = plan.trajectory.points();
        plan.objective = f64::INFINITY;
        if !plan.nominal_cost.is_finite() {
            return Err(Error::NotFinite { what: "the cost of a trajectory" });
        }
        plan.knots.linearise_plan(&*task.system, at, phi, plan.curvature, scratch);
        plan.knots.linearise_measurement(&*task.system, at, phi, scratch);
        plan.knots.check_finite()?;
        solve_riccati(&plan.knots.dynamics, &plan.knots.cost, Regularisation::default(), &mut plan.policy)?;
        task.noise.resolve_along(phi, &plan.trajectory.states, noise)?;
        kalman(&plan.knots, noise, belief)?;
        if let Some(step) = gains_by_noise(plan, noise) {
            return Err(Error::not_definite("the cost-to-go where there is noise", step));
        }
        let cost = cost_parts(plan.nominal_cost, &plan.policy, belief, noise)?.expected();
        if !cost.is_finite() {
            return Err(Error::NotFinite { what: "the expected cost of a trajectory" });
        }
        plan.objective = cost;
        Ok(())
    }

    /// The inputs that gradients need.
    pub fn gradient<'a>(&'a self, task: &'a Task, phi: &'a [f64]) -> Planned<'a> {
        Planned::of(task.at(phi), &self.plan, &self.belief, &self.noise)
    }
}

/// The first step at which noise appears to lower the cost because of negative curvature: `Tr(S_{t+1} W_t) < 0`
/// or `Tr(S_0 X_0) < 0`. Minimising the expected cost is then meaningless: as `Q_uu` becomes singular, it falls without
/// bound.
fn gains_by_noise(plan: &Plan, noise: &Noise) -> Option<usize> {
    let price = |s: usize, covariance: &Matrices, t: usize| rows::dot(plan.policy.curvature.at(s), covariance.at(t));
    let process = (0..plan.trajectory.steps()).find(|&t| price(t + 1, &noise.process, t) < 0.0);
    if price(0, &noise.initial, 0) < 0.0 { Some(0) } else { process }
}
