use supple::design::{Aim, InformationWeights, StartSummary};

use super::front::{Front, SAME};
use crate::StudyError;

/// The ends of a front.
pub(super) struct Ends {
    /// The least information without bounds; of several such designs, the one that meets the tightest bounds.
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
        let bounds = self.task.problem.tasks.iter().map(|task| task.bound.as_ref());
        let ratios = bounds.zip(&summary.costs).filter_map(|(bound, cost)| {
            let bound: f64 = bound?.resolve(&summary.to);
            Some(cost / bound)
        });
        ratios.fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Searches for both ends: the least information without bounds, and the least cost, from all starts and from the
/// other end. Needed information ends where bounds can be met without measurements.
pub(super) fn find_ends(front: &Front) -> Result<Ends, StudyError> {
    let weights = front.settings.information;
    let blind = front.searcher(Aim::UnmeasuredCost);
    let free = match weights {
        InformationWeights::NEEDED => blind,
        _ => front.searcher(Aim::Information { factor: f64::INFINITY }),
    };
    let cheap = front.searcher(Aim::Cost);
    let (loose, tight) = rayon::join(|| front.best("least information", &free), || front.best("least cost", &cheap));
    let (mut loose, mut tight) = (loose?, tight?);
    let from_loose = || cheap.search_from(&loose.to, &loose.controls, front.settings.starts);
    let from_loose = front.part("least cost, from the least information", from_loose)?;
    if cheap.rank(&from_loose) < cheap.rank(&tight) {
        tight = from_loose;
    }
    front.watch.progress.advance(2);
    let (mut loose_factor, tight_factor) = (front.factor(&loose), front.factor(&tight));
    if weights.needed > 0.0 {
        let without_measurements = 1.0 + blind.assess(&loose.to, &loose.controls)?.violation;
        loose_factor = loose_factor.max(without_measurements);
        loose = front.searcher(Aim::Information { factor: loose_factor }).assess(&loose.to, &loose.controls)?;
    } else {
        loose = cheapest_of_least(front, loose, &tight, tight_factor)?;
        loose_factor = front.factor(&loose);
    }
    Ok(Ends { loose, loose_factor, tight, tight_factor })
}

/// How closely the cheapest of several designs of least information is found, as a share of the front's width.
const NEAR: f64 = 2e-4;

/// Of the designs with the information of `loose`, one that meets the tightest bounds: parameters that change the cost alone
/// are anything without bounds. Found by bisection, as long as tighter bounds take no information.
fn cheapest_of_least(
    front: &Front,
    mut loose: StartSummary,
    cheapest: &StartSummary,
    tight: f64,
) -> Result<StartSummary, StudyError> {
    let least = loose.objective + SAME * loose.objective.abs();
    if cheapest.objective <= least {
        return Ok(front.searcher(Aim::Information { factor: tight }).assess(&cheapest.to, &cheapest.controls)?);
    }
    let (mut missed, near) = (tight, NEAR * (front.factor(&loose) - tight));
    let mut trial = front.factor(&loose) - near;
    for number in 0.. {
        if front.factor(&loose) - missed <= near || trial <= missed {
            break;
        }
        let found = front.nearby(&format!("cheaper design {number}"), &loose, trial, front.settings.starts)?;
        if found.status.meets_bounds() && found.objective <= least {
            loose = found;
        } else if number == 0 {
            // Tighter bounds take information at once, as they do unless the design of least information is one of many.
            break;
        } else {
            missed = trial;
        }
        trial = 0.5 * (missed + front.factor(&loose));
    }
    Ok(loose)
}
