use supple_study::study::Work;

use crate::arguments::{Ask, EvaluateOptions, GradientChoice, Subject};
use crate::failure::Failure;

/// `supple evaluate TASK`
impl Ask for EvaluateOptions {
    fn work(&self, &Subject { task, is_kept, .. }: &Subject) -> Result<Work, Failure> {
        Ok(Work::Evaluate(supple_study::evaluate::EvaluateOptions {
            total_gradient: matches!(self.gradient, GradientChoice::Total | GradientChoice::Both),
            frozen_gradient: matches!(self.gradient, GradientChoice::Frozen | GradientChoice::Both),
            needed: true,
            rollouts: task.problem.rollouts(self.rollouts.map(|count| count.0)),
            branches: self.branches.0,
            seed: self.seed,
            trajectories: is_kept,
        }))
    }
}
