//! Pareto fronts: the least information over the bound on cost.
//!
//! All bounds are one factor times those of the task. At the front's unconstrained end the factor is just so large that
//! no bound matters; at its tight end it is the least that any design meets. Between them the front is followed from
//! both ends; each point's search is warm-started from its neighbour, and restarted if neither direction leads to an
//! optimum.
//!
//! # A front of three points
//!
//! ```
//! use supple_study::pareto::{ParetoOptions, run};
//! use supple_study::{LoadedTask, Source, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     bound = 2.0
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//!
//! // The task of the front page with a cost limit of 2.
//! let task = LoadedTask::restore(&[source])?;
//! let front = run(&task, &ParetoOptions { points: 3, starts: 1, seed: 0 }, None, Watch::default())?;
//! assert_eq!(front.points.len(), 3);
//! let (tightest, loosest) = (&front.points[0], &front.points[2]);
//! assert!(tightest.factor < loosest.factor && tightest.information_nats > loosest.information_nats);
//! assert!(front.remarks[0].text.contains("cost limits"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod ends;
mod follow;
mod front;
mod point;
mod remarks;
mod report;

pub use point::ParetoPoint;
pub use remarks::{RangeEnd, Remark};
pub use report::{Pareto, ParetoOptions};

use std::path::Path;

use supple::Named;
use supple::design::{DesignSettings, GradientKind, Method};

use crate::design::check_designable;
use crate::journal::{Identity, Parts};
use crate::{LoadedTask, StudyError, Watch};
use ends::find_ends;
use follow::{Point, follow};
use front::{Front, at_ends};
use supple_text::digits;

/// Points of a front at most.
const MOST_POINTS: usize = 10_000;

/// Follows the front by continuation, by sequential quadratic programming with the task's other settings.
///
/// The square root of a point's distance to the tight end, in factors, is evenly spaced along the front: near that end,
/// information falls with the square root of the slack in the limits. With three or more points, one has factor 1, if
/// it lies between the ends. No point needs more information than a tighter one: if a search found less
/// less information at a tighter point, that design is used. Points found before a stop are kept;
/// with a folder, a journal there keeps the searches that ended, and the same study resumes from it.
///
/// # Errors
/// Where there are fewer than 2 points or more than 10,000, there is nothing to design, no task has a bound, or a bound
/// is not above 0; where an end cannot be evaluated; if it is stopped before both ends are known; where the journal
/// cannot be written, is damaged, or belongs to another study.
///
/// Example: the [module](crate::pareto).
pub fn run(
    task: &LoadedTask,
    options: &ParetoOptions,
    folder: Option<&Path>,
    watch: Watch,
) -> Result<Pareto, StudyError> {
    check_designable(task)?;
    let bounds = check_bounds(task)?;
    if options.points < 2 {
        return Err(StudyError::usage(format!("a front needs at least 2 points; found {}", options.points)));
    }
    if options.points > MOST_POINTS {
        let found = options.points;
        return Err(StudyError::usage(format!("a front has at most {MOST_POINTS} points; found {found}")));
    }
    let settings = settings(task, options)?;
    let parts = Parts::open(folder, &identity(task, options))?;
    let front = Front { task, settings, parts, watch };
    // Both ends, each from every start, and both ways along the front.
    watch.progress.begin("searches along the front", 0, (2 + 2 * options.points) as u64);
    let ends = find_ends(&front)?;
    let (points, stopped) = follow(&front, &ends, options.points)?;
    let points: Vec<ParetoPoint> = points.iter().map(|point| report(task, point, &bounds)).collect();
    let remarks = remarks::remarks(task, &ends, &points, !stopped);
    Ok(Pareto {
        options: options.clone(),
        information: task.problem.design.information,
        bounds,
        points,
        remarks,
        stopped,
    })
}

/// What a front is.
fn identity(task: &LoadedTask, options: &ParetoOptions) -> Identity {
    let ParetoOptions { points, starts, seed } = options;
    Identity::of("Pareto front", task, &format!("points {points}\nstarts {starts}\nseed {seed}\n"), &[])
}

/// The tasks' bounds at factor 1; infinite where there is none.
pub(crate) fn check_bounds(task: &LoadedTask) -> Result<Vec<f64>, StudyError> {
    let tasks = &task.problem.tasks;
    let bounds = tasks.iter().map(|one| one.bound.as_ref().map(|bound| bound.resolve(&task.phi)));
    let bounds: Vec<Option<f64>> = bounds.collect();
    if bounds.iter().all(Option::is_none) {
        let message = "no task has a cost limit, which a front needs for scale; set `bound` in a task, for example to the cost of a known design (printed by `supple evaluate`)";
        return Err(StudyError::usage(message));
    }
    for (one, bound) in tasks.iter().zip(&bounds) {
        if let Some(bound) = bound.filter(|&bound| bound <= 0.0) {
            let bound = digits(bound);
            let message = format!("the cost limit of task `{}` is {bound}; a front requires limits above 0", one.name);
            return Err(StudyError::usage(message));
        }
    }
    Ok(bounds.into_iter().map(|bound| bound.unwrap_or(f64::INFINITY)).collect())
}

/// The task's settings, for the one method that supports all aims; with total gradients, or frozen ones if plans have
/// no total gradients.
fn settings(task: &LoadedTask, options: &ParetoOptions) -> Result<DesignSettings, StudyError> {
    let gradient = match task.problem.planning.plan.has_total_gradient() {
        true => GradientKind::Total,
        false => GradientKind::Frozen,
    };
    let ParetoOptions { starts, seed, .. } = *options;
    let settings = DesignSettings { method: Method::Sqp, gradient, starts, seed, ..task.problem.design.clone() };
    settings.check().map_err(|unfit| StudyError::usage(unfit.to_string()))?;
    Ok(settings)
}

fn report(task: &LoadedTask, point: &Point, bounds: &[f64]) -> ParetoPoint {
    let Point { factor, summary, information, plans } = point;
    let parameters = &task.problem.parameters;
    // At a tight end, no active limit has a finite price; limits that are not active have price 0.
    let is_below = |cost: f64, bound: f64| cost < factor * bound * (1.0 - task.problem.design.feasibility);
    let each = summary.multipliers.iter().zip(&summary.costs).zip(bounds);
    let prices = each
        .map(|((&price, &cost), &bound)| if price.is_nan() && is_below(cost, bound) { 0.0 } else { price })
        .collect();
    ParetoPoint {
        factor: *factor,
        bounds: bounds.iter().map(|bound| factor * bound).collect(),
        status: summary.status,
        parameters: Named::new(parameters, &summary.to),
        information_nats: summary.information,
        task_nats: information.clone(),
        costs: summary.costs.clone(),
        prices,
        price: parameters.iter().any(|parameter| parameter.price.is_some()).then_some(summary.price),
        at_ends: at_ends(parameters, summary),
        warnings: plans.iter().flat_map(|plan| plan.warnings.clone()).collect(),
        trust: plans.iter().filter_map(|plan| plan.trust.clone()).collect(),
    }
}
