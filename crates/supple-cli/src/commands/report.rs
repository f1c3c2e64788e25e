use crate::Outcome;
use crate::arguments::ReportOptions;
use crate::failure::Failure;

/// `supple report`
pub fn report(_options: &ReportOptions) -> Result<Outcome, Failure> {
    Err(Failure::usage("not built yet".into()))
}
