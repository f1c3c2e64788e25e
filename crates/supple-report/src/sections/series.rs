//! Time series of designs, as plots take them.

use serde_json::{Map, Value, json};
use supple::{TaskEvaluation, TrajectoryReport};
use supple_study::clipped;

use crate::arrays::{thin, thin_column};
use crate::numbers::number;
use crate::part::{Part, Shown};
use crate::plots::{Plots, axis_key};

/// A design in one task, with its trajectory.
pub struct Run<'a> {
    /// The design's name.
    pub name: String,
    /// The task at that design.
    pub task: &'a TaskEvaluation,
    /// Its trajectory.
    pub trajectory: &'a TrajectoryReport,
}

/// The designs of a part that have a trajectory in the task with this index, in the order of [`Part::designs`].
pub fn runs<'a>(part: &Part<'a>, task: usize) -> Vec<Run<'a>> {
    let run = |shown: Shown<'a>| {
        let task = shown.at.tasks.get(task)?;
        Some(Run { name: shown.name, task, trajectory: task.trajectory.as_ref()? })
    };
    part.designs().into_iter().filter_map(run).collect()
}

/// The title of a plot of one task: the task is named where there are several.
pub fn titled(part: &Part, what: &str, task: usize) -> String {
    match part.about.tasks.get(task) {
        Some(about) if part.about.tasks.len() > 1 => format!("{what}: {}", about.name),
        _ => what.to_owned(),
    }
}

/// The time of `count` points of a run.
pub fn time(plots: &mut Plots, run: &Run, count: usize) -> Value {
    let time = &run.trajectory.time;
    plots.arrays.curve(&thin(&time[..count.min(time.len())]))
}

/// A series that is drawn thinned.
pub fn curve(plots: &mut Plots, values: &[f64]) -> Value {
    plots.arrays.curve(&thin(values))
}

/// A column of rows that is drawn thinned.
pub fn column(plots: &mut Plots, rows: &[Vec<f64>], index: usize) -> Value {
    plots.arrays.curve(&thin_column(rows, index))
}

/// A line trace. `y` may be null where views of the plot give it.
pub fn line(name: &str, x: &Value, y: Value, line: Value) -> Value {
    json!({ "type": "scatter", "mode": "lines", "name": name, "x": x, "y": y, "line": line })
}

/// The running sum.
pub fn sums(values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    values
        .iter()
        .map(|value| {
            sum += value;
            sum
        })
        .collect()
}

/// The sum of the numbers that there are, none where there are none.
pub fn sum(values: &[f64]) -> f64 {
    if values.is_empty() { f64::NAN } else { values.iter().sum() }
}

/// The vertical axes of panels, with a title; if a run diverges, their range is that of the plans, which thus remain
/// readable, and the title states how far the run goes.
pub fn upright(panels: usize, label: &str, plans: &[f64], runs: &[f64]) -> Map<String, Value> {
    let clip = clipped(plans, runs);
    let note = clip.map_or_else(String::new, |(_, worst)| format!(" (clipped: a run reaches {})", number(worst)));
    let mut layout = Map::new();
    for panel in 0..panels {
        let axis = axis_key("yaxis", panel);
        layout.insert(format!("{axis}.title.text"), format!("{label}{note}").into());
        if let Some((range, _)) = clip {
            layout.insert(format!("{axis}.range"), json!(range));
        }
    }
    layout
}
