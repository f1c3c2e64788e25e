use supple_study::study::Work;

use crate::arguments::{Ask, Subject, TraceOptions};
use crate::failure::Failure;

/// `supple trace TASK`
impl Ask for TraceOptions {
    fn work(&self, _: &Subject) -> Result<Work, Failure> {
        Ok(Work::Trace(supple_study::trace::TraceOptions {
            starts: self.starts.0,
            methods: self.method.clone(),
            gradients: self.gradient.clone(),
            seed: self.seed,
        }))
    }
}
