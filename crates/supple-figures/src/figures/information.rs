use supple::parameters::Scale;
use supple_study::Folder;

use super::grouping::grouped;
use super::results::{NATS, Shown, designs};
use crate::figure::{Axis, Colour, Figure, Grid, Panel, Series, Shape, Style};
use crate::{FigureError, words};

/// Bits of each measurement over time, together and of each channel beyond the others; below it the value of
/// information, `Tr(Xi)`, and the cost of the estimation error, `1/2 Tr(Xi Sigma)`. One column of panels
/// per design.
///
/// Where there are more than seven channels, those with the least information are drawn in grey.
///
/// # Errors
/// Where there is no evaluated design, or no task of the name.
///
/// Example: [`belief`](crate::belief).
pub fn information(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let shown = designs("information", folders, task)?;
    let channels = channels(&shown);
    let important: Vec<String> = [ALL.to_owned()].into_iter().chain(by_information(&channels).map(label)).collect();
    let columns = shown.len();
    let bits: Vec<Vec<Series>> =
        shown.iter().map(|design| bits(design, channels.iter().map(|(name, _)| name))).collect();
    let value = |design: &Shown| {
        let y = design.task.cost.value_of_information_per_step.clone();
        vec![Series::plain(Style::line(Colour::Green), line(design, y))]
    };
    let value: Vec<Vec<Series>> = shown.iter().map(value).collect();
    let worth: Vec<Vec<Series>> = shown.iter().map(worth).collect();
    let axis = |label: &str, unit: &str, scale: Scale, series: &[Vec<Series>]| {
        let all: Vec<f64> = series.iter().flatten().flat_map(Series::ordinates).collect();
        Axis::around(label, unit, scale, &all)
    };
    let rows = [
        (axis("information per step", "bits", Scale::Linear, &bits), bits),
        (axis("value of information", "", Scale::Log, &value), value),
        (axis("cost of estimation error", "", Scale::Linear, &worth), worth),
    ];
    let mut panels = Vec::new();
    for (row, (y, lines)) in rows.into_iter().enumerate() {
        for (design, series) in shown.iter().zip(lines) {
            let total = format!("{} bits", words::typeset(design.task.information.total_bits));
            let title = match row {
                0 if columns > 1 => format!("{}, {total}", design.design),
                0 => total,
                _ => String::new(),
            };
            let x = Axis::within("time", "s", Scale::Linear, &design.trajectory.time);
            panels.push(Panel { title, x, y: y.clone(), series });
        }
    }
    let figure = Figure {
        name: "information".into(),
        title: format!("Directed information over time of the task {}, and its value", shown[0].task.name),
        panels,
        column: Grid { columns, aspect: if columns == 1 { 0.4 } else { 0.75 } },
        page: Grid { columns, aspect: if columns == 1 { 0.25 } else { 0.42 } },
        shared_x: true,
        shared_y: true,
    };
    Ok(grouped(figure, &important))
}

/// The label of all measurements together.
const ALL: &str = "all measurements";

/// The label of a channel.
fn label(name: &str) -> String {
    format!("{} beyond the others", words::name(name))
}

/// The channels in the order of the task, each with the most information that it has in any design.
fn channels(shown: &[Shown]) -> Vec<(String, f64)> {
    let mut sums: Vec<(String, f64)> = Vec::new();
    for channel in shown.iter().flat_map(|design| &design.trajectory.measurements) {
        let sum = channel.beyond_others_nats.iter().filter(|nats| nats.is_finite()).sum::<f64>();
        match sums.iter_mut().find(|(name, _)| *name == channel.name) {
            Some((_, most)) => *most = most.max(sum),
            None => sums.push((channel.name.clone(), sum)),
        }
    }
    sums
}

/// Their names, those with the most information first.
fn by_information(channels: &[(String, f64)]) -> impl Iterator<Item = &str> {
    let mut order: Vec<&(String, f64)> = channels.iter().collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1));
    order.into_iter().map(|(name, _)| name.as_str())
}

fn line(design: &Shown, y: Vec<f64>) -> Shape {
    let time = &design.trajectory.time;
    Shape::Line { x: time[..y.len().min(time.len())].to_vec(), y }
}

fn bits<'a>(design: &Shown, channels: impl Iterator<Item = &'a String>) -> Vec<Series> {
    let bits = |nats: &[f64]| line(design, nats.iter().map(|nats| nats / NATS).collect());
    let total = bits(&design.task.information.per_step_nats);
    let mut series = vec![Series::named(ALL, Style { width: 1.6, ..Style::line(Colour::Black) }, total)];
    for (index, name) in channels.enumerate() {
        if let Some(channel) = design.trajectory.measurements.iter().find(|channel| channel.name == *name) {
            let style = Style::of_set(index);
            series.push(Series::named(label(name), style, bits(&channel.beyond_others_nats)));
        }
    }
    series
}

/// The cost of the estimation error, `1/2 Tr(Xi Sigma)`.
fn worth(design: &Shown) -> Vec<Series> {
    let style = Style::line(Colour::Purple);
    let cost = line(design, design.task.cost.belief_per_step.clone());
    vec![Series::plain(style, cost)]
}
