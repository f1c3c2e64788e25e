use crate::Outcome;
use crate::arguments::SweepOptions;
use crate::failure::Failure;

/// `supple sweep`
pub fn sweep(_options: &SweepOptions) -> Result<Outcome, Failure> {
    Err(Failure::usage("not built yet".into()))
}
