use supple::TrajectoryReport;
use supple::parameters::Scale;
use supple_study::Folder;

use super::grouping::grouped;
use super::results::designs;
use crate::figure::{Axis, Figure, Grid, Panel, Series, Shape, Style};
use crate::{FigureError, words};

/// The most entries of the feedback that are drawn each by itself.
const MOST: usize = 12;

/// A row of panels: lines of one unit.
struct Row {
    label: &'static str,
    unit: String,
    /// Names of the lines.
    names: Vec<String>,
    /// The lines of each design.
    lines: Vec<Vec<Vec<f64>>>,
}

/// Feedback gains and feedforward over time, one column of panels per design: each entry of the gains, or of more than
/// twelve the norm per state. Entries of one unit share their axes. Where there are more than eight lines, the smallest are
/// drawn in grey.
///
/// # Errors
/// Where there is no evaluated design, or no task of the name.
///
/// Example: [`belief`](crate::belief).
pub fn gains(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let shown = designs("gains", folders, task)?;
    let trajectories: Vec<_> = shown.iter().map(|design| design.trajectory).collect();
    let mut rows = feedback_rows(&trajectories);
    let feedforward = rows.len();
    rows.extend(feedforward_rows(&trajectories));
    let columns = shown.len();
    let important = largest(&rows);
    let mut panels = Vec::new();
    let mut styles = 0;
    for (index, row) in rows.iter().enumerate() {
        let all: Vec<f64> = row.lines.iter().flatten().flatten().copied().collect();
        let y = Axis::around(row.label, row.unit.clone(), Scale::Linear, &all);
        for (design, lines) in shown.iter().zip(&row.lines) {
            let controller = &design.task.controller;
            let vary = |what: f64| format!("variation {}", words::fixed(what, 2));
            let title = match index {
                0 if columns > 1 => format!("{}, {}", design.design, vary(controller.feedback_variation)),
                0 => vary(controller.feedback_variation),
                index if index == feedforward => vary(controller.feedforward_variation),
                _ => String::new(),
            };
            let time = &design.trajectory.time;
            let line = |(i, (name, y)): (usize, (&String, &Vec<f64>))| {
                let x = time[..y.len().min(time.len())].to_vec();
                Series::named(name.clone(), Style::of_set(styles + i), Shape::Line { x, y: y.clone() })
            };
            let series = row.names.iter().zip(lines).enumerate().map(line).collect();
            let x = Axis::within("time", "s", Scale::Linear, time);
            panels.push(Panel { title, x, y: y.clone(), series });
        }
        styles += row.names.len();
    }
    let figure = Figure {
        name: "gains".into(),
        title: format!("Feedback gains and feedforward over time of the task {}", shown[0].task.name),
        panels,
        column: Grid { columns, aspect: if columns == 1 { 0.4 } else { 0.7 } },
        page: Grid { columns, aspect: if columns == 1 { 0.22 } else { 0.38 } },
        shared_x: true,
        shared_y: true,
    };
    Ok(grouped(figure, &important))
}

/// Names of the lines by their peak relative to the highest peak in their row, the largest first.
fn largest(rows: &[Row]) -> Vec<String> {
    let mut ranked: Vec<(f64, &String)> = Vec::new();
    for row in rows {
        let peak = |line: usize| {
            let values = row.lines.iter().filter_map(|lines| lines.get(line)).flatten();
            values.filter(|value| value.is_finite()).fold(0.0, |peak: f64, value| peak.max(value.abs()))
        };
        let peaks: Vec<f64> = (0..row.names.len()).map(peak).collect();
        let most = peaks.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        ranked.extend(peaks.iter().zip(&row.names).map(|(peak, name)| (peak / most, name)));
    }
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    ranked.into_iter().map(|(_, name)| name.clone()).collect()
}

/// Rows of the feedback: one per unit.
fn feedback_rows(trajectories: &[&TrajectoryReport]) -> Vec<Row> {
    let first = trajectories[0];
    let (controls, states) = (first.control_names.len(), first.state_names.len());
    let norms = controls * states > MOST;
    let mut rows: Vec<Row> = Vec::new();
    for control in 0..if norms { 1 } else { controls } {
        for state in 0..states {
            let unit = match norms {
                // Of controls that have different units, the norm has none.
                true if first.control_units.iter().any(|unit| *unit != first.control_units[0]) => String::new(),
                _ => quotient(at(&first.control_units, control), at(&first.state_units, state)),
            };
            let name = words::name(&first.state_names[state]);
            let entry = |row: &Vec<Vec<f64>>| {
                let get = |control: usize| row.get(control).and_then(|row| row.get(state)).copied().unwrap_or(f64::NAN);
                if norms { (0..controls).map(|c| get(c).powi(2)).sum::<f64>().sqrt() } else { get(control) }
            };
            let lines: Vec<Vec<f64>> =
                trajectories.iter().map(|trajectory| trajectory.feedback.iter().map(entry).collect()).collect();
            let name = match (norms, controls) {
                (false, 2..) => format!("{}, {name}", words::name(&first.control_names[control])),
                _ => name,
            };
            add(&mut rows, if norms { "norm of gain" } else { "gain" }, unit, name, lines);
        }
    }
    rows
}

/// Rows of the feedforward: one per unit.
fn feedforward_rows(trajectories: &[&TrajectoryReport]) -> Vec<Row> {
    let first = trajectories[0];
    let mut rows: Vec<Row> = Vec::new();
    for (control, name) in first.control_names.iter().enumerate() {
        let entry = |row: &Vec<f64>| row.get(control).copied().unwrap_or(f64::NAN);
        let lines = trajectories.iter().map(|trajectory| trajectory.controls.iter().map(entry).collect()).collect();
        add(&mut rows, "feedforward", at(&first.control_units, control).to_owned(), words::name(name), lines);
    }
    rows
}

/// Adds a line of each design to the row of its unit.
fn add(rows: &mut Vec<Row>, label: &'static str, unit: String, name: String, lines: Vec<Vec<f64>>) {
    let index = rows.iter().position(|row| row.unit == unit).unwrap_or_else(|| {
        let lines = vec![Vec::new(); lines.len()];
        rows.push(Row { label, unit, names: Vec::new(), lines });
        rows.len() - 1
    });
    let row = &mut rows[index];
    row.names.push(name);
    for (all, line) in row.lines.iter_mut().zip(lines) {
        all.push(line);
    }
}

fn at(units: &[String], index: usize) -> &str {
    units.get(index).map_or("", String::as_str)
}

/// The unit of a control by a state.
fn quotient(control: &str, state: &str) -> String {
    match (control, state) {
        (_, "") => control.to_owned(),
        ("", _) => format!("1/({state})"),
        _ if control == state => String::new(),
        _ => match state.split_once('/') {
            Some((above, below)) if !below.contains('/') => format!("{control} {below}/{above}"),
            _ => format!("{control}/{state}"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::quotient;

    #[test]
    fn units_of_gains_are_simple() {
        let pairs = [("N", "m"), ("N", "m/s"), ("N m", "rad/s"), ("N", ""), ("", "m"), ("m", "m")];
        let units = pairs.map(|(control, state)| quotient(control, state));
        assert_eq!(units, ["N/m", "N s/m", "N m s/rad", "N", "1/(m)", ""]);
    }
}
