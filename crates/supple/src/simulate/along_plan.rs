use super::sample::{SampleId, sample_of};
use super::{MonteCarlo, Rollouts, Sample, World, sampled};
use crate::Error;
use crate::controller::Controller;
use crate::plan::Plan;
use crate::problem::Task;

impl Controller {
    /// Rolls it out in closed loop with its task at the parameters `phi`, its own filter in the loop, on all
    /// threads. The noise is that of roll-outs with the extended filter for the same seed; `predicted` is the expected cost.
    ///
    /// # Errors
    /// Where a covariance is indefinite.
    pub fn monte_carlo(
        &self,
        task: &Task,
        phi: &[f64],
        predicted: f64,
        rollouts: Rollouts,
    ) -> Result<MonteCarlo, Error> {
        let world = World { phi, noise: &self.noise };
        sampled(task, &self.as_plan(), Some(self), world, predicted, rollouts)
    }

    /// The first sample of [`monte_carlo`](Self::monte_carlo), recorded step by step.
    ///
    /// # Errors
    /// Where a covariance is indefinite.
    pub fn sample(&self, task: &Task, phi: &[f64], seed: u64) -> Result<Sample, Error> {
        sample_of(task, &self.as_plan(), Some(self), World { phi, noise: &self.noise }, SampleId { seed, number: 0 })
    }

    /// A plan with its trajectory and control law: all that roll-outs read of a plan.
    fn as_plan(&self) -> Plan {
        let mut plan = Plan::zeros(self.dimensions, self.steps());
        plan.trajectory = self.trajectory.clone();
        plan.policy.feedback = self.feedback.clone();
        plan.policy.feedforward = self.feedforward.clone();
        plan
    }
}
