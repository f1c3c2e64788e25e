use supple::bound::TaskBound;
use supple::parameters::Scale;
use supple_study::bound::{BoundStudy, Curve};
use supple_study::{Folder, StudyResult};

use super::grouping::grouped;
use super::results::{content, folder_name, lacking};
use crate::figure::{Axis, Colour, Dash, Figure, Grid, Marker, Panel, Series, Shape, Style};
use crate::{FigureError, words};

/// A curve with the bounds of its task.
struct Shown<'a> {
    name: Option<String>,
    task: &'a TaskBound,
    curve: &'a Curve,
}

/// The least information over how far the expected cost is above the least there is, with what the design's own sensors
/// and controller use.
///
/// # Errors
/// Where there is no curve, or no task of the name.
pub fn bound(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let found = folders.iter().filter_map(|folder| match &folder.result {
        StudyResult::Bound(study) => Some((folder, &**study)),
        _ => None,
    });
    let found: Vec<_> = found.collect();
    let several = found.len() > 1;
    let mut shown = Vec::new();
    for (folder, study) in found {
        shown.push(Shown { name: several.then(|| folder_name(folder)), ..one(folder, study, task)? });
    }
    let Some(first) = shown.first() else {
        return Err(lacking("bound", "a folder of `supple bound --curve`", folders));
    };
    let mut series = Vec::new();
    shown.iter().enumerate().for_each(|(index, one)| of_curve(index, one, &mut series));
    let excess: Vec<f64> =
        shown.iter().flat_map(|one| one.curve.points.iter().map(|point| one.excess(point.cost))).collect();
    let x = Axis::around("expected cost above the minimum", "", Scale::Log, &excess);
    let all: Vec<f64> = series.iter().flat_map(Series::ordinates).chain([0.0]).collect();
    let y = Axis::around("directed information per step", "bits", Scale::Linear, &all);
    let least = words::typeset(first.task.minimum_cost);
    let title = if several { String::new() } else { format!("{}, minimum cost {least}", first.task.name) };
    let important: Vec<String> = shown.iter().map(|one| one.label("minimum")).collect();
    let figure = Figure {
        name: "bound".into(),
        title: format!("Minimum information required for the task {}, over its expected cost", first.task.name),
        panels: vec![Panel { title, x, y, series }],
        column: Grid { columns: 1, aspect: 0.7 },
        page: Grid { columns: 1, aspect: 0.42 },
        shared_x: true,
        shared_y: true,
    };
    Ok(grouped(figure, &important))
}

impl Shown<'_> {
    fn excess(&self, cost: f64) -> f64 {
        cost - self.task.minimum_cost
    }

    fn label(&self, what: &str) -> String {
        self.name.as_ref().map_or_else(|| what.to_owned(), |name| format!("{what}, {name}"))
    }
}

/// The curve of the named task, or else of the first one.
fn one<'a>(folder: &Folder, study: &'a BoundStudy, task: Option<&str>) -> Result<Shown<'a>, FigureError> {
    if study.curves.is_empty() {
        return Err(content(folder, "has no curve; recompute the result with `--curve`"));
    }
    let both = || study.report.tasks.iter().zip(&study.curves);
    let found = both().find(|(of, _)| task.is_none_or(|name| name == of.name));
    let unknown = || {
        let valid = both().map(|(of, _)| of.name.as_str()).collect::<Vec<_>>().join(", ");
        FigureError::UnknownTask { name: task.unwrap_or_default().to_owned(), valid }
    };
    let (task, curve) = found.ok_or_else(unknown)?;
    Ok(Shown { name: None, task, curve })
}

fn of_curve(index: usize, one: &Shown, series: &mut Vec<Series>) {
    let x: Vec<f64> = one.curve.points.iter().map(|point| one.excess(point.cost)).collect();
    let style = Style::of_set(index);
    if one.task.stationary {
        let y = one.curve.points.iter().map(|point| point.closed_form_bits_per_step).collect();
        let dashed = Style { dash: Dash::Dashed, width: 0.8, ..style };
        series.push(Series::named(
            one.label("Kostina and Hassibi, or the floor"),
            dashed,
            Shape::Line { x: x.clone(), y },
        ));
    }
    let y: Vec<f64> = one.curve.points.iter().map(|point| point.minimum_bits_per_step).collect();
    series.push(Series::named(one.label("minimum"), style, Shape::Line { x, y }));
    // No bound of these points is proved, or none close by.
    let open: Vec<_> = one.curve.points.iter().filter(|point| point.error.is_some()).collect();
    if !open.is_empty() {
        let x = open.iter().map(|point| one.excess(point.cost)).collect();
        let y = open.iter().map(|point| point.minimum_bits_per_step).collect();
        let style = Style { filled: false, ..style.marked(Marker::of_set(index)) };
        series.push(Series::named(one.label("not certified"), style, Shape::Points { x, y }));
    }
    let Some(own) = one.task.own_cost.map(|cost| one.excess(cost)).filter(|own| *own > 0.0) else { return };
    let designs = [
        ("DI(x → u) of the design", one.task.control_bits_per_step, Marker::of_set(0), Colour::Black),
        ("DI(x → y) of the design", one.task.measurement_bits_per_step, Marker::of_set(1), Colour::Black),
    ];
    for (what, bits, marker, colour) in designs {
        if let Some(bits) = bits {
            let style = Style { filled: index == 0, ..Style::line(colour).marked(marker) };
            series.push(Series::named(one.label(what), style, Shape::Points { x: vec![own], y: vec![bits] }));
        }
    }
}
