//! What other results add to a landscape: paths, starts and optima.

use supple::{Evaluation, Named};
use supple_study::pareto::Pareto;
use supple_study::trace::{Trace, TracePoint};
use supple_study::{Folder, StudyResult};
use supple_text::short;

use super::results::{NATS, task_index};
use crate::figure::{Colour, Dash, Marker, Series, Shape, Style};
use crate::{FigureError, words};

/// A design in a landscape.
pub struct Spot {
    parameters: Named,
    /// Its information, bits.
    pub bits: f64,
    /// Its expected cost.
    pub cost: f64,
}

impl Spot {
    /// The value of a parameter; NaN where it has none.
    pub fn at(&self, parameter: &str) -> f64 {
        self.parameters.get(parameter).unwrap_or(f64::NAN)
    }
}

/// A path with its ends.
pub struct Track {
    label: String,
    style: Style,
    spots: Vec<Spot>,
    /// Whether its ends are marked.
    ended: bool,
}

impl Track {
    /// The track in a panel, with `place` its map from designs to the axes.
    pub fn series(&self, place: &impl Fn(&Spot) -> (f64, f64)) -> Vec<Series> {
        let (x, y): (Vec<f64>, Vec<f64>) = self.spots.iter().map(place).unzip();
        let ends = |index: Option<usize>| {
            let at =
                |values: &[f64]| index.and_then(|index| values.get(index)).map_or(Vec::new(), |value| vec![*value]);
            Shape::Points { x: at(&x), y: at(&y) }
        };
        let mark = |colour, marker, filled| Style { filled, rim: filled, ..Style::points(colour, marker) };
        let shape = |x, y| if self.style.width > 0.0 { Shape::Line { x, y } } else { Shape::Points { x, y } };
        let mut series = vec![Series::named(self.label.clone(), self.style, shape(x.clone(), y.clone()))];
        if self.ended {
            let start = mark(Colour::Black, Marker::Circle, false);
            let end = mark(Colour::Vermilion, Marker::Star, true);
            series.push(Series::named("start", start, ends(Some(0))));
            series.push(Series::named("end", end, ends(x.len().checked_sub(1))));
        }
        series
    }
}

/// All that folders add to the landscape of a task; their information is that of the task, or else of the objective. Designs
/// with other values of what the landscape holds are named so.
pub fn tracks(folders: &[Folder], task: &str, of_task: bool, held: &Named) -> Result<Vec<Track>, FigureError> {
    let mut tracks = Vec::new();
    for folder in folders {
        let index = || task_index(folder, Some(task));
        match &folder.result {
            StudyResult::Trace(trace) => tracks.extend(of_trace(trace, index()?)),
            StudyResult::Pareto(front) => tracks.push(of_front(front, index()?, of_task)),
            StudyResult::Design(report) => {
                let index = index()?;
                let start = Style { filled: false, ..Style::points(Colour::Black, Marker::Square) };
                let optimum = Style { rim: true, ..Style::points(Colour::Orange, Marker::Diamond) };
                for (name, style, at) in
                    [("initial design", start, &report.start), ("optimum", optimum, &report.optimum)]
                {
                    let label = name.to_owned() + &elsewhere(&at.parameters, held);
                    tracks.push(single(&label, style, of_evaluation(at, index, of_task)));
                }
            }
            _ => {}
        }
    }
    // Single designs are drawn last: no path or front covers them.
    tracks.sort_by_key(|track| track.spots.len() == 1 && !track.ended);
    Ok(tracks)
}

/// Values of a design that a landscape holds at others: ` (k = 5)`; empty if there are none.
fn elsewhere(design: &Named, held: &Named) -> String {
    let differs = |(name, value): &&(String, f64)| {
        held.get(name).is_some_and(|held| (value - held).abs() > SAME * held.abs().max(value.abs()))
    };
    let others: Vec<&(String, f64)> = design.0.iter().filter(differs).collect();
    match others[..] {
        [] => String::new(),
        [(name, value)] => format!(" ({} = {})", words::name(name), short(*value, 3)),
        _ => " (other parameters differ)".to_owned(),
    }
}

/// Share by which values of a parameter may differ from those of a landscape without a word.
const SAME: f64 = 1e-9;

fn single(label: &str, style: Style, spot: Spot) -> Track {
    Track { label: label.into(), style: Style { width: 0.0, ..style }, spots: vec![spot], ended: false }
}

fn of_evaluation(evaluation: &Evaluation, index: usize, of_task: bool) -> Spot {
    let task = evaluation.tasks.get(index);
    let objective = evaluation.objective.information_bits;
    let bits = if of_task { task.map_or(f64::NAN, |task| task.information.total_bits) } else { objective };
    Spot { parameters: evaluation.parameters.clone(), bits, cost: task.map_or(f64::NAN, |task| task.cost.expected) }
}

fn of_front(front: &Pareto, index: usize, of_task: bool) -> Track {
    let spots = front.points.iter().map(|point| {
        let nats =
            if of_task { point.task_nats.get(index).copied().unwrap_or(f64::NAN) } else { point.information_nats };
        let cost = point.costs.get(index).copied().unwrap_or(f64::NAN);
        Spot { parameters: point.parameters.clone(), bits: nats / NATS, cost }
    });
    let style = Style { rim: true, ..Style::line(Colour::Orange) }.marked(Marker::Triangle);
    Track { label: "Pareto front".into(), style, spots: spots.collect(), ended: false }
}

/// One style per method and gradient. A path goes through the designs that the
/// optimiser stepped to: trial points that it rejected would only clutter the plot.
fn of_trace(trace: &Trace, index: usize) -> Vec<Track> {
    let spot = |point: &TracePoint| {
        let cost = point.costs.get(index).copied().unwrap_or(f64::NAN);
        Spot { parameters: point.parameters.clone(), bits: point.information_nats / NATS, cost }
    };
    let mut tracks = Vec::new();
    for run in &trace.runs {
        let (method, gradient) = (run.method, run.gradient);
        let label = format!("{}, {gradient} gradient", method.label());
        let spots: Vec<Spot> = run.stepped().map(spot).collect();
        tracks.push(Track { label, style: path_style(method.number(gradient)), spots, ended: true });
    }
    tracks
}

/// Colours that stand out from the maps below them, one for each optimiser with each of its gradients.
const PATHS: [(Colour, Dash); 5] = [
    (Colour::Black, Dash::Solid),
    (Colour::Vermilion, Dash::Dashed),
    (Colour::Green, Dash::Dotted),
    (Colour::Purple, Dash::DashDotted),
    (Colour::Sky, Dash::Dotted),
];

fn path_style(kind: usize) -> Style {
    let (colour, dash) = PATHS[kind % PATHS.len()];
    Style { dash, width: 0.8, rim: true, ..Style::line(colour) }
}
