use supple_study::LoadedTask;
use supple_study::study::Work;

use crate::arguments::{Asks, Output, ParetoOptions, TaskArguments};
use crate::failure::Failure;

/// `supple pareto TASK`
impl Asks for ParetoOptions {
    fn task(&self) -> &TaskArguments {
        &self.task
    }

    fn output(&self) -> &Output {
        &self.output
    }

    fn work(&self, _: &LoadedTask) -> Result<Work, Failure> {
        let Self { points, starts, seed, .. } = *self;
        Ok(Work::Pareto(supple_study::pareto::ParetoOptions { points, starts, seed }))
    }
}
