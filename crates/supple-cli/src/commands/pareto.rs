use supple::design::DesignStatus;
use supple_study::{Made, StudyResult};

use crate::Outcome;
use crate::arguments::ParetoOptions;
use crate::failure::Failure;
use crate::pages::stopped_front;
use crate::present::{found_or_kept, present_resumable};
use crate::progress::{Stopping, watched};

/// `supple pareto TASK`
pub fn pareto(options: &ParetoOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let ParetoOptions { points, starts, seed, .. } = *options;
    let wanted = supple_study::pareto::ParetoOptions { points, starts, seed };
    options.output.check("pareto")?;
    let folder = options.output.out.as_deref();
    let found = watched(Stopping::AtPause, |watch| supple_study::pareto::run(&loaded, &wanted, folder, watch));
    let Some(front) = found_or_kept(found, &options.output)? else { return Ok(Outcome::Shortfall) };
    let made = Made::here("pareto", seed, &loaded);
    let whole = front.points.iter().all(|point| point.status == DesignStatus::Converged && point.warnings.is_empty());
    let outcome = if whole { Outcome::Success } else { Outcome::Shortfall };
    let stopped = stopped_front(&front);
    let result = StudyResult::Pareto(Box::new(front));
    Ok(outcome.and(present_resumable(&result, &made, &options.output, stopped)?))
}
