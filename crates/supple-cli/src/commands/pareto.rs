use supple_study::study::Work;

use crate::arguments::{Ask, Count, ParetoOptions, Subject};
use crate::failure::Failure;

/// `supple pareto TASK`
impl Ask for ParetoOptions {
    fn work(&self, _: &Subject) -> Result<Work, Failure> {
        let Self { points: Count(points), starts: Count(starts), seed } = *self;
        Ok(Work::Pareto(supple_study::pareto::ParetoOptions { points, starts, seed }))
    }
}
