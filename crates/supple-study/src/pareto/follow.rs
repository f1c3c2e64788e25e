use std::cmp::Ordering;

use supple::design::{Aim, DesignStatus, StartSummary};
use supple::pipeline::TaskState;

use super::{Ends, Front, at_ends};
use crate::design::warnings_of;
use crate::{StudyError, Watch};

/// A point of a front.
pub(super) struct Point {
    pub factor: f64,
    pub summary: StartSummary,
    /// Information of each task, nats.
    pub information: Vec<f64>,
    /// Contacts that its plans miss.
    pub warnings: Vec<String>,
}

/// Information that differs by less than this, relatively, is the same.
const SAME: f64 = 1e-9;

/// A front narrower than this, relative to its factors, is one point.
const NARROW: f64 = 1e-6;

/// Follows the front from both ends, keeps the better of both at every point, searches anew where neither is an optimum,
/// and mends what is not monotone.
pub(super) fn follow(front: &Front, ends: &Ends, count: usize, watch: Watch) -> Result<Vec<Point>, StudyError> {
    let factors = factors(ends, count);
    let last = factors.len() - 1;
    let searches = |up: bool| -> Result<Vec<StartSummary>, StudyError> {
        let mut found: Vec<StartSummary> = Vec::new();
        for step in 1..last {
            let index = if up { step } else { last - step };
            let before = found.last().unwrap_or(if up { &ends.tight } else { &ends.loose });
            let number = if up { index } else { factors.len() + index };
            found.push(search(front, before, (factors[index], number), watch)?);
            watch.progress.advance(1);
        }
        Ok(found)
    };
    let (up, down) = rayon::join(|| searches(true), || searches(false));
    let (up, down) = (up?, down?);
    let mut points: Vec<StartSummary> = Vec::new();
    points.push(tight_end(front, ends)?);
    for (index, (up, down)) in up.into_iter().zip(down.into_iter().rev()).enumerate() {
        let searcher = front.searcher(Aim::Information { factor: factors[index + 1] });
        let better = |one: StartSummary, other| if searcher.rank(&one) < searcher.rank(&other) { one } else { other };
        let mut point = better(up, down);
        // Branches of plans can end between two points, so that no neighbour leads to the optimum.
        if point.status != DesignStatus::Converged && !watch.is_stopped() {
            let mut anew = searcher.search(&front.task.phi)?;
            point = better(anew.starts.swap_remove(anew.best), point);
        }
        points.push(point);
    }
    if last > 0 {
        // No bound matters there, so that none has a price.
        points.push(ends.loose.clone());
    }
    mend(front, &factors, &mut points, watch)?;
    factors.into_iter().zip(points).map(|(factor, summary)| point(front, factor, summary)).collect()
}

/// Factors from the tight end to the loose one; their distances to the tight end have evenly spread roots.
fn factors(ends: &Ends, count: usize) -> Vec<f64> {
    let Ends { tight_factor: tight, loose_factor: loose, .. } = *ends;
    if loose - tight <= NARROW * loose.abs() {
        return vec![loose.max(tight)];
    }
    let last = count - 1;
    let mut factors: Vec<f64> =
        (0..count).map(|i| tight + (loose - tight) * (i as f64 / last as f64).powi(2)).collect();
    factors[last] = loose;
    if last > 1 && (tight..=loose).contains(&1.0) {
        let distance = |i: &usize| (factors[*i] - 1.0).abs();
        let nearest = (1..last).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(nearest) = nearest.filter(|_| tight < 1.0 && 1.0 < loose) {
            factors[nearest] = 1.0;
        }
    }
    factors
}

/// The design of least cost; an optimum of least information too, as no other design meets its bounds.
fn tight_end(front: &Front, ends: &Ends) -> Result<StartSummary, StudyError> {
    let parameters = &front.task.problem.parameters;
    if at_ends(parameters, &ends.tight).len() == parameters.design().len() {
        let aim = Aim::Information { factor: ends.tight_factor };
        return Ok(front.searcher(aim).assess(&ends.tight.to, &ends.tight.controls)?);
    }
    // The cost has no slope there along parameters within their range, so that no price balances the information's.
    let mut summary = ends.tight.clone();
    let bounds = front.task.problem.tasks.iter().map(|task| task.bound);
    summary.multipliers = bounds.map(|bound| if bound.is_some() { f64::NAN } else { 0.0 }).collect();
    Ok(summary)
}

fn search(
    front: &Front,
    from: &StartSummary,
    (factor, number): (f64, usize),
    watch: Watch,
) -> Result<StartSummary, StudyError> {
    if watch.is_stopped() {
        return Err(StudyError::Stopped);
    }
    let searcher = front.searcher(Aim::Information { factor });
    let found = searcher.search_from(&from.to, &from.controls, number)?;
    // What was stopped on its way is no point of a front.
    if watch.is_stopped() { Err(StudyError::Stopped) } else { Ok(found) }
}

/// Sees that no point needs more information than a tighter one, whose design it could use: searches on from that
/// design, and takes up the better of what is found and the design itself.
fn mend(front: &Front, factors: &[f64], points: &mut [StartSummary], watch: Watch) -> Result<(), StudyError> {
    for index in 1..points.len() {
        let searcher = front.searcher(Aim::Information { factor: factors[index] });
        let (tighter, rest) = points.split_at_mut(index);
        let (before, current) = (&tighter[index - 1], &mut rest[0]);
        let needs_more = |one: &StartSummary| {
            let (was, is) = (searcher.rank(before), searcher.rank(one));
            was.partial_cmp(&(is.0, is.1, is.2 - SAME * is.2.abs())).is_some_and(Ordering::is_lt)
        };
        if !needs_more(current) {
            continue;
        }
        let number = 2 * factors.len() + index;
        let found = search(front, before, (factors[index], number), watch)?;
        *current = if needs_more(&found) { searcher.assess(&before.to, &before.controls)? } else { found };
    }
    Ok(())
}

fn point(front: &Front, factor: f64, summary: StartSummary) -> Result<Point, StudyError> {
    let problem = &front.task.problem;
    let (mut information, mut warnings) = (Vec::new(), Vec::new());
    for (task, controls) in problem.tasks.iter().zip(&summary.controls) {
        let mut state = TaskState::new(task);
        state.evaluate(task, &summary.to, &problem.planning, Some(controls))?;
        information.push(state.information.total);
        warnings.extend(warnings_of(task, &summary.to, &state));
    }
    Ok(Point { factor, summary, information, warnings })
}
