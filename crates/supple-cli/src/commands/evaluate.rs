use supple_study::LoadedTask;
use supple_study::study::Work;

use crate::arguments::{Asks, EvaluateOptions, GradientChoice, Output, TaskArguments};
use crate::failure::Failure;

/// `supple evaluate TASK`
impl Asks for EvaluateOptions {
    fn task(&self) -> &TaskArguments {
        &self.task
    }

    fn output(&self) -> &Output {
        &self.output
    }

    fn work(&self, task: &LoadedTask) -> Result<Work, Failure> {
        Ok(Work::Evaluate(supple_study::evaluate::EvaluateOptions {
            total_gradient: matches!(self.gradient, GradientChoice::Total | GradientChoice::Both),
            frozen_gradient: matches!(self.gradient, GradientChoice::Frozen | GradientChoice::Both),
            needed: true,
            rollouts: task.problem.rollouts(self.rollouts),
            branches: self.branches,
            seed: self.seed,
            trajectories: self.output.out.is_some(),
        }))
    }
}
