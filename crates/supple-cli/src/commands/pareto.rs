use crate::Outcome;
use crate::arguments::ParetoOptions;
use crate::failure::Failure;

/// `supple pareto`
pub fn pareto(_options: &ParetoOptions) -> Result<Outcome, Failure> {
    Err(Failure::usage("not built yet".into()))
}
