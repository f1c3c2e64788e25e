use supple_study::LoadedTask;
use supple_study::study::Work;

use crate::arguments::{Asks, Output, TaskArguments, TraceOptions};
use crate::failure::Failure;

/// `supple trace TASK`
impl Asks for TraceOptions {
    fn task(&self) -> &TaskArguments {
        &self.task
    }

    fn output(&self) -> &Output {
        &self.output
    }

    fn work(&self, _: &LoadedTask) -> Result<Work, Failure> {
        Ok(Work::Trace(supple_study::trace::TraceOptions {
            starts: self.starts,
            methods: self.method.clone(),
            gradients: self.gradient.clone(),
            seed: self.seed,
        }))
    }
}
