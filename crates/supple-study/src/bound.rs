//! Bounds on information at a design and over a range of costs.
//!
//! # A curve of the minimum over the cost
//!
//! ```
//! use supple_study::bound::{BoundOptions, run};
//! use supple_study::{LoadedTask, Source, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//!
//! // The task of the front page.
//! let task = LoadedTask::restore(&[source])?;
//! let options = BoundOptions { curve: Some(3), ..BoundOptions::default() };
//! let study = run(&task, &options, Watch::default())?;
//! let curve = &study.curves[0];
//! assert_eq!((study.report.tasks.len(), curve.task.as_str(), curve.points.len()), (1, "hold", 3));
//! assert!(curve.points[0].minimum_bits_per_step > curve.points[2].minimum_bits_per_step);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::path::Path;
use supple::math;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use supple::bound::{BoundReport, Bounding, TaskBound};

use crate::{Cell, Column, LoadedTask, StudyError, Table, Watch, write_text};

/// What a study of bounds does.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoundOptions {
    /// The task; default: all of them.
    pub task: Option<String>,
    /// The expected cost to keep; default: the design's own.
    pub cost: Option<f64>,
    /// Bounds by step of the steady state instead of those over the horizon.
    pub stationary: bool,
    /// Points of a curve of the minimum over the cost; default: none.
    pub curve: Option<usize>,
}

/// Bounds on information, and curves of the minimum over the cost.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BoundStudy {
    /// What was asked for.
    pub options: BoundOptions,
    /// The bounds of each task.
    #[serde(flatten)]
    pub report: BoundReport,
    /// The curve of each task, in the same order; empty if they were not asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curves: Vec<Curve>,
}

/// The least information of a task over the cost to keep.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Curve {
    /// The task.
    pub task: String,
    /// Points by increasing cost.
    pub points: Vec<CurvePoint>,
}

/// A point of a curve.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CurvePoint {
    /// The expected cost: over the task, or per step where it is stationary.
    pub cost: f64,
    /// The least information, bits by decision; NaN where it could not be found.
    #[serde(deserialize_with = "supple::or_nan")]
    pub minimum_bits_per_step: f64,
    /// What it is certainly not below.
    #[serde(deserialize_with = "supple::or_nan")]
    pub minimum_lower_bits_per_step: f64,
    /// The best closed-form bound; 0 over a finite horizon, where none exists.
    #[serde(deserialize_with = "supple::or_nan")]
    pub closed_form_bits_per_step: f64,
    /// Why it could not be found, where it could not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// The file with the points of all curves.
pub const CURVE_CSV: &str = "curve.csv";

/// How far the first point of a curve is above the minimum cost, as a share of how far the requested cost is
/// above it.
const NEAREST: f64 = 0.02;

/// The same for the last point, as a multiple; but no further than the cost without measurements.
const FARTHEST: f64 = 50.0;

/// Points of a curve at most.
const MOST_POINTS: usize = 10_000;

/// Finds the bounds of each task, and the curves where they are asked for: their points all at once.
///
/// A curve contains the cost of the bounds as one of its points; the distances of the others to the minimum cost form
/// a geometric sequence.
///
/// # Errors
/// Where a plan cannot be computed, the cost is not above the least there is, a curve has fewer than 2 or more than
/// 10,000 points, or it is stopped.
///
/// Example: the [module](crate::bound).
pub fn run(task: &LoadedTask, options: &BoundOptions, watch: Watch) -> Result<BoundStudy, StudyError> {
    let wrong = |message: String| Err(StudyError::usage(message));
    match options.curve {
        Some(points @ 0..2) => return wrong(format!("a curve needs at least 2 points; found {points}")),
        Some(points) if points > MOST_POINTS => {
            return wrong(format!("a curve has at most {MOST_POINTS} points; found {points}"));
        }
        _ => {}
    }
    let wanted = supple::bound::BoundOptions {
        task: options.task.clone(),
        cost: options.cost,
        stationary: options.stationary,
        ..Default::default()
    };
    let LoadedTask { problem, phi, .. } = task;
    let bounding = problem.bounding(phi, &wanted)?;
    let count = bounding.len() * (1 + options.curve.unwrap_or(0));
    watch.progress.begin("bounds on information", 0, count as u64);
    let reports = bounding.par_iter().map(|one| {
        let report = stoppable(watch, || Ok(one.report(options.cost)?));
        watch.progress.advance(1);
        report
    });
    let tasks = reports.collect::<Result<Vec<_>, _>>()?;
    let curves = match options.curve {
        None => Vec::new(),
        Some(points) => {
            let both = bounding.iter().zip(&tasks);
            both.map(|(one, report)| curve(one, report, points, watch)).collect::<Result<_, _>>()?
        }
    };
    let report = BoundReport { parameters: task.parameters(), tasks };
    Ok(BoundStudy { options: options.clone(), report, curves })
}

/// Does work; an error if it is stopped meanwhile, as an interrupted result is unusable.
fn stoppable<T>(watch: Watch, work: impl FnOnce() -> Result<T, StudyError>) -> Result<T, StudyError> {
    if watch.is_stopped() {
        return Err(StudyError::Stopped);
    }
    let done = work();
    if watch.is_stopped() { Err(StudyError::Stopped) } else { done }
}

fn curve(bounding: &Bounding, report: &TaskBound, points: usize, watch: Watch) -> Result<Curve, StudyError> {
    let costs = costs(bounding, report, points);
    let point = |&cost: &f64| {
        stoppable(watch, || {
            let found = bounding.point(cost);
            watch.progress.advance(1);
            Ok(match found {
                Ok(found) => CurvePoint {
                    cost,
                    minimum_bits_per_step: found.minimum_bits_per_step,
                    minimum_lower_bits_per_step: found.minimum_lower_bits_per_step,
                    closed_form_bits_per_step: found.closed_form_bits_per_step,
                    error: found
                        .not_proved
                        .map(|reason| format!("not proved: {reason}"))
                        .or(found.not_certified.map(|reason| format!("not certified: {reason}"))),
                },
                Err(error) => CurvePoint {
                    cost,
                    minimum_bits_per_step: f64::NAN,
                    minimum_lower_bits_per_step: f64::NAN,
                    closed_form_bits_per_step: f64::NAN,
                    error: Some(error.to_string()),
                },
            })
        })
    };
    let points = costs.par_iter().map(point).collect::<Result<Vec<_>, _>>()?;
    Ok(Curve { task: bounding.name().to_owned(), points })
}

/// Costs of a curve: distances to the minimum grow geometrically; the nearest point is set to the cost of the bounds.
fn costs(bounding: &Bounding, report: &TaskBound, points: usize) -> Vec<f64> {
    let least = bounding.minimum_cost();
    let own = report.cost - least;
    let open = report.open_loop_cost.map_or(f64::INFINITY, |cost| cost - least);
    let (near, far) = (NEAREST * own, (FARTHEST * own).min(open).max(own));
    let last = (points - 1) as f64;
    let mut costs: Vec<f64> = (0..points).map(|i| least + near * math::powf(far / near, i as f64 / last)).collect();
    let distance = |i: &usize| math::ln((costs[*i] - least) / own).abs();
    if let Some(nearest) = (0..points).min_by(|a, b| distance(a).total_cmp(&distance(b))) {
        costs[nearest] = report.cost;
    }
    costs
}

impl BoundStudy {
    /// The study as JSON; with a single task, all of its entries are also at the top level.
    ///
    /// # Errors
    /// If it cannot be serialised.
    pub fn json(&self) -> Result<String, StudyError> {
        let told = |error: serde_json::Error| StudyError::Usage(error.to_string());
        let (Value::Object(mut all), [task]) = (serde_json::to_value(self).map_err(told)?, &self.report.tasks[..])
        else {
            return serde_json::to_string_pretty(self).map_err(told);
        };
        all.remove("tasks");
        if let Some(curve) = self.curves.first() {
            all.remove("curves");
            all.insert("curve".to_owned(), serde_json::to_value(&curve.points).map_err(told)?);
        }
        if let Value::Object(of_task) = serde_json::to_value(task).map_err(told)? {
            all.extend(of_task);
        }
        serde_json::to_string_pretty(&Value::Object(all)).map_err(told)
    }

    /// The points of all curves.
    #[must_use]
    pub fn table(&self) -> Table {
        let column = |name: &str, unit: &str, description: &str| Column {
            name: name.to_owned(),
            unit: unit.to_owned(),
            description: description.to_owned(),
        };
        let columns = vec![
            column("task", "", "the task"),
            column("cost", "", "expected cost: over the task, or per step where it is stationary"),
            column("minimum_bits_per_step", "bit", "minimum directed information per decision"),
            column("minimum_lower_bits_per_step", "bit", "proved lower bound"),
            column("closed_form_bits_per_step", "bit", "best bound in closed form; 0 over a horizon, which has none"),
            column("error", "", "why the point could not be found"),
        ];
        let row = |task: &str, point: &CurvePoint| {
            vec![
                Cell::Text(task.to_owned()),
                Cell::number(point.cost),
                Cell::number(point.minimum_bits_per_step),
                Cell::number(point.minimum_lower_bits_per_step),
                Cell::number(point.closed_form_bits_per_step),
                point.error.as_ref().map_or(Cell::Missing, |error| Cell::Text(error.clone())),
            ]
        };
        let rows = self.curves.iter().flat_map(|curve| curve.points.iter().map(|point| row(&curve.task, point)));
        Table { columns, rows: rows.collect() }
    }

    /// Writes the points of all curves as CSV, where there are any.
    pub(crate) fn save_table(&self, folder: &Path) -> Result<(), StudyError> {
        if self.curves.is_empty() {
            return Ok(());
        }
        write_text(&folder.join(CURVE_CSV), self.table().to_csv().as_bytes())
    }
}
