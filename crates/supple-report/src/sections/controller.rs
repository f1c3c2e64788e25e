//! Feedback gains and feedforward over time, and how much they change.

use maud::{Markup, html};
use serde_json::{Value, json};

use super::context::Context;
use super::series::{Run, line, runs, time, titled};
use crate::arrays::thinned;
use crate::html::{table, words};
use crate::legend::MOST_ENTRIES;
use crate::numbers::{change, number};
use crate::part::Part;
use crate::plots::{Choice, Plot, Plots, View, axis_key, panels};
use crate::words::list;

/// A plot and a table by task.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let mut pieces = Vec::new();
    for task in 0..part.about.tasks.len() {
        let runs = runs(part, task);
        if let Some(plot) = gains(part, task, &runs, context.plots) {
            pieces.push(variations(part, task, &runs));
            pieces.push(plot);
        }
    }
    if pieces.is_empty() {
        return None;
    }
    Some(html! {
        p {
            "The controller adds to its feedforward the feedback gains times the deviation of the estimate from the plan. "
            "The temporal variation measures how much a controller changes over the task: the standard deviation of its "
            "gains over time, relative to the root mean square of their size. It is 0 for constant gains and at most 1. The "
            "variance itself sums entries of different units, so use it only to compare designs for the same task."
        }
        @for piece in pieces { (piece) }
    })
}

fn variations(part: &Part, task: usize, runs: &[Run]) -> Markup {
    let head = words([
        "design",
        "variation of feedback",
        "its variance",
        "variation of feedforward",
        "its variance",
        "variance of feedback, to the first",
    ]);
    let first = runs.first().map_or(f64::NAN, |run| run.task.controller.feedback_variance);
    let row = |(index, run): (usize, &Run)| {
        let controller = &run.task.controller;
        vec![
            run.name.clone(),
            number(controller.feedback_variation),
            number(controller.feedback_variance),
            number(controller.feedforward_variation),
            number(controller.feedforward_variance),
            if index == 0 { String::new() } else { change(first, controller.feedback_variance) },
        ]
    };
    let rows: Vec<_> = runs.iter().enumerate().map(row).collect();
    table(&titled(part, "Temporal variation of the controller", task), &head, &rows)
}

/// A view by control with a line by state; one more view with the feedforward.
fn gains(part: &Part, task: usize, runs: &[Run], plots: &mut Plots) -> Option<Markup> {
    let first = runs.first()?.trajectory;
    let states = first.state_names.len();
    let order = order(runs);
    let mut traces = Vec::new();
    for (panel, run) in runs.iter().enumerate() {
        let time = time(plots, run, run.trajectory.feedback.len());
        for (place, name) in order.iter().map(|&state| &first.state_names[state]).enumerate() {
            let mut trace = line(name, &time, Value::Null, style(place));
            trace["yaxis"] = axis_key("y", panel).into();
            trace["legendgroup"] = name.as_str().into();
            trace["showlegend"] = (panel == 0).into();
            traces.push(trace);
        }
        let mut forward = line("feedforward", &time, Value::Null, json!({ "color": "@2", "width": 2, "shape": "hv" }));
        forward["yaxis"] = axis_key("y", panel).into();
        forward["showlegend"] = (panel == 0).into();
        forward["legendgroup"] = "feedforward".into();
        traces.push(forward);
    }
    let mut views = Vec::new();
    for (control, name) in first.control_names.iter().enumerate() {
        let unit = first.control_units.get(control).map_or("", String::as_str);
        views.push(feedback_view(runs, control, name, unit, &order, plots));
        views.push(forward_view(runs, control, name, unit, plots));
    }
    debug_assert_eq!(traces.len(), runs.len() * (states + 1));
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    Some(
        plots.add(Plot {
            title: titled(part, "Feedback and feedforward", task),
            alternative: views.first().map(|view| view.alternative.clone())?,
            caption:
                "Each line is the gain from one state to the chosen control; its unit is that of the control over that \
                  of the state. Select entries in the legend to hide or show them."
                    .into(),
            height: 160 + 200 * names.len(),
            traces,
            layout: panels(&names, "time, s", ""),
            choice: Some(Choice { label: "Shown".into(), views }),
        }),
    )
}

/// States in the order of the lines: of more than a legend names, those first whose gains go farthest beside the
/// greatest gain to the same control.
fn order(runs: &[Run]) -> Vec<usize> {
    let states = runs.first().map_or(0, |run| run.trajectory.state_names.len());
    let mut order: Vec<usize> = (0..states).collect();
    if states <= MOST_ENTRIES {
        return order;
    }
    let mut shares = vec![0.0_f64; states];
    for run in runs {
        let controls = run.trajectory.control_names.len();
        for control in 0..controls {
            let gains = || run.trajectory.feedback.iter().filter_map(|gains| gains.get(control));
            let peak = |state: usize| {
                let of = gains().filter_map(|row| row.get(state)).filter(|gain| gain.is_finite());
                of.fold(0.0, |peak: f64, gain| peak.max(gain.abs()))
            };
            let peaks: Vec<f64> = (0..states).map(peak).collect();
            let most = peaks.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            shares.iter_mut().zip(&peaks).for_each(|(share, peak)| *share = share.max(peak / most));
        }
    }
    order.sort_by(|&a, &b| shares[b].total_cmp(&shares[a]));
    order
}

/// Colour and dashes of a state: 28 different ones.
fn style(state: usize) -> Value {
    let dash = ["solid", "dash", "dot", "dashdot"][state / 7 % 4];
    json!({ "color": crate::plots::colour(state), "dash": dash, "width": 1.5 })
}

fn feedback_view(runs: &[Run], control: usize, name: &str, unit: &str, order: &[usize], plots: &mut Plots) -> View {
    let mut view = View { name: format!("Feedback to {name}"), ..Default::default() };
    let mut sizes = Vec::new();
    for (panel, run) in runs.iter().enumerate() {
        let gains = &run.trajectory.feedback;
        let (states, drawn) = (run.trajectory.state_names.len(), thinned(gains.len()));
        let entry =
            |t: usize, state: usize| gains[t].get(control).and_then(|row| row.get(state)).copied().unwrap_or(f64::NAN);
        let (mut most, mut at) = (f64::NAN, 0);
        for (place, &state) in order.iter().enumerate() {
            let values: Vec<f64> = drawn.iter().map(|&t| entry(t, state)).collect();
            for value in &values {
                if most.is_nan() || value.abs() > most {
                    (most, at) = (value.abs(), state);
                }
            }
            view.traces.push(panel * (states + 1) + place);
            view.y.push(plots.arrays.curve(&values));
        }
        let state = run.trajectory.state_names.get(at).map_or("", String::as_str);
        sizes.push(format!("{} at {} (on {state})", number(most), run.name));
        titles(&mut view, panel, "gain");
    }
    let unit = if unit.is_empty() { String::new() } else { format!(" ({})", crate::numbers::unit(unit)) };
    view.alternative = format!("Feedback gains to {name}{unit} over time; the greatest magnitude: {}.", list(&sizes));
    view
}

fn forward_view(runs: &[Run], control: usize, name: &str, unit: &str, plots: &mut Plots) -> View {
    let mut view = View { name: format!("Feedforward of {name}"), ..Default::default() };
    let mut sizes = Vec::new();
    for (panel, run) in runs.iter().enumerate() {
        let states = run.trajectory.state_names.len();
        view.traces.push(panel * (states + 1) + states);
        view.y.push(super::series::column(plots, &run.trajectory.controls, control));
        let of = |row: &Vec<f64>| row.get(control).copied().unwrap_or(0.0).abs();
        let most = run.trajectory.controls.iter().map(of).fold(0.0, f64::max);
        sizes.push(format!("{} at {}", number(most), run.name));
        titles(&mut view, panel, &crate::numbers::labelled(name, unit));
    }
    view.alternative = format!("Feedforward of {name} over time; the largest in magnitude: {}.", list(&sizes));
    view
}

fn titles(view: &mut View, panel: usize, text: &str) {
    view.layout.insert(format!("{}.title.text", axis_key("yaxis", panel)), text.into());
}
