//! How searches went: what they visited, and where each start ended.

use maud::{Markup, html};
use serde_json::{Value, json};
use supple::design::DesignStatus;
use supple_study::design::{DesignReport, StartReport};
use supple_study::trace::{Trace, TraceRun};

use super::context::Context;
use crate::html::{table, words};
use crate::numbers::{bits, number};
use crate::part::Part;
use crate::plots::{Choice, Plot, Plots, View, colour, dash};
use crate::words::{count, ended, list, method};

/// A plot for each folder of traces, a table for each search.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let traces = part.traces();
    let searches = part.searches();
    if traces.is_empty() && searches.is_empty() {
        return None;
    }
    let plots: Vec<Markup> = traces.iter().map(|(name, trace)| plot(part, name, trace, context.plots)).collect();
    Some(html! {
        @for (plot, (name, trace)) in plots.iter().zip(&traces) {
            (plot)
            (runs(part, name, trace))
        }
        @for (folder, report) in &searches {
            (starts(part, folder, report))
        }
    })
}

/// Colour by optimiser and gradient.
pub fn kind(run: &TraceRun) -> usize {
    run.method.number(run.gradient)
}

/// The name of the folder, where several ones could be meant.
fn in_folder(what: &str, folder: &str, several: bool) -> String {
    if several { format!("{what}, {folder}") } else { what.to_owned() }
}

fn plot(part: &Part, folder: &str, trace: &Trace, plots: &mut Plots) -> Markup {
    let mut traces = Vec::new();
    let mut seen = Vec::new();
    for run in &trace.runs {
        let kind = kind(run);
        let name = method(run.method, run.gradient);
        let x: Vec<f64> = run.steps.iter().map(|&step| step as f64 + 1.0).chain([run.path.len() as f64]).collect();
        traces.push(json!({
            "type": "scatter", "mode": "lines", "name": name, "legendgroup": name, "showlegend": !seen.contains(&kind),
            "x": plots.arrays.curve(&x), "y": Value::Null, "text": format!("{name}, start {}", run.start + 1),
            "hoverinfo": "x+y+text", "line": { "color": colour(kind), "dash": dash(kind), "width": 1.5 },
        }));
        seen.push(kind);
    }
    let best = trace.runs.iter().map(|run| bits(run.end.information_nats)).fold(f64::INFINITY, f64::min);
    let all: Vec<usize> = (0..traces.len()).collect();
    let mut view = |name: String, vertical: &str, values: &dyn Fn(&TraceRun) -> Vec<f64>| {
        let y = trace.runs.iter().map(|run| plots.arrays.curve(&values(run))).collect();
        let mut view = View { name, traces: all.clone(), y, ..Default::default() };
        view.layout.insert("yaxis.title.text".into(), vertical.into());
        view.alternative = format!(
            "{} over the designs visited by {}; the least information at an end is {} bits.",
            view.name,
            count(trace.runs.len(), "run"),
            number(best)
        );
        view
    };
    let information = |run: &TraceRun| run.stepped().map(|point| bits(point.information_nats)).collect();
    let mut views = vec![view("Information".into(), "bits", &information)];
    for (task, about) in part.about.tasks.iter().enumerate() {
        let cost =
            |run: &TraceRun| run.stepped().map(|point| point.costs.get(task).copied().unwrap_or(f64::NAN)).collect();
        views.push(view(format!("Expected cost of {}", about.name), "cost", &cost));
    }
    plots.add(Plot {
        title: in_folder("Paths of searches", folder, part.traces().len() > 1),
        alternative: views[0].alternative.clone(),
        caption:
            "One line per start, coloured by optimiser and gradient, through the accepted designs and the best one; line-search trials count as visited designs."
                .into(),
        height: 400,
        traces,
        layout: json!({
            "xaxis": { "title": { "text": "designs visited" } }, "yaxis": { "title": { "text": "bits" } },
            "hovermode": "closest",
        }),
        choice: Some(Choice { label: "Shown".into(), views }),
    })
}

/// Where the searches of a folder of traces ended, by optimiser and gradient.
fn runs(part: &Part, folder: &str, trace: &Trace) -> Markup {
    let head = words(["search", "converged", "least information, bits", "greatest, bits", "designs visited, mean"]);
    let mut rows = Vec::new();
    for method_ in &trace.options.methods {
        for gradient in &trace.options.gradients {
            let runs: Vec<&TraceRun> =
                trace.runs.iter().filter(|run| run.method == *method_ && run.gradient == *gradient).collect();
            let converged = runs.iter().filter(|run| run.status == DesignStatus::Converged);
            let ends = || runs.iter().map(|run| bits(run.end.information_nats)).filter(|bits| bits.is_finite());
            let visited = runs.iter().map(|run| run.path.len()).sum::<usize>() as f64 / runs.len() as f64;
            rows.push(vec![
                method(*method_, *gradient),
                format!("{} of {}", converged.count(), runs.len()),
                number(ends().fold(f64::INFINITY, f64::min)),
                number(ends().fold(f64::NEG_INFINITY, f64::max)),
                number(visited),
            ]);
        }
    }
    table(&in_folder("Ends of searches", folder, part.traces().len() > 1), &head, &rows)
}

/// Every start of a search.
fn starts(part: &Part, folder: &str, report: &DesignReport) -> Markup {
    let mut head = words(["start", "ended", "from", "to", "information, bits"]);
    head.extend(part.about.tasks.iter().map(|task| format!("cost of {}", task.name)));
    head.extend(words(["above its bound", "optimality", "designs"]));
    let row = |(index, start): (usize, &StartReport)| {
        let mut row = vec![(index + 1).to_string(), ended(start.status).to_owned()];
        row.extend([&start.from, &start.to].map(|at| part.describe(at).join(", ")));
        row.push(number(bits(start.information_nats)));
        let costs = (0..part.about.tasks.len()).map(|task| start.expected_costs.get(task).copied().unwrap_or(f64::NAN));
        row.extend(costs.map(number));
        let over = if start.violation > report.settings.feasibility {
            format!("{} %", number(100.0 * start.violation))
        } else {
            "no".into()
        };
        row.push(if start.violation.is_nan() { number(f64::NAN) } else { over });
        row.push(number(start.optimality));
        row.push(start.evaluations.to_string());
        row
    };
    let rows: Vec<_> = report.starts.iter().enumerate().map(row).collect();
    let seeds = list(&[count(report.evaluations, "design"), format!("{} s", number(report.seconds))]);
    html! {
        (table(&in_folder("Starts of the search", folder, part.searches().len() > 1), &head, &rows))
        p.note {
            "Method: " (method(report.method, report.gradient)) "; " (seeds) " in all. Optimality is the greatest remaining "
            "slope of the Lagrangian, relative to the slope of the information; a cost above its bound is given relative "
            "to the bound." (without_contact(report.evaluations_without_contact))
        }
    }
}

/// How many designs of a search never touch a contact from which a cost wants a force.
fn without_contact(designs: usize) -> String {
    match designs {
        0 => String::new(),
        1 => " 1 of these designs never makes a contact whose force a cost tracks.".into(),
        _ => format!(" {designs} of these designs never make a contact whose force a cost tracks."),
    }
}
