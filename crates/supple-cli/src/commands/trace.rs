use crate::Outcome;
use crate::arguments::TraceOptions;
use crate::failure::Failure;

/// `supple trace`
pub fn trace(_options: &TraceOptions) -> Result<Outcome, Failure> {
    Err(Failure::usage("not built yet".into()))
}
