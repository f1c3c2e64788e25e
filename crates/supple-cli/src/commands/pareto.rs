use supple::design::DesignStatus;
use supple_study::{Made, StudyResult, Watch};

use crate::Outcome;
use crate::arguments::ParetoOptions;
use crate::failure::Failure;
use crate::present::present;
use crate::progress::{Bar, STOP, listen};

/// `supple pareto TASK`
pub fn pareto(options: &ParetoOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let ParetoOptions { points, starts, seed, .. } = *options;
    let wanted = supple_study::pareto::ParetoOptions { points, starts, seed };
    options.output.check()?;
    listen();
    let bar = Bar::new();
    let found = supple_study::pareto::run(&loaded, &wanted, Watch { progress: &bar, stop: &STOP });
    bar.finish();
    let front = found?;
    let made = Made::here("pareto", seed, &loaded);
    let whole = front.points.iter().all(|point| point.status == DesignStatus::Converged);
    present(&StudyResult::Pareto(Box::new(front)), &made, &options.output)?;
    Ok(if whole { Outcome::Success } else { Outcome::Shortfall })
}
