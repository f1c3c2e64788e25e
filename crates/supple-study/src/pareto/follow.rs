use std::cmp::Ordering;

use supple::design::{Aim, DesignStatus, StartSummary};
use supple::pipeline::TaskState;
use supple::{PlanCheck, halt};

use super::ends::Ends;
use super::front::{Front, SAME, at_ends};
use crate::StudyError;

/// A point of a front.
pub(super) struct Point {
    pub factor: f64,
    pub summary: StartSummary,
    /// Information of each task, nats.
    pub information: Vec<f64>,
    /// What speaks against its plans.
    pub plans: Vec<PlanCheck>,
}

/// A front narrower than this, relative to its factors, is one point.
const NARROW: f64 = 1e-6;

/// Follows the front from both ends, keeps the better of both at every point, searches anew where neither is an
/// optimum, and corrects what is not monotone. If it is stopped: the points found until then, and true.
pub(super) fn follow(front: &Front, ends: &Ends, count: usize) -> Result<(Vec<Point>, bool), StudyError> {
    let watch = front.watch;
    let factors = factors(ends, count);
    let last = factors.len() - 1;
    let (up, down) = rayon::join(|| searches(front, ends, &factors, true), || searches(front, ends, &factors, false));
    let (mut up, mut down) = (up?.into_iter(), down?.into_iter().rev());
    let missing = last.saturating_sub(1) - down.len().min(last.saturating_sub(1));
    let mut points: Vec<Point> = vec![end(front, factors[0], || tight_end(front, ends))?];
    for (index, &factor) in factors.iter().enumerate().take(last).skip(1) {
        let searcher = front.searcher(Aim::Information { factor });
        let better = |one: Point, other: Point| match searcher.rank(&one.summary) < searcher.rank(&other.summary) {
            true => one,
            false => other,
        };
        let from_above = if index > missing { down.next() } else { None };
        let mut found = match (up.next(), from_above) {
            (Some(up), Some(down)) => better(up, down),
            (Some(one), None) | (None, Some(one)) => one,
            (None, None) => continue,
        };
        // Branches of plans can end between two points, so that no neighbour leads to the optimum.
        if found.summary.status != DesignStatus::Converged && !watch.is_stopped() {
            let anew = front.best(&format!("restarted at point {index}"), &searcher);
            match anew.and_then(|anew| point(front, factor, anew)) {
                Err(StudyError::Stopped) => {}
                anew => found = better(anew?, found),
            }
        }
        points.push(found);
    }
    if last > 0 {
        // No bound matters there, so that none has a price.
        points.push(end(front, factors[last], || Ok(ends.loose.clone()))?);
    }
    let stopped = match watch.is_stopped() {
        true => Err(StudyError::Stopped),
        false => mend(front, &mut points),
    };
    let stopped = match stopped {
        Err(StudyError::Stopped) => true,
        other => other.map(|()| false)?,
    };
    Ok((points, stopped))
}

/// Follows the front between its ends, `up` from the tight one or down from the loose one, each point from the one before,
/// until it is stopped.
fn searches(front: &Front, ends: &Ends, factors: &[f64], up: bool) -> Result<Vec<Point>, StudyError> {
    let last = factors.len() - 1;
    let mut found: Vec<Point> = Vec::new();
    for step in 1..last {
        let index = if up { step } else { last - step };
        let before = found.last().map_or(if up { &ends.tight } else { &ends.loose }, |point| &point.summary);
        let number = if up { index } else { factors.len() + index };
        let name = format!("{} to point {index}", if up { "up" } else { "down" });
        let searched = front.nearby(&name, before, factors[index], number);
        match searched.and_then(|found| point(front, factors[index], found)) {
            Err(StudyError::Stopped) => break,
            other => found.push(other?),
        }
        front.watch.progress.advance(1);
    }
    Ok(found)
}

/// Factors from the tight end to the loose one; the square roots of their distances to the tight end are evenly spaced.
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
    // The needed information depends on the bounds.
    let aim = Aim::Information { factor: ends.tight_factor };
    let mut summary = front.searcher(aim).assess(&ends.tight.to, &ends.tight.controls)?;
    if at_ends(parameters, &ends.tight).len() == parameters.design().len() {
        return Ok(summary);
    }
    // There, the cost's gradient vanishes along interior parameters, so that no finite price balances the information.
    (summary.status, summary.optimality) = (ends.tight.status, ends.tight.optimality);
    let bounds = front.task.problem.tasks.iter().map(|task| &task.bound);
    summary.multipliers = bounds.map(|bound| if bound.is_some() { f64::NAN } else { 0.0 }).collect();
    Ok(summary)
}

/// Ensures that no point needs more information than a tighter one, whose design it could use: repeats its search from that
/// design, and keeps the better of the result and the design itself.
fn mend(front: &Front, points: &mut [Point]) -> Result<(), StudyError> {
    let count = points.len();
    for index in 1..count {
        let (tighter, rest) = points.split_at_mut(index);
        let (before, current) = (&tighter[index - 1].summary, &mut rest[0]);
        let factor = current.factor;
        let searcher = front.searcher(Aim::Information { factor });
        let needs_more = |one: &StartSummary| {
            let (was, is) = (searcher.rank(before), searcher.rank(one));
            was.partial_cmp(&(is.0, is.1, is.2 - SAME * is.2.abs())).is_some_and(Ordering::is_lt)
        };
        if !needs_more(&current.summary) {
            continue;
        }
        let number = 2 * count + index;
        let name = format!("from the tighter design to point {index}");
        let found = front.nearby(&name, before, factor, number)?;
        let summary = if needs_more(&found) { searcher.assess(&before.to, &before.controls)? } else { found };
        *current = point(front, factor, summary)?;
    }
    Ok(())
}

/// The point at an end of the front. Also computed after a stop: both ends are complete, and what was found
/// has to be reported.
fn end(
    front: &Front,
    factor: f64,
    summary: impl Fn() -> Result<StartSummary, StudyError>,
) -> Result<Point, StudyError> {
    let make = || point(front, factor, summary()?);
    match make() {
        Err(StudyError::Stopped) if front.watch.is_stopped() => {
            halt::request(false);
            make()
        }
        made => made,
    }
}

fn point(front: &Front, factor: f64, summary: StartSummary) -> Result<Point, StudyError> {
    let problem = &front.task.problem;
    let (mut information, mut plans) = (Vec::new(), Vec::new());
    for (task, controls) in problem.tasks.iter().zip(&summary.controls) {
        let mut state = TaskState::new(task);
        state.evaluate(task, &summary.to, &problem.planning, Some(controls))?;
        information.push(state.information.total);
        plans.push(PlanCheck::of(problem, task, &summary.to, &state, factor)?);
    }
    Ok(Point { factor, summary, information, plans })
}
