use supple_study::{Made, StudyResult};

use crate::Outcome;
use crate::arguments::BoundOptions;
use crate::failure::Failure;
use crate::present::present;
use crate::progress::{Stopping, watched};

/// `supple bound TASK`
pub fn bound(options: &BoundOptions) -> Result<Outcome, Failure> {
    let loaded = options.task.load()?;
    let BoundOptions { cost, curve, stationary, .. } = *options;
    let wanted = supple_study::bound::BoundOptions { task: options.name.clone(), cost, stationary, curve };
    options.output.check("bound")?;
    let study = watched(Stopping::Now, |watch| supple_study::bound::run(&loaded, &wanted, watch))?;
    let made = Made::here("bound", 0, &loaded);
    let converged = study.report.tasks.iter().all(|task| task.status.is_converged() && task.proved && task.is_finite());
    let found = study.curves.iter().flat_map(|curve| &curve.points).all(|point| point.error.is_none());
    let outcome = if converged && found { Outcome::Success } else { Outcome::Shortfall };
    Ok(outcome.and(present(&StudyResult::Bound(Box::new(study)), &made, &options.output)?))
}
