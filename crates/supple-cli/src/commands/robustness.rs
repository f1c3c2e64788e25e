use crate::Outcome;
use crate::arguments::RobustnessOptions;
use crate::failure::Failure;

/// `supple robustness`
pub fn robustness(_options: &RobustnessOptions) -> Result<Outcome, Failure> {
    Err(Failure::usage("not built yet".into()))
}
