use serde::{Deserialize, Serialize};
use supple::parameters::{Parameter, Parameters};

use super::ends::Ends;
use super::point::ParetoPoint;
use crate::LoadedTask;

/// A remark on a front.
///
/// Example: the [module](crate::pareto).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Stored")]
pub struct Remark {
    /// In words, with units as the task file writes them.
    pub text: String,
    /// The data behind the text, if the remark is that a parameter is at a bound of its range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<RangeEnd>,
}

/// Where along a front a parameter is at an end of its range.
///
/// ```
/// use supple_study::pareto::RangeEnd;
///
/// let (parameter, side, places) = ("k1".to_owned(), "upper".to_owned(), "at factor 0.9".to_owned());
/// let end = RangeEnd { parameter, side, value: 600.0, places };
/// assert_eq!(end.text("N/m"), "k1 is at its upper end, 600 N/m at factor 0.9");
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RangeEnd {
    /// Its name.
    pub parameter: String,
    /// Which end: `lower` or `upper`.
    pub side: String,
    /// The number at that end.
    pub value: f64,
    /// At which factors, in words.
    pub places: String,
}

impl RangeEnd {
    /// In words, with a unit as the reader is to see it.
    #[must_use]
    pub fn text(&self, unit: &str) -> String {
        let Self { parameter, side, value, places } = self;
        let value = format!("{value} {unit}");
        format!("{parameter} is at its {side} end, {} {places}", value.trim_end())
    }
}

impl From<String> for Remark {
    fn from(text: String) -> Self {
        Self { text, end: None }
    }
}

/// A remark in a result: earlier ones are plain text.
#[derive(Deserialize)]
#[serde(untagged)]
enum Stored {
    Plain(String),
    Full { text: String, end: Option<RangeEnd> },
}

impl From<Stored> for Remark {
    fn from(stored: Stored) -> Self {
        match stored {
            Stored::Plain(text) => text.into(),
            Stored::Full { text, end } => Self { text, end },
        }
    }
}

/// Where bounds become active along a front, where parameters reach an end of their range, and where the task's own
/// bounds lie.
///
/// Of a front that is not complete, only where its ends are: what lies between is not known.
pub(super) fn remarks(task: &LoadedTask, ends: &Ends, points: &[ParetoPoint], is_complete: bool) -> Vec<Remark> {
    let mut remarks: Vec<Remark> = vec![own_bounds(ends).into()];
    if !is_complete {
        return remarks;
    }
    if points.len() == 1 {
        let text = "the design of least information is also the cheapest: the front is a single point";
        remarks.push(text.to_owned().into());
    }
    for (index, one) in task.problem.tasks.iter().enumerate().filter(|(_, one)| one.bound.is_some()) {
        let is_active = |point: &ParetoPoint| point.prices[index].is_nan() || point.prices[index] > 0.0;
        remarks.push(format!("the cost limit of {} is {}", one.name, placed(points, "active", is_active)).into());
    }
    let parameters = &task.problem.parameters;
    for index in parameters.design() {
        let Parameter { name, unit, bounds, .. } = parameters.get(index);
        for (side, end) in ["lower", "upper"].into_iter().zip(bounds) {
            let is_there = |point: &ParetoPoint| is_at(parameters, point, index, *end);
            if let Some(places) = places(points, is_there) {
                let (parameter, side) = (name.clone(), side.to_owned());
                let end = RangeEnd { parameter, side, value: *end, places };
                remarks.push(Remark { text: end.text(unit), end: Some(end) });
            }
        }
    }
    remarks
}

/// Where factor 1 lies.
fn own_bounds(ends: &Ends) -> String {
    let Ends { tight_factor: tight, loose_factor: loose, .. } = ends;
    if *tight > 1.0 {
        format!("no design meets the cost limits in the task file; the smallest feasible factor is {tight:.6}")
    } else if *loose <= 1.0 {
        format!("the cost limits in the task file are not active; they become inactive at a factor of {loose:.6}")
    } else {
        format!("the smallest feasible factor is {tight:.6}; no cost limit is active from a factor of {loose:.6} on")
    }
}

fn is_at(parameters: &Parameters, point: &ParetoPoint, index: usize, end: f64) -> bool {
    parameters.get(index).is_at(end, point.parameters.0[index].1)
}

/// `what` with the factors where it holds.
fn placed(points: &[ParetoPoint], what: &str, holds: impl Fn(&ParetoPoint) -> bool) -> String {
    places(points, holds).map_or_else(|| format!("nowhere {what}"), |places| format!("{what} {places}"))
}

/// The factors where something holds, in words; none where it holds nowhere.
fn places(points: &[ParetoPoint], holds: impl Fn(&ParetoPoint) -> bool) -> Option<String> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for (index, _) in points.iter().enumerate().filter(|(_, point)| holds(point)) {
        match runs.last_mut().filter(|run| run[1] + 1 == index) {
            Some(run) => run[1] = index,
            None => runs.push([index, index]),
        }
    }
    let run = |run: &[usize; 2]| match run.map(|index| points[index].factor) {
        [from, to] if from == to => format!("at factor {from:.6}"),
        [from, to] => format!("from factor {from:.6} to {to:.6}"),
    };
    match runs[..] {
        [] => None,
        [[0, to]] if to + 1 == points.len() => Some("at all points".to_owned()),
        _ => Some(runs.iter().map(run).collect::<Vec<_>>().join(", ")),
    }
}
