//! Information and cost over one or two parameters, with the paths of searches.

use maud::{Markup, html};
use serde_json::{Value, json};
use supple::Named;
use supple::parameters::Scale;
use supple_study::sweep::{Axis, Sweep};

use super::context::Context;
use super::convergence::kind;
use super::level_lines::level_line;
use super::pareto::{CROSSES, marker};
use crate::numbers::{bits, labelled, number};
use crate::part::Part;
use crate::plots::{Choice, Plot, Plots, View, colour, dash};
use crate::words::method;

/// Plots of every sweep over one or two parameters.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let sweeps = part.sweeps();
    if sweeps.is_empty() {
        return None;
    }
    let several = sweeps.len() > 1;
    let mut pieces = Vec::new();
    for (folder, sweep) in &sweeps {
        let suffix = if several { format!(", {folder}") } else { String::new() };
        let axes = &sweep.options.axes;
        pieces.push(match axes.len() {
            1 => curves(part, sweep, &suffix, context.plots),
            2 => planes(part, sweep, &suffix, context.plots),
            count => html! {
                p { "The sweep in " (folder) " is over " (count) " parameters and is not drawn; its table is in its folder." }
            },
        });
    }
    let searched = sweeps.iter().any(|(_, sweep)| sweep.options.starts > 0);
    Some(html! {
        p {
            "Each point of the grid is a separate design with its own plan. Its other parameters are "
            @if searched { "optimised if the sweep uses `--starts`, and otherwise " }
            "as given by the task or the command. Paths and designs with other values of those parameters are also drawn, at "
            "their position in this plane."
        }
        @for piece in pieces { (piece) }
    })
}

/// A quantity over a grid.
struct Quantity {
    name: String,
    unit: &'static str,
    /// By row of the second axis, then column of the first one.
    values: Vec<Vec<f64>>,
    /// 0 for information, 1 for the cost of the first task, and so on.
    place: usize,
    /// Its bound, where it is a cost with one.
    bound: Option<f64>,
}

impl Quantity {
    /// Its name with its unit; costs have none.
    fn title(&self) -> String {
        labelled(&self.name, if self.place == 0 { self.unit } else { "" })
    }
}

/// The points of a sweep whose plans never make a contact whose force a cost tracks, with their values of these quantities.
fn without_contact(sweep: &Sweep, quantities: &[Quantity]) -> Mark {
    let axes = &sweep.options.axes;
    let missed: Vec<f64> = sweep.contacts_made().into_iter().map(|made| f64::from(u8::from(!made))).collect();
    let (mut points, mut heights) = (Vec::new(), Vec::new());
    for (line, missed) in grid(sweep, axes, &missed).into_iter().enumerate() {
        for (column, _) in missed.into_iter().enumerate().filter(|(_, missed)| *missed == 1.0) {
            points.push([axes[0].values[column], axes.get(1).map_or(0.0, |axis| axis.values[line])]);
            heights.push(quantities.iter().map(|quantity| quantity.values[line][column]).collect());
        }
    }
    let name = "contact never made".into();
    Mark { name, group: None, first: true, points, heights, symbol: "x", colour: "@2".into() }
}

/// What a caption says of the points where a contact is missed.
fn crosses(missed: &Mark) -> &'static str {
    if missed.points.is_empty() {
        return "";
    }
    CROSSES
}

/// Information, and the cost of every task. A table in which points are missing has gaps.
fn quantities(part: &Part, sweep: &Sweep) -> Vec<Quantity> {
    let axes = &sweep.options.axes;
    let mut found = Vec::new();
    if let Some(nats) = sweep.table.numbers("information_nats") {
        let values = nats.into_iter().map(bits).collect::<Vec<_>>();
        let values = grid(sweep, axes, &values);
        found.push(Quantity { name: "Information".into(), unit: "bits", values, place: 0, bound: None });
    }
    for (index, task) in part.about.tasks.iter().enumerate() {
        if let Some(costs) = sweep.table.numbers(&format!("{}.expected_cost", task.name)) {
            let (name, values) = (format!("Expected cost of {}", task.name), grid(sweep, axes, &costs));
            found.push(Quantity { name, unit: "cost", values, place: index + 1, bound: task.bound });
        }
    }
    found
}

/// Numbers of a table's rows, placed by the values of the axes.
fn grid(sweep: &Sweep, axes: &[Axis], values: &[f64]) -> Vec<Vec<f64>> {
    let rows = axes.get(1).map_or(1, |axis| axis.values.len());
    let mut grid = vec![vec![f64::NAN; axes[0].values.len()]; rows];
    let place = |axis: &Axis, row: usize| {
        let column = sweep.table.numbers(&axis.parameter)?;
        nearest(&axis.values, *column.get(row)?)
    };
    let columns: Vec<Option<usize>> = (0..values.len()).map(|row| place(&axes[0], row)).collect();
    let lines: Vec<Option<usize>> =
        (0..values.len()).map(|row| axes.get(1).map_or(Some(0), |axis| place(axis, row))).collect();
    for ((value, column), line) in values.iter().zip(columns).zip(lines) {
        if let (Some(column), Some(line)) = (column, line) {
            grid[line][column] = *value;
        }
    }
    grid
}

/// The index of the value of an axis that a number in a table stands for.
fn nearest(values: &[f64], found: f64) -> Option<usize> {
    let far = |value: &f64| (value - found).abs();
    let (index, value) = values.iter().enumerate().min_by(|a, b| far(a.1).total_cmp(&far(b.1)))?;
    (far(value) <= 1e-9 * (1.0 + value.abs())).then_some(index)
}

/// The least value and where it is, in words.
fn least(quantity: &Quantity, axes: &[Axis]) -> String {
    let mut best: Option<(f64, usize, usize)> = None;
    let mut most = f64::NEG_INFINITY;
    for (row, values) in quantity.values.iter().enumerate() {
        for (column, &value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            most = most.max(value);
            if best.is_none_or(|(least, ..)| value < least) {
                best = Some((value, column, row));
            }
        }
    }
    let Some((value, column, row)) = best else { return format!("{}: no point could be evaluated.", quantity.name) };
    let at: Vec<String> = axes
        .iter()
        .zip([column, row])
        .map(|(axis, index)| {
            format!("{} = {}", axis.parameter, crate::numbers::with_unit(axis.values[index], &axis.unit))
        })
        .collect();
    let bound = quantity.bound.map_or_else(String::new, |bound| format!(" Its limit is {}.", number(bound)));
    format!(
        "{}, {}: from {} at {} to {}.{bound}",
        quantity.name,
        quantity.unit,
        number(value),
        at.join(", "),
        number(most)
    )
}

fn axis_layout(axis: &Axis) -> Value {
    let kind = if axis.scale == Scale::Log { "log" } else { "linear" };
    let mut layout = json!({ "title": { "text": labelled(&axis.parameter, &axis.unit) }, "type": kind });
    // Within three decades, marks at 1, 2 and 5 times powers of ten.
    if let (Scale::Log, [from, .., to]) = (axis.scale, &axis.values[..])
        && (to / from).max(from / to) <= 1e3
    {
        layout["dtick"] = "D2".into();
    }
    layout
}

/// One plot with a view by quantity.
fn curves(part: &Part, sweep: &Sweep, suffix: &str, plots: &mut Plots) -> Markup {
    let axes = &sweep.options.axes;
    let x = plots.arrays.exact(&axes[0].values);
    let (mut traces, mut views) = (Vec::new(), Vec::new());
    let quantities = quantities(part, sweep);
    let missed = without_contact(sweep, &quantities);
    let is_missed = |value: &f64| missed.points.iter().any(|at| at[0] == *value);
    let (symbols, sizes): (Vec<_>, Vec<_>) =
        axes[0].values.iter().map(|value| if is_missed(value) { ("x", 9) } else { ("circle", 5) }).unzip();
    for quantity in quantities {
        let mut view = View { name: quantity.name.clone(), alternative: least(&quantity, axes), ..Default::default() };
        view.layout.insert("yaxis.title.text".into(), quantity.unit.into());
        view.traces.push(traces.len());
        traces.push(json!({
            "type": "scatter", "mode": "lines+markers", "name": quantity.name, "x": x,
            "y": plots.arrays.exact(&quantity.values[0]), "line": { "color": "@1", "width": 2 },
            "marker": { "size": sizes, "symbol": symbols },
        }));
        if let (Some(bound), [from, .., to]) = (quantity.bound, &axes[0].values[..]) {
            view.traces.push(traces.len());
            traces.push(json!({
                "type": "scatter", "mode": "lines", "name": "bound", "x": [from, to], "y": [bound, bound],
                "line": { "color": "@2", "dash": "dash", "width": 2 },
            }));
        }
        views.push(view);
    }
    let alternative = views.first().map(|view| view.alternative.clone()).unwrap_or_default();
    plots.add(Plot {
        title: format!("Information and cost over {}{suffix}", axes[0].parameter),
        alternative,
        caption: format!("Gaps: designs that could not be evaluated.{}", crosses(&missed)),
        height: 380,
        traces,
        layout: json!({ "xaxis": axis_layout(&axes[0]), "yaxis": { "title": { "text": "" } } }),
        choice: Some(Choice { label: "Shown".into(), views }),
    })
}

/// A plot by quantity, as contours or as a surface.
fn planes(part: &Part, sweep: &Sweep, suffix: &str, plots: &mut Plots) -> Markup {
    let axes = &sweep.options.axes;
    let quantities = quantities(part, sweep);
    let missed = without_contact(sweep, &quantities);
    let mut marks = marks(part, axes);
    marks.extend((!missed.points.is_empty()).then_some(missed.clone()));
    let pieces: Vec<Markup> = quantities
        .iter()
        .map(|quantity| {
            let mut traces = vec![fill(quantity, axes, plots, "contour")];
            for other in quantities.iter().filter(|other| other.bound.is_some()) {
                traces.push(bound(other, quantity, axes, plots, false));
            }
            traces.extend(marks.iter().map(|mark| mark.trace(None, plots)));
            let flat = traces.len();
            traces.push(fill(quantity, axes, plots, "surface"));
            for other in quantities.iter().filter(|other| other.bound.is_some()) {
                traces.push(bound(other, quantity, axes, plots, true));
            }
            traces.extend(marks.iter().map(|mark| mark.trace(Some(quantity), plots)));
            let alternative = least(quantity, axes);
            let view = |name: &str, traces| View {
                name: name.into(),
                traces,
                alternative: alternative.clone(),
                ..Default::default()
            };
            let views = vec![view("Contours", (0..flat).collect()), view("Surface", (flat..traces.len()).collect())];
            let [horizontal, vertical] = [axis_layout(&axes[0]), axis_layout(&axes[1])];
            let up = json!({ "title": { "text": quantity.title() } });
            plots.add(Plot {
                title: format!("{}{suffix}", quantity.title()),
                alternative: alternative.clone(),
                caption: format!(
                    "On a thick orange line, an expected cost equals its limit. Gaps: designs that could not be \
                     evaluated.{}",
                    crosses(&missed)
                ),
                height: 520,
                traces,
                layout: json!({
                    "xaxis": horizontal, "yaxis": vertical, "hovermode": "closest",
                    "scene": { "xaxis": horizontal, "yaxis": vertical, "zaxis": up },
                }),
                choice: Some(Choice { label: "Shown as".into(), views }),
            })
        })
        .collect();
    html! { @for piece in pieces { (piece) } }
}

/// The quantity itself.
fn fill(quantity: &Quantity, axes: &[Axis], plots: &mut Plots, kind: &str) -> Value {
    let mut trace = json!({
        "type": kind, "x": plots.arrays.exact(&axes[0].values), "y": plots.arrays.exact(&axes[1].values),
        "z": plots.arrays.grid(&quantity.values), "colorscale": "Cividis", "name": quantity.name,
        "colorbar": { "title": { "text": quantity.unit }, "thickness": 14, "xpad": 26 }, "showlegend": false,
    });
    if kind == "contour" {
        trace["ncontours"] = 20.into();
        trace["line"] = json!({ "width": 0.5, "color": "@ink/0.4" });
    }
    trace
}

/// The value of an axis at a place between its entries.
fn value_at(axis: &Axis, place: f64) -> f64 {
    let index = (place.floor() as usize).min(axis.values.len().saturating_sub(2));
    let (Some(&from), Some(&to)) = (axis.values.get(index), axis.values.get(index + 1)) else { return f64::NAN };
    let share = place - index as f64;
    if axis.scale == Scale::Log { from * (to / from).powf(share) } else { from + share * (to - from) }
}

/// The line where a cost is at its bound; over the surface of a quantity, or in its plane.
fn bound(cost: &Quantity, quantity: &Quantity, axes: &[Axis], plots: &mut Plots, solid: bool) -> Value {
    let (mut x, mut y, mut z) = (Vec::new(), Vec::new(), Vec::new());
    for line in level_line(&cost.values, cost.bound.unwrap_or(f64::NAN), &quantity.values) {
        for [column, row, value] in line {
            x.push(value_at(&axes[0], column));
            y.push(value_at(&axes[1], row));
            z.push(value);
        }
        x.push(f64::NAN);
        y.push(f64::NAN);
        z.push(f64::NAN);
    }
    let name = format!("{} at its bound of {}", cost.name, number(cost.bound.unwrap_or(f64::NAN)));
    let mut trace = json!({
        "type": if solid { "scatter3d" } else { "scatter" }, "mode": "lines", "name": name, "hoverinfo": "name",
        "x": plots.arrays.exact(&x), "y": plots.arrays.exact(&y), "showlegend": true,
        "line": { "color": "@2", "width": if solid { 6 } else { 3 } },
    });
    if solid {
        trace["z"] = plots.arrays.exact(&z);
    }
    trace
}

/// Something drawn in the plane of the axes: a path or designs.
#[derive(Clone)]
struct Mark {
    name: String,
    group: Option<usize>,
    first: bool,
    points: Vec<[f64; 2]>,
    /// Information in bits and costs of the tasks, by point.
    heights: Vec<Vec<f64>>,
    symbol: &'static str,
    colour: String,
}

/// Paths of searches, then designs.
fn marks(part: &Part, axes: &[Axis]) -> Vec<Mark> {
    let place = |at: &Named| [0, 1].map(|axis| at.get(&axes[axis].parameter).unwrap_or(f64::NAN));
    let mut marks: Vec<Mark> = Vec::new();
    for (_, trace) in part.traces() {
        for run in &trace.runs {
            let kind = kind(run);
            let path = run.stepped();
            let height = |point: &supple_study::trace::TracePoint| {
                std::iter::once(bits(point.information_nats)).chain(point.costs.iter().copied()).collect()
            };
            marks.push(Mark {
                name: method(run.method, run.gradient),
                group: Some(kind),
                first: !marks.iter().any(|mark| mark.group == Some(kind)),
                points: path.clone().map(|point| place(&point.parameters)).collect(),
                heights: path.map(height).collect(),
                symbol: "circle",
                colour: colour(kind + 2),
            });
        }
    }
    for (index, shown) in part.designs().into_iter().enumerate() {
        let costs = shown.at.tasks.iter().map(|task| task.cost.expected);
        marks.push(Mark {
            points: vec![place(&shown.at.parameters)],
            heights: vec![std::iter::once(shown.at.objective.information_bits).chain(costs).collect()],
            name: shown.name,
            group: None,
            first: true,
            symbol: marker(index),
            colour: "@mark".into(),
        });
    }
    marks
}

impl Mark {
    /// In the plane, or over the surface of a quantity.
    fn trace(&self, over: Option<&Quantity>, plots: &mut Plots) -> Value {
        let column = |index: usize| self.points.iter().map(|point| point[index]).collect::<Vec<_>>();
        let path = self.group.is_some();
        let mode = if path { "lines+markers" } else { "markers" };
        let mut trace = json!({
            "type": if over.is_some() { "scatter3d" } else { "scatter" }, "mode": mode, "name": self.name,
            "x": plots.arrays.exact(&column(0)), "y": plots.arrays.exact(&column(1)), "showlegend": self.first,
            "legendgroup": self.name, "hoverinfo": "x+y+name",
            "line": { "color": self.colour, "width": if over.is_some() { 4.0 } else { 1.5 }, "dash": dash(self.group.unwrap_or(0)) },
            "marker": {
                "color": self.colour, "symbol": self.symbol,
                "size": if path { 3 } else if over.is_some() { 7 } else { 12 },
                "line": { "color": "@ink", "width": if path { 0 } else { 1 } },
            },
        });
        if let Some(quantity) = over {
            let index = quantity.place;
            let heights: Vec<f64> =
                self.heights.iter().map(|heights| heights.get(index).copied().unwrap_or(f64::NAN)).collect();
            trace["z"] = plots.arrays.exact(&heights);
            // Surfaces know fewer symbols.
            if self.symbol == "star" || self.symbol == "triangle-up" {
                trace["marker"]["symbol"] = "diamond".into();
            }
        }
        trace
    }
}
