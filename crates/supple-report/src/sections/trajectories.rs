//! States and controls over time: the plan, and one run in closed loop with what its filter believes.

use std::borrow::Cow;

use maud::{Markup, html};
use serde_json::{Value, json};

use super::context::Context;
use super::series::{Run, column, line, runs, time, titled, upright};
use crate::numbers::{labelled, number};
use crate::part::Part;
use crate::plots::{Choice, Plot, Plots, View, axis_key, panels};
use crate::words::list;

/// One plot by task.
pub fn section(context: &mut Context) -> Option<Markup> {
    let about = html! {
        "Each design has a panel. The plan is what the controller follows; the run is one in closed loop with random "
        "noise: the true state, the estimate of the Kalman filter, and the band of two standard deviations that the "
        "filter assigns to its estimate. Where roll-outs were made, the true states of some more runs are thin lines. "
        "With several designs, all runs draw the noise from the same seed."
    };
    context.by_task(&about, plot)
}

/// Traces of a panel that show states: band below and above, plan, estimate, truth; then those of controls: plan, run; then
/// other runs as threads.
const STATES: [usize; 6] = [THREADS, 0, 1, 2, 3, 4];
const CONTROLS: [usize; 2] = [5, 6];
const THREADS: usize = 7;
const ALL: usize = 8;
/// Points of a thread.
const MOST_POINTS: usize = 101;

fn plot(part: &Part, task: usize, plots: &mut Plots) -> Option<Markup> {
    let runs = runs(part, task);
    let first = runs.first()?.trajectory;
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    let mut traces = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        traces.extend(panel(index, run, plots));
    }
    let mut views = Vec::new();
    for (index, (name, unit)) in first.state_names.iter().zip(&first.state_units).enumerate() {
        views.push(state_view(&runs, index, &labelled(name, unit), plots));
    }
    for (index, (name, unit)) in first.control_names.iter().zip(&first.control_units).enumerate() {
        views.push(control_view(&runs, index, &labelled(name, unit), plots));
    }
    let alternative = views.first().map(|view| view.alternative.clone())?;
    Some(plots.add(Plot {
        title: titled(part, "Plan, true state and estimate", task),
        alternative,
        caption: "Choose the state or control above. Controls are constant over each step.".into(),
        height: 120 + 200 * names.len(),
        traces,
        layout: panels(&names, "time, s", ""),
        choice: Some(Choice { label: "State or control".into(), views }),
    }))
}

/// The traces of one design, without their `y`.
fn panel(index: usize, run: &Run, plots: &mut Plots) -> Vec<Value> {
    let states = time(plots, run, run.trajectory.states.len());
    let controls = time(plots, run, run.trajectory.controls.len());
    let held = |mut line: Value| {
        line["shape"] = "hv".into();
        line
    };
    let (plan, truth) =
        (json!({ "color": "@2", "dash": "dash", "width": 2 }), json!({ "color": "@ink", "width": 1.5 }));
    let estimate = json!({ "color": "@1", "dash": "dot", "width": 2 });
    let none = json!({ "width": 0, "color": "@1/0.2" });
    let mut traces = vec![
        line("", &states, Value::Null, none.clone()),
        line("estimate ± 2 σ", &states, Value::Null, none),
        line("plan", &states, Value::Null, plan.clone()),
        line("estimate", &states, Value::Null, estimate),
        line("true state", &states, Value::Null, truth.clone()),
        line("plan", &controls, Value::Null, held(plan)),
        line("run", &controls, Value::Null, held(truth)),
    ];
    let (times, _) = threads(run, 0);
    let mut others =
        line("other runs", &plots.arrays.curve(&times), Value::Null, json!({ "color": "@ink/0.25", "width": 1 }));
    others["hoverinfo"] = "skip".into();
    traces.push(others);
    traces[0]["hoverinfo"] = "skip".into();
    traces[1]["hoverinfo"] = "skip".into();
    traces[1]["fill"] = "tonexty".into();
    traces[1]["fillcolor"] = "@1/0.2".into();
    for (place, trace) in traces.iter_mut().enumerate() {
        trace["yaxis"] = axis_key("y", index).into();
        trace["legendgroup"] = trace["name"].clone();
        trace["showlegend"] = (index == 0 && place > 0 && (place != THREADS || !times.is_empty())).into();
    }
    traces
}

fn state_view(runs: &[Run], state: usize, label: &str, plots: &mut Plots) -> View {
    let (mut y, mut ends) = (Vec::new(), Vec::new());
    let (mut plans, mut samples) = (Vec::new(), Vec::new());
    for run in runs {
        let sample = &run.trajectory.sample;
        let of = |rows: &[Vec<f64>]| rows.iter().filter_map(|row| row.get(state).copied()).collect::<Vec<f64>>();
        let (middle, spread) = (of(&sample.estimates), of(&sample.deviations));
        plans.extend(of(&run.trajectory.states));
        samples.extend(of(&sample.states));
        for sign in [-2.0, 2.0] {
            samples.extend(middle.iter().zip(&spread).map(|(middle, deviation)| middle + sign * deviation));
        }
        let times = run.trajectory.states.len();
        let plan = column(plots, &run.trajectory.states, state);
        let estimate = column(plots, &whole(&sample.estimates, times), state);
        let deviation = column(plots, &whole(&sample.deviations, times), state);
        let band = |times: f64| json!({ "a": estimate["a"], "add": deviation["a"], "times": times });
        let others = threads(run, state).1;
        samples.extend(&others);
        let others = plots.arrays.curve(&others);
        let truth = column(plots, &whole(&sample.states, times), state);
        y.extend([others, band(-2.0), band(2.0), plan, estimate.clone(), truth]);
        let end = |rows: &[Vec<f64>]| number(rows.last().and_then(|row| row.get(state)).copied().unwrap_or(f64::NAN));
        let deviation = end(&sample.deviations);
        ends.push(format!(
            "{} ends at {} in the plan, at {} in the run, estimated to ± {deviation}",
            run.name,
            end(&run.trajectory.states),
            end(&sample.states)
        ));
    }
    View {
        name: label.to_owned(),
        traces: chosen(runs, &STATES),
        y,
        layout: upright(runs.len(), label, &plans, &samples),
        alternative: format!("{label} over time: {}.", list(&ends)),
    }
}

fn control_view(runs: &[Run], control: usize, label: &str, plots: &mut Plots) -> View {
    let (mut y, mut sizes) = (Vec::new(), Vec::new());
    let (mut plans, mut samples) = (Vec::new(), Vec::new());
    for run in runs {
        y.push(column(plots, &run.trajectory.controls, control));
        let steps = run.trajectory.controls.len();
        y.push(column(plots, &whole(&run.trajectory.sample.controls, steps), control));
        let all = |rows: &[Vec<f64>]| rows.iter().filter_map(|row| row.get(control).copied()).collect::<Vec<f64>>();
        plans.extend(all(&run.trajectory.controls));
        samples.extend(all(&run.trajectory.sample.controls));
        let of = |row: &Vec<f64>| row.get(control).copied().unwrap_or(0.0).abs();
        let most = |rows: &[Vec<f64>]| number(rows.iter().map(of).fold(0.0, f64::max));
        let (plan, sample) = (most(&run.trajectory.controls), most(&run.trajectory.sample.controls));
        sizes.push(format!("{} reaches {plan} in the plan, {sample} in the run", run.name));
    }
    View {
        name: label.to_owned(),
        traces: chosen(runs, &CONTROLS),
        y,
        layout: upright(runs.len(), label, &plans, &samples),
        alternative: format!("{label} over time, in size: {}.", list(&sizes)),
    }
}

/// Rows of a run, with rows of nothing where it diverged and ended early.
fn whole(rows: &[Vec<f64>], count: usize) -> Cow<'_, [Vec<f64>]> {
    if rows.len() >= count {
        return Cow::Borrowed(rows);
    }
    let mut whole = rows.to_vec();
    whole.resize(count, Vec::new());
    Cow::Owned(whole)
}

/// Some traces of every panel.
fn chosen(runs: &[Run], of: &[usize]) -> Vec<usize> {
    (0..runs.len()).flat_map(|panel| of.iter().map(move |trace| panel * ALL + trace)).collect()
}

/// Times of a state in all further runs, one after the other with gaps between, and its values there.
fn threads(run: &Run, state: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for thread in &run.trajectory.threads {
        let count = thread.len();
        let shown = count.min(MOST_POINTS);
        for point in 0..shown {
            let step = if shown > 1 { point * (count - 1) / (shown - 1) } else { 0 };
            times.push(run.trajectory.time.get(step).copied().unwrap_or(f64::NAN));
            values.push(thread[step].get(state).copied().unwrap_or(f64::NAN));
        }
        times.push(f64::NAN);
        values.push(f64::NAN);
    }
    (times, values)
}
