use supple::design::{Aim, StartSummary};

use super::Front;
use crate::StudyError;

/// The ends of a front.
pub(super) struct Ends {
    /// The least information without bounds.
    pub loose: StartSummary,
    /// The smallest factor at which no cost limit is active.
    pub loose_factor: f64,
    /// The least cost of any design.
    pub tight: StartSummary,
    /// The least factor that any design meets.
    pub tight_factor: f64,
}

impl Front<'_> {
    /// The least factor of the bounds that costs meet.
    pub fn factor(&self, summary: &StartSummary) -> f64 {
        let bounds = self.task.problem.tasks.iter().map(|task| task.bound);
        let ratios = bounds.zip(&summary.costs).filter_map(|(bound, cost)| {
            let bound: f64 = bound?.resolve(&summary.to);
            Some(cost / bound)
        });
        ratios.fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Searches for both ends: the least information without bounds, and the least cost, from all starts and from the
/// other end.
pub(super) fn find_ends(front: &Front) -> Result<Ends, StudyError> {
    let free = front.searcher(Aim::Information { factor: f64::INFINITY });
    let cheap = front.searcher(Aim::Cost);
    let (loose, tight) = rayon::join(|| front.best("least information", &free), || front.best("least cost", &cheap));
    let (loose, mut tight) = (loose?, tight?);
    let from_loose = || cheap.search_from(&loose.to, &loose.controls, front.settings.starts);
    let from_loose = front.part("least cost, from the least information", from_loose)?;
    if cheap.rank(&from_loose) < cheap.rank(&tight) {
        tight = from_loose;
    }
    front.watch.progress.advance(2);
    let (loose_factor, tight_factor) = (front.factor(&loose), front.factor(&tight));
    Ok(Ends { loose, loose_factor, tight, tight_factor })
}
