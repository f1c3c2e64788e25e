use supple_study::LoadedTask;
use supple_study::study::Work;

use crate::arguments::{Asks, BoundOptions, Output, TaskArguments};
use crate::failure::Failure;

/// `supple bound TASK`
impl Asks for BoundOptions {
    fn task(&self) -> &TaskArguments {
        &self.task
    }

    fn output(&self) -> &Output {
        &self.output
    }

    fn work(&self, _: &LoadedTask) -> Result<Work, Failure> {
        let Self { cost, curve, stationary, .. } = *self;
        Ok(Work::Bound(supple_study::bound::BoundOptions { task: self.name.clone(), cost, stationary, curve }))
    }
}
