use crate::Outcome;
use crate::arguments::PlotOptions;
use crate::failure::Failure;

/// `supple plot`
pub fn plot(_options: &PlotOptions) -> Result<Outcome, Failure> {
    Err(Failure::usage("not built yet".into()))
}
