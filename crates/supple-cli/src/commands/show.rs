use crate::Outcome;
use crate::arguments::ShowOptions;
use crate::failure::Failure;

/// `supple show`
pub fn show(_options: &ShowOptions) -> Result<Outcome, Failure> {
    Err(Failure::usage("not built yet".into()))
}
