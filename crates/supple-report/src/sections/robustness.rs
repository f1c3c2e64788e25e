//! Costs in closed loop as a noise grows.

use maud::{Markup, html};
use serde_json::{Value, json};
use supple::parameters::Scale;
use supple_study::robustness::{Comparison, Paired, PlannedFor, RobustCell, Robustness};

use super::context::Context;
use super::series::titled;
use crate::html::{table, words};
use crate::numbers::{labelled, number, with_unit};
use crate::plots::{Choice, Plot, Plots, View, colour, dash};
use crate::words::{list, planning};

/// A plot, comparisons and a table by study and task.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let studies = part.robustness();
    if studies.is_empty() {
        return None;
    }
    let mut pieces = Vec::new();
    for (folder, study) in &studies {
        for task in 0..part.about.tasks.len() {
            let title = titled(part, "Cost in closed loop", task);
            let title = if studies.len() > 1 { format!("{title}, {folder}") } else { title };
            pieces.push(plot(study, task, title.clone(), context.plots));
            pieces.push(comparisons(study, task));
            pieces.push(numbers(study, task, &title));
        }
    }
    Some(html! {
        p {
            "Each design is run in closed loop under increasing noise; all designs use the same random numbers. The "
            "controller and its filter are planned either for the nominal noise in the task, or for the true noise."
        }
        @for piece in pieces { (piece) }
    })
}

/// The cells of a design under a planning, by level.
fn cells(study: &Robustness, task: usize, planned_for: PlannedFor, design: usize) -> Vec<&RobustCell> {
    let wanted = |cell: &&RobustCell| (cell.task, cell.planned_for, cell.design) == (task, planned_for, design);
    let mut cells: Vec<_> = study.cells.iter().filter(wanted).collect();
    cells.sort_by_key(|cell| cell.level);
    cells
}

/// Greatest mean cost over the least from which the axis is logarithmic.
const SPREAD: f64 = 50.0;

const PLANNINGS: [PlannedFor; 2] = [PlannedFor::Nominal, PlannedFor::Truth];

fn plot(study: &Robustness, task: usize, title: String, plots: &mut Plots) -> Markup {
    let vary = &study.options.vary;
    let (mut traces, mut views) = (Vec::new(), Vec::new());
    for planned_for in PLANNINGS {
        let mut view = View { name: planning(planned_for).into(), ..Default::default() };
        let mut ends = Vec::new();
        for (index, design) in study.designs.iter().enumerate() {
            let cells = cells(study, task, planned_for, index);
            if cells.is_empty() {
                continue;
            }
            let made = of_design(index, &design.name, study, &cells, plots);
            view.traces.extend(traces.len()..traces.len() + made.len());
            traces.extend(made);
            let mean = |cell: Option<&&RobustCell>| number(cell.map_or(f64::NAN, |cell| cell.mean));
            ends.push(format!("{} from {} to {}", design.name, mean(cells.first()), mean(cells.last())));
        }
        let from_to = [vary.values.first(), vary.values.last()].map(|value| number(value.copied().unwrap_or(f64::NAN)));
        view.alternative = format!(
            "Mean cost, {}, as {} grows from {} to {}: {}.",
            view.name,
            vary.parameter,
            from_to[0],
            from_to[1],
            list(&ends)
        );
        if !view.traces.is_empty() {
            views.push(view);
        }
    }
    let scale = if vary.scale == Scale::Log { "log" } else { "linear" };
    // One design that diverges does not flatten the others.
    let means = study.cells.iter().filter(|cell| cell.task == task && cell.error.is_none()).map(|cell| cell.mean);
    let finite = means.filter(|mean| mean.is_finite());
    let (least, most) = finite.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), mean| (a.min(mean), b.max(mean)));
    let (kind, note) = match least > 0.0 && most > SPREAD * least {
        true => ("log", " The axis of the cost is logarithmic, as costs differ by orders of magnitude."),
        false => ("linear", ""),
    };
    plots.add(Plot {
        title,
        alternative: views.first().map(|view| view.alternative.clone()).unwrap_or_default(),
        caption: format!(
            "Mean cost over {} roll-outs with its 95 % confidence interval; shaded, 5 to 95 % of roll-outs; dotted, the \
             expected cost by equation (J.1) of the theory, where there is one. The task's own value is {}.{note}",
            study.options.rollouts,
            with_unit(study.nominal, &vary.unit)
        ),
        height: 420,
        traces,
        layout: json!({
            "xaxis": { "title": { "text": labelled(&vary.parameter, &vary.unit) }, "type": scale },
            "yaxis": { "title": { "text": "cost" }, "type": kind },
        }),
        choice: Some(Choice { label: "Controllers".into(), views }),
    })
}

/// The band, the mean and the theory of one design.
fn of_design(index: usize, name: &str, study: &Robustness, cells: &[&RobustCell], plots: &mut Plots) -> Vec<Value> {
    let at = |cell: &&RobustCell| study.options.vary.values.get(cell.level).copied().unwrap_or(f64::NAN);
    let x = plots.arrays.exact(&cells.iter().map(at).collect::<Vec<_>>());
    let mut exact = |of: &dyn Fn(&RobustCell) -> f64| {
        plots
            .arrays
            .exact(&cells.iter().map(|cell| if cell.error.is_some() { f64::NAN } else { of(cell) }).collect::<Vec<_>>())
    };
    let (low, high) = (exact(&|cell| cell.quantiles[0]), exact(&|cell| cell.quantiles[4]));
    let (mean, confidence) = (exact(&|cell| cell.mean), exact(&|cell| cell.half_width_95));
    let expected = exact(&|cell| cell.expected.unwrap_or(f64::NAN));
    let colour = colour(index);
    let band = |y: Value| {
        json!({
            "type": "scatter", "mode": "lines", "name": format!("{name}, 5 to 95 %"), "x": x, "y": y,
            "line": { "width": 0, "color": format!("{colour}/0.2") }, "showlegend": false, "hoverinfo": "skip",
            "legendgroup": name,
        })
    };
    let mut upper = band(high);
    upper["fill"] = "tonexty".into();
    upper["fillcolor"] = format!("{colour}/0.15").into();
    let mut traces = vec![
        band(low),
        upper,
        json!({
            "type": "scatter", "mode": "lines+markers", "name": name, "x": x, "y": mean, "legendgroup": name,
            "error_y": { "type": "data", "array": confidence, "color": colour, "width": 4 },
            "line": { "color": colour, "dash": dash(index), "width": 2 }, "marker": { "color": colour },
        }),
    ];
    if cells.iter().any(|cell| cell.expected.is_some()) {
        traces.push(json!({
            "type": "scatter", "mode": "lines", "name": format!("{name}, theory"), "x": x, "y": expected,
            "line": { "color": colour, "dash": "dot", "width": 1.5 }, "legendgroup": name,
        }));
    }
    traces
}

/// Comparisons of designs in words.
fn comparisons(study: &Robustness, task: usize) -> Markup {
    let of_task: Vec<String> = study
        .comparisons
        .iter()
        .filter(|comparison| comparison.task == task)
        .map(|found| compared(study, found))
        .collect();
    html! { @if !of_task.is_empty() { ul { @for text in of_task { li { (text) } } } } }
}

fn compared(study: &Robustness, found: &Comparison) -> String {
    let Paired { difference, interval_95, p_value } = found.growth;
    let name = |index: usize| study.designs.get(index).map_or("?", |design| design.name.as_str());
    let (design, other) = (name(found.design), name(found.other));
    let p = if p_value < 1e-3 { "below 0.001".into() } else { format!("{:.3}", p_value) };
    let numbers = format!(
        "{}, paired t test: p {}",
        supple_text::interval_95(interval_95, number),
        if p_value < 1e-3 { p } else { format!("= {p}") }
    );
    let growth = "from the least to the greatest noise";
    let how = planning(found.planned_for);
    if !difference.is_finite() || !p_value.is_finite() {
        return format!(
            "Controllers {how}: {design} and {other} cannot be compared, as roll-outs diverged or are too few."
        );
    }
    if p_value >= 0.05 {
        return format!(
            "Controllers {how}: the growth of cost does not differ significantly {growth} of {design} and {other} \
             (mean difference {}, {numbers}).",
            number(difference)
        );
    }
    let more = if difference < 0.0 { "less" } else { "more" };
    format!(
        "Controllers {how}: {growth}, the cost of {design} grows by {} {more} than the cost of {other} ({numbers}).",
        number(difference.abs())
    )
}

fn numbers(study: &Robustness, task: usize, title: &str) -> Markup {
    let vary = &study.options.vary;
    let mut head = vec![labelled(&vary.parameter, &vary.unit)];
    head.extend(words(["design", "controller", "mean", "± (95 %)", "median", "5 to 95 %", "theory"]));
    let mut rows = Vec::new();
    for cell in study.cells.iter().filter(|cell| cell.task == task) {
        let name = study.designs.get(cell.design).map_or("?", |design| design.name.as_str());
        let at = vary.values.get(cell.level).copied().unwrap_or(f64::NAN);
        let mut row = vec![number(at), name.to_owned(), planning(cell.planned_for).to_owned()];
        match &cell.error {
            _ if cell.is_missing() => row.extend(words(["not computed", "", "", "", ""])),
            Some(error) => row.extend([error.clone(), String::new(), String::new(), String::new(), String::new()]),
            None => row.extend([
                number(cell.mean),
                number(cell.half_width_95),
                number(cell.quantiles[2]),
                format!("{} to {}", number(cell.quantiles[0]), number(cell.quantiles[4])),
                cell.expected.map_or_else(String::new, number),
            ]),
        }
        rows.push(row);
    }
    let caption = format!("{title}, numbers");
    html! { details { summary { (caption) } (table(&caption, &head, &rows)) } }
}
