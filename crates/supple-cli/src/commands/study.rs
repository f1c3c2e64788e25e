use crate::Outcome;
use crate::arguments::StudyOptions;
use crate::failure::Failure;

/// `supple study`
pub fn study(_options: &StudyOptions) -> Result<Outcome, Failure> {
    Err(Failure::usage("not built yet".into()))
}
