use supple::TrajectoryReport;
use supple::parameters::Scale;
use supple_study::Folder;

use super::results::{Shown, designs};
use crate::figure::{Axis, Colour, Dash, Figure, Grid, Panel, Series, Shape, Style};
use crate::{FigureError, words};

/// The most states that are shown.
const MOST: usize = 6;

/// States over time, with one closed-loop run: plan, true state, estimate and two standard deviations around it. One
/// column of panels per design.
///
/// States come in the order of how far their belief moves: the way of the planned mean from its least to its greatest
/// value, and that of twice the standard deviation, over the mean standard deviation. Of more than six states the first
/// six are shown.
///
/// # Errors
/// Where there is no evaluated design, or no task of the name.
pub fn belief(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let shown = designs("belief", folders, task)?;
    let columns = shown.len();
    let mut panels = Vec::new();
    for (row, name) in chosen(&shown).into_iter().enumerate() {
        let states: Vec<_> = shown.iter().map(|design| state(design.trajectory, &name)).collect();
        let all: Vec<f64> = states.iter().flatten().flat_map(Series::ordinates).collect();
        let unit = unit(shown[0].trajectory, &name);
        let y = Axis::around(words::name(&name), unit, Scale::Linear, &all);
        for (design, series) in shown.iter().zip(states) {
            let title = if row == 0 && columns > 1 { design.design.clone() } else { String::new() };
            let x = Axis::within("time", "s", Scale::Linear, &design.trajectory.time);
            panels.push(Panel { title, x, y: y.clone(), series });
        }
    }
    let single = columns == 1;
    let grid = |alone: usize, aspect: f64| Grid { columns: if single { alone } else { columns }, aspect };
    Ok(Figure {
        name: "belief".into(),
        title: format!("States over time of the task {}: plan, and one run in closed loop", shown[0].task.name),
        panels,
        column: grid(2, 0.6),
        page: grid(3, if columns > 2 { 0.5 } else { 0.36 }),
        shared_x: !single,
        shared_y: !single,
    })
}

/// The names of the states to show.
fn chosen(shown: &[Shown]) -> Vec<String> {
    let names = &shown[0].trajectory.state_names;
    let interest = |index: usize, name: &String| {
        let of = |design: &Shown| index_of(design.trajectory, name).map_or(0.0, |i| motion(design.trajectory, i));
        (shown.iter().map(of).fold(0.0, f64::max), index)
    };
    let mut order: Vec<(f64, usize)> = names.iter().enumerate().map(|(i, name)| interest(i, name)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    order.into_iter().take(MOST).map(|(_, index)| names[index].clone()).collect()
}

/// How far the belief of a state moves, in its mean standard deviations.
fn motion(trajectory: &TrajectoryReport, index: usize) -> f64 {
    let way = |rows: &[Vec<f64>]| {
        let values = rows.iter().map(|row| row[index]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    let mean = trajectory.deviations.iter().map(|row| row[index]).sum::<f64>() / trajectory.deviations.len() as f64;
    let moved = way(&trajectory.states) + 2.0 * way(&trajectory.deviations);
    // Where nothing is uncertain, all that moves comes first, and all that rests last.
    if moved > 0.0 { moved / mean.max(f64::MIN_POSITIVE) } else { 0.0 }
}

fn index_of(trajectory: &TrajectoryReport, name: &str) -> Option<usize> {
    trajectory.state_names.iter().position(|other| other == name)
}

fn unit(trajectory: &TrajectoryReport, name: &str) -> String {
    index_of(trajectory, name).and_then(|index| trajectory.state_units.get(index).cloned()).unwrap_or_default()
}

/// A state of a design: nothing where the design has no such state.
fn state(trajectory: &TrajectoryReport, name: &str) -> Vec<Series> {
    let Some(index) = index_of(trajectory, name) else { return Vec::new() };
    let of = |rows: &[Vec<f64>]| -> Vec<f64> { rows.iter().map(|row| row[index]).collect() };
    let (time, sample) = (&trajectory.time, &trajectory.sample);
    let (estimate, deviation) = (of(&sample.estimates), of(&sample.deviations));
    let bound = |sign: f64| estimate.iter().zip(&deviation).map(|(mean, sigma)| mean + sign * 2.0 * sigma).collect();
    let line = |y: Vec<f64>| Shape::Line { x: time[..y.len().min(time.len())].to_vec(), y };
    let count = estimate.len().min(time.len());
    let band = Shape::Band { x: time[..count].to_vec(), low: bound(-1.0), high: bound(1.0) };
    let plan = Style { dash: Dash::Dashed, width: 0.8, ..Style::line(Colour::Black) };
    let estimated = Style { dash: Dash::DashDotted, ..Style::line(Colour::Vermilion) };
    vec![
        Series::named("estimate ± 2 std. dev.", Style::area(Colour::Vermilion, 0.22), band),
        Series::named("true state", Style { width: 1.3, ..Style::line(Colour::Blue) }, line(of(&sample.states))),
        Series::named("estimate ± 2 std. dev.", estimated, line(estimate)),
        Series::named("plan", plan, line(of(&trajectory.states))),
    ]
}
