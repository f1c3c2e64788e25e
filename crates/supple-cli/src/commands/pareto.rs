use supple::design::DesignStatus;
use supple_study::{Made, StudyResult};

use crate::Outcome;
use crate::arguments::ParetoOptions;
use crate::failure::Failure;
use crate::pages::stopped_front;
use crate::present::{present, tell};
use crate::progress::{Stopping, watched};

/// `supple pareto TASK`
pub fn pareto(options: &ParetoOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let ParetoOptions { points, starts, seed, .. } = *options;
    let wanted = supple_study::pareto::ParetoOptions { points, starts, seed };
    options.output.check("pareto")?;
    let front = watched(Stopping::AtPause, |watch| supple_study::pareto::run(&loaded, &wanted, watch))?;
    let made = Made::here("pareto", seed, &loaded);
    let whole = front.points.iter().all(|point| point.status == DesignStatus::Converged && point.warnings.is_empty());
    let outcome = if whole { Outcome::Success } else { Outcome::Shortfall };
    let outcome = outcome.and(tell(stopped_front(&front)));
    Ok(outcome.and(present(&StudyResult::Pareto(Box::new(front)), &made, &options.output)?))
}
