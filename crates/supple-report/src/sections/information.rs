//! What measurements give over time, and what knowing is worth.

use maud::{Markup, html};
use serde_json::Value;
use supple::MeasurementReport;

use super::context::Context;
use super::series::{Run, curve, line, runs, sum, sums, time, titled};
use crate::html::{table, words};
use crate::numbers::{bits, number};
use crate::part::Part;
use crate::plots::{self, Choice, Plot, Plots, View, panels};
use crate::words::list;

/// Three plots and a table by task.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let mut pieces = Vec::new();
    for task in 0..part.about.tasks.len() {
        let runs = runs(part, task);
        if runs.is_empty() {
            continue;
        }
        pieces.push(total(part, task, &runs, context.plots));
        pieces.extend(sensors(part, task, &runs, context.plots));
        pieces.push(value(part, task, &runs, context.plots));
        pieces.push(sensor_table(part, task, &runs));
    }
    if pieces.is_empty() {
        return None;
    }
    Some(html! {
        p {
            "Directed information is the sum of the information in each measurement. Alone: what a sensor would give "
            "if the others were not read at that step. Additional: the increase when it is added to the others. Information that "
            "sensors share counts for each sensor alone, and for none beyond the others."
        }
        @for piece in pieces { (piece) }
    })
}

/// A trace by design, without its `y`, over the times of `count` points.
fn lines(runs: &[Run], count: impl Fn(&Run) -> usize, plots: &mut Plots) -> Vec<Value> {
    let of = |(index, run): (usize, &Run)| {
        let time = time(plots, run, count(run));
        line(&run.name, &time, Value::Null, plots::line(index))
    };
    runs.iter().enumerate().map(of).collect()
}

/// A view with one curve by design.
fn view(name: &str, vertical: &str, runs: &[Run], values: impl Fn(&Run) -> Vec<f64>, plots: &mut Plots) -> View {
    let mut view = View { name: name.to_owned(), ..Default::default() };
    let mut sums = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let values = values(run);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        sums.push(format!("at most {} for {}", number(most), run.name));
        view.traces.push(index);
        view.y.push(curve(plots, &values));
    }
    view.layout.insert("yaxis.title.text".into(), vertical.into());
    view.alternative = format!("{name}, {vertical}, over time: {}.", list(&sums));
    view
}

fn plot(title: String, caption: &str, label: &str, traces: Vec<Value>, views: Vec<View>) -> Plot {
    Plot {
        title,
        alternative: views.first().map(|view| view.alternative.clone()).unwrap_or_default(),
        caption: caption.to_owned(),
        height: 360,
        traces,
        layout: panels(&[String::new()], "time, s", ""),
        choice: Some(Choice { label: label.to_owned(), views }),
    }
}

fn total(part: &Part, task: usize, runs: &[Run], plots: &mut Plots) -> Markup {
    let traces = lines(runs, |run| run.task.information.per_step_nats.len(), plots);
    let each = |run: &Run| run.task.information.per_step_nats.iter().map(|&nats| bits(nats)).collect::<Vec<_>>();
    let views = vec![
        view("At each measurement", "bits", runs, each, plots),
        view("Cumulative", "bits", runs, |run| sums(&each(run)), plots),
    ];
    let caption = "All sensors together: the terms of equation (I.1) of the theory, and their sum. The last value of the sum \
                   is the directed information of the task.";
    plots.add(plot(titled(part, "Information of measurements", task), caption, "Shown", traces, views))
}

/// The measurements of every run with this name, in the order of the runs; empty series where it has none.
fn measurement<'a>(run: &'a Run, name: &str) -> Option<&'a MeasurementReport> {
    run.trajectory.measurements.iter().find(|measurement| measurement.name == name)
}

fn sensors(part: &Part, task: usize, runs: &[Run], plots: &mut Plots) -> Option<Markup> {
    let first = runs.first()?;
    let count = |run: &Run| run.task.information.per_step_nats.len();
    let mut traces = lines(runs, count, plots);
    traces.extend(lines(runs, count, plots));
    for (index, trace) in traces.iter_mut().enumerate() {
        let (what, width) = if index < runs.len() { ("beyond the others", 2.5) } else { ("alone", 1.0) };
        trace["name"] = format!("{}, {what}", trace["name"].as_str().unwrap_or_default()).into();
        trace["line"]["width"] = width.into();
    }
    let mut views = Vec::new();
    for sensor in &first.trajectory.measurements {
        let of = |run: &Run, pick: fn(&MeasurementReport) -> &[f64]| {
            let nats = measurement(run, &sensor.name).map_or(&[][..], pick);
            nats.iter().map(|&nats| bits(nats)).collect::<Vec<_>>()
        };
        let beyond = |run: &Run| of(run, |measurement| &measurement.beyond_others_nats);
        let alone = |run: &Run| of(run, |measurement| &measurement.alone_nats);
        let mut both = view(&sensor.name, "bits per measurement", runs, beyond, plots);
        let second = view(&sensor.name, "", runs, alone, plots);
        both.traces.extend(second.traces.iter().map(|index| index + runs.len()));
        both.y.extend(second.y);
        views.push(both);
    }
    if views.is_empty() {
        return None;
    }
    let caption =
        "Thick: what the sensor adds to the others (I.10). Thin: what it would give alone at that step (I.9).";
    Some(plots.add(plot(titled(part, "Information of single sensors", task), caption, "Sensor", traces, views)))
}

fn value(part: &Part, task: usize, runs: &[Run], plots: &mut Plots) -> Markup {
    let traces = lines(runs, |run| run.task.cost.belief_per_step.len(), plots);
    let mut views = vec![
        view("Cost of estimation error", "cost per step", runs, |run| run.task.cost.belief_per_step.clone(), plots),
        view(
            "Value of information",
            "cost per variance",
            runs,
            |run| run.task.cost.value_of_information_per_step.clone(),
            plots,
        ),
    ];
    let sensors = runs.first().map_or(&[][..], |run| &run.trajectory.measurements);
    for sensor in sensors.iter().filter(|sensor| !sensor.saved_cost.is_empty()) {
        let saved = |run: &Run| measurement(run, &sensor.name).map_or_else(Vec::new, |found| found.saved_cost.clone());
        views.push(view(&format!("Saved by {}", sensor.name), "cost per step", runs, saved, plots));
    }
    let caption = "Cost of estimation error: the expected cost of each step due to the covariance of the estimate, half \
                   the trace of the value of information times the covariance (J.1). Value of information: its trace, over \
                   states of different units. Saved by a sensor: how much its measurement at that step reduces that cost \
                   beyond the others (I.11).";
    plots.add(plot(titled(part, "The value of information", task), caption, "Shown", traces, views))
}

fn sensor_table(part: &Part, task: usize, runs: &[Run]) -> Markup {
    let mut head = words(["sensor"]);
    for run in runs {
        head.push(format!("{}: alone, bits", run.name));
        head.push("beyond the others, bits".into());
        head.push("saved cost".into());
    }
    let sensors = runs.first().map_or(&[][..], |run| &run.trajectory.measurements);
    let row = |sensor: &MeasurementReport| {
        let mut row = vec![sensor.name.clone()];
        for run in runs {
            let found = measurement(run, &sensor.name);
            let total = |pick: fn(&MeasurementReport) -> &[f64]| found.map_or(f64::NAN, |found| sum(pick(found)));
            row.push(number(bits(total(|found| &found.alone_nats))));
            row.push(number(bits(total(|found| &found.beyond_others_nats))));
            row.push(number(total(|found| &found.saved_cost)));
        }
        row
    };
    let rows: Vec<_> = sensors.iter().map(row).collect();
    if rows.is_empty() {
        return html! {};
    }
    table(&titled(part, "Sensors, summed over the task", task), &head, &rows)
}
