//! What an engineer looks at first, over time: forces and clearances of contacts, forces in couplings, places of tips,
//! and the terms of the cost; times of contact are shaded.

use maud::{Markup, html};
use serde_json::{Map, Value, json};
use supple::TrajectoryReport;
use supple::scene::{ConnectionKind, Scene};

use super::context::Context;
use super::series::{Run, curve, line, runs, time, titled, upright};
use crate::numbers::{labelled, number};
use crate::part::Part;
use crate::plots::{Choice, Plot, Plots, View, axis_key, panels};
use crate::words::list;

/// Terms of a cost that have lines of their own, the largest ones; all others share one.
const MOST_TERMS: usize = 6;

/// Traces of a panel: plan and run over states; a quantity of pictures with a band; terms of the cost; levels.
const PLAN: usize = 0;
const RUN: usize = 1;
const PICTURE: usize = 2;
const BAND: [usize; 2] = [3, 4];
const TERMS: usize = 5;
/// A target, a lower and an upper limit.
const LEVELS: [usize; 3] = [TERMS + MOST_TERMS + 1, TERMS + MOST_TERMS + 2, TERMS + MOST_TERMS + 3];
const ALL: usize = TERMS + MOST_TERMS + 4;

/// One plot by task.
pub fn section(context: &mut Context) -> Option<Markup> {
    let about = html! {
        "Each design has a panel. Times at which a contact of the plan touches are shaded. Forces, clearances, and the "
        "quantities in costs and limits are shown for the plan and one closed-loop run, with "
        "their targets and limits as dashed lines; positions have a band of two standard deviations; terms of the "
        "cost are those of the plan."
    };
    context.by_task(&about, plot)
}

fn plot(part: &Part, task: usize, plots: &mut Plots) -> Option<Markup> {
    let runs = runs(part, task);
    let mut views: Vec<View> = Vec::new();
    let first = runs.first()?.trajectory;
    for (index, contact) in first.contacts.iter().enumerate() {
        let of = |name: &str, unit: &str| labelled(&format!("{name} of {}", contact.name), unit);
        let at = |run: &Run| run.trajectory.contacts.get(index).cloned().unwrap_or_default();
        let force = |run: &Run| Lines::of(at(run).force, at(run).run_force);
        let clearance = |run: &Run| Lines::of(at(run).clearance_m, at(run).run_clearance_m);
        views.push(of_lines(&runs, &of("normal force", "N"), force, plots));
        views.push(of_lines(&runs, &of("clearance", "m"), clearance, plots));
    }
    for (index, quantity) in first.quantities.iter().enumerate() {
        let of_run = |run: &Run| {
            let at = run.trajectory.quantities.get(index).cloned().unwrap_or_default();
            Lines { plan: at.values, run: at.run_values, levels: [at.target, at.lower, at.upper] }
        };
        let label = labelled(&format!("{} ({})", quantity.name, quantity.of), &quantity.unit);
        views.push(of_lines(&runs, &label, of_run, plots));
    }
    views.extend(of_pictures(&runs, plots));
    if !first.costs.is_empty() {
        views.push(of_costs(&runs, plots));
    }
    let alternative = views.first().map(|view| view.alternative.clone())?;
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    let traces = runs.iter().enumerate().flat_map(|(index, run)| panel(index, run, &runs, plots)).collect();
    let mut layout = panels(&names, "time, s", "");
    layout["shapes"] = runs.iter().enumerate().flat_map(|(index, run)| shades(index, run.trajectory)).collect();
    Some(plots.add(Plot {
        title: titled(part, "Forces, clearances, points and cost", task),
        alternative,
        caption: "Choose the quantity above. Runs far outside the range of the plan are clipped; the axis then indicates this; \
                  the cost has a logarithmic axis."
            .into(),
        height: 120 + 200 * names.len(),
        traces,
        layout,
        choice: Some(Choice { label: "Quantity".into(), views }),
    }))
}

/// The traces of one design, without their `y`.
fn panel(index: usize, run: &Run, runs: &[Run], plots: &mut Plots) -> Vec<Value> {
    let states = time(plots, run, run.trajectory.states.len());
    let frames: Vec<f64> = scene(run).map_or_else(Vec::new, |scene| scene.time.0.iter().map(|row| row[0]).collect());
    let frames = plots.arrays.curve(&frames);
    let none = json!({ "width": 0, "color": "@1/0.2" });
    let mut traces = vec![
        line("plan", &states, Value::Null, json!({ "color": "@2", "dash": "dash", "width": 2 })),
        line("run", &states, Value::Null, json!({ "color": "@ink", "width": 1.5 })),
        line("plan", &frames, Value::Null, json!({ "color": "@2", "width": 2 })),
        line("", &frames, Value::Null, none.clone()),
        line("plan ± 2 σ", &frames, Value::Null, none),
    ];
    for place in BAND {
        traces[place]["hoverinfo"] = "skip".into();
    }
    traces[BAND[1]]["fill"] = "tonexty".into();
    traces[BAND[1]]["fillcolor"] = "@1/0.2".into();
    let mut names = terms(runs);
    names.resize(MOST_TERMS, String::new());
    for (place, name) in names.iter().chain([&"others".to_owned()]).enumerate() {
        traces.push(line(name, &states, Value::Null, crate::plots::line(place)));
    }
    let ends = plots
        .arrays
        .exact(&[run.trajectory.time.first(), run.trajectory.time.last()].map(|time| time.copied().unwrap_or(0.0)));
    for (name, color) in [("target", "@3"), ("lower limit", "@4"), ("upper limit", "@4")] {
        traces.push(line(name, &ends, Value::Null, json!({ "color": color, "dash": "longdash", "width": 1.5 })));
    }
    for (place, trace) in traces.iter_mut().enumerate() {
        trace["yaxis"] = axis_key("y", index).into();
        trace["legendgroup"] = trace["name"].clone();
        trace["showlegend"] = (index == 0 && place != BAND[0]).into();
    }
    traces
}

/// Rectangles behind the curves where contacts of the plan touch.
fn shades(index: usize, trajectory: &TrajectoryReport) -> Vec<Value> {
    let mut shapes = Vec::new();
    for contact in &trajectory.contacts {
        let mut from = None;
        for (step, touches) in contact.touches.iter().chain([&false]).enumerate() {
            match (from, touches) {
                (None, true) => from = Some(step),
                (Some(first), false) => {
                    let at = |step: usize| trajectory.time.get(step.min(trajectory.time.len() - 1)).copied();
                    shapes.push(json!({
                        "type": "rect", "layer": "below", "xref": "x", "yref": format!("{} domain", axis_key("y", index)),
                        "x0": at(first), "x1": at(step), "y0": 0, "y1": 1, "line": { "width": 0 }, "fillcolor": "@ink/0.07",
                    }));
                    from = None;
                }
                _ => {}
            }
        }
    }
    shapes
}

/// A number over time, along the plan and along the run, with its target, lower and upper limit where it has these.
#[derive(Default)]
struct Lines {
    plan: Vec<f64>,
    run: Vec<f64>,
    levels: [Option<f64>; 3],
}

impl Lines {
    fn of(plan: Vec<f64>, run: Vec<f64>) -> Self {
        Self { plan, run, levels: [None; 3] }
    }
}

fn of_lines(runs: &[Run], label: &str, of: impl Fn(&Run) -> Lines, plots: &mut Plots) -> View {
    let (mut y, mut most, mut traces) = (Vec::new(), Vec::new(), Vec::new());
    let mut ranges = [Vec::new(), Vec::new()];
    for (panel, run) in runs.iter().enumerate() {
        let Lines { mut plan, run: sample, levels } = of(run);
        most.push(format!(
            "{} reaches {} in the plan",
            run.name,
            number(plan.iter().copied().fold(f64::NAN, f64::max))
        ));
        let mut whole = sample.clone();
        for values in [&mut plan, &mut whole] {
            values.resize(run.trajectory.states.len(), f64::NAN);
        }
        y.extend([curve(plots, &plan), curve(plots, &whole)]);
        traces.extend([PLAN, RUN].map(|trace| panel * ALL + trace));
        for (level, place) in levels.into_iter().zip(LEVELS) {
            if let Some(level) = level {
                y.push(plots.arrays.exact(&[level, level]));
                traces.push(panel * ALL + place);
                plan.push(level);
            }
        }
        ranges[0].extend(plan);
        ranges[1].extend(sample);
    }
    let layout = upright(runs.len(), label, &ranges[0], &ranges[1]);
    View { name: label.to_owned(), traces, y, layout, alternative: format!("{label} over time: {}.", list(&most)) }
}

fn scene<'a>(run: &'a Run) -> Option<&'a Scene> {
    run.trajectory.scene.as_ref()
}

/// A quantity of the pictures of a run: its values, and its deviations where they are known.
type Pictured = (Vec<f64>, Option<Vec<f64>>);

/// Forces in couplings, and places of points.
fn of_pictures(runs: &[Run], plots: &mut Plots) -> Vec<View> {
    let Some(first) = runs.first().and_then(scene) else { return Vec::new() };
    let norm = |row: &[f64; 3]| row.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
    let mut views = Vec::new();
    for (index, connection) in first.connections.iter().enumerate() {
        if matches!(connection.kind, ConnectionKind::Contact) {
            continue;
        }
        let force = |scene: &Scene| -> Option<Pictured> {
            Some((scene.connections.get(index)?.force.0.iter().map(norm).collect(), None))
        };
        let torque = |scene: &Scene| -> Option<Pictured> {
            Some((scene.connections.get(index)?.torque.0.iter().map(norm).collect(), None))
        };
        let acts = |rows: &[[f64; 3]]| rows.iter().any(|row| norm(row) > 0.0);
        if acts(&connection.force.0) {
            views.push(of_picture(
                runs,
                &labelled(&format!("size of the force of {}", connection.name), "N"),
                force,
                plots,
            ));
        }
        if acts(&connection.torque.0) {
            views.push(of_picture(
                runs,
                &labelled(&format!("size of the torque of {}", connection.name), "N m"),
                torque,
                plots,
            ));
        }
    }
    for (index, point) in first.beliefs.iter().enumerate() {
        for (axis, (name, place)) in [("x", 0), ("y", 3), ("z", 5)].into_iter().enumerate() {
            let of = move |scene: &Scene| -> Option<Pictured> {
                let point = scene.beliefs.get(index)?;
                let deviations = point.covariance.0.iter().map(|row| row[place].max(0.0).sqrt()).collect();
                Some((point.position.0.iter().map(|row| row[axis]).collect(), Some(deviations)))
            };
            let moves = point.position.0.iter().any(|row| row[axis] != point.position.0[0][axis]);
            if moves {
                views.push(of_picture(runs, &labelled(&format!("{name} of {}", point.name), "m"), of, plots));
            }
        }
    }
    views
}

fn of_picture(runs: &[Run], label: &str, of: impl Fn(&Scene) -> Option<Pictured>, plots: &mut Plots) -> View {
    let (mut y, mut ends, mut has_band) = (Vec::new(), Vec::new(), false);
    for run in runs {
        let frames = scene(run).map_or(0, |scene| scene.time.0.len());
        let filled = |mut values: Vec<f64>| {
            let last = values.last().copied().unwrap_or(f64::NAN);
            values.resize(frames, last);
            values
        };
        let (values, deviations) = scene(run).and_then(&of).unwrap_or_default();
        let values = filled(values);
        ends.push(format!("{} ends at {}", run.name, number(values.last().copied().unwrap_or(f64::NAN))));
        let band = deviations.map(filled);
        let at = |times: f64| -> Option<Vec<f64>> {
            Some(values.iter().zip(band.as_ref()?).map(|(value, deviation)| value + times * deviation).collect())
        };
        if let (Some(low), Some(high)) = (at(-2.0), at(2.0)) {
            has_band = true;
            y.extend([plots.arrays.curve(&low), plots.arrays.curve(&high)]);
        }
        y.push(plots.arrays.curve(&values));
    }
    View {
        name: label.to_owned(),
        traces: chosen(runs, if has_band { &[BAND[0], BAND[1], PICTURE] } else { &[PICTURE] }),
        y,
        layout: vertical(runs, label),
        alternative: format!("{label} over time: {}.", list(&ends)),
    }
}

/// Names of the terms that have lines of their own: the largest ones in any design, in the order of the task.
fn terms(runs: &[Run]) -> Vec<String> {
    let Some(first) = runs.first() else { return Vec::new() };
    let size = |name: &str| {
        let of = |run: &Run| {
            let costs = run.trajectory.costs.iter().find(|cost| cost.name == name);
            costs.map_or(0.0, |cost| cost.per_step.iter().sum::<f64>())
        };
        runs.iter().map(of).fold(0.0, f64::max)
    };
    let mut sized: Vec<(f64, &str)> =
        first.trajectory.costs.iter().map(|cost| (size(&cost.name), cost.name.as_str())).collect();
    sized.sort_by(|a, b| b.0.total_cmp(&a.0));
    let kept: Vec<&str> = sized.iter().take(MOST_TERMS).map(|(_, name)| *name).collect();
    let names = first.trajectory.costs.iter().map(|cost| cost.name.as_str());
    names.filter(|name| kept.contains(name)).map(str::to_owned).collect()
}

fn of_costs(runs: &[Run], plots: &mut Plots) -> View {
    let names = terms(runs);
    let rest = runs.iter().any(|run| run.trajectory.costs.len() > names.len());
    let (mut y, mut sums) = (Vec::new(), Vec::new());
    for run in runs {
        let costs = &run.trajectory.costs;
        let positive = |value: f64| if value > 0.0 { value } else { f64::NAN };
        for name in &names {
            let per_step = costs.iter().find(|cost| cost.name == *name).map_or(&[][..], |cost| &cost.per_step);
            // Decades, as numbers are kept in steps of their range.
            let shown: Vec<f64> = per_step.iter().map(|&value| positive(value)).collect();
            y.push(plots.arrays.exact(&crate::arrays::thin(&shown)));
        }
        if rest {
            let others = costs.iter().filter(|cost| !names.contains(&cost.name));
            let mut sum = vec![0.0; run.trajectory.states.len()];
            for cost in others {
                sum.iter_mut().zip(&cost.per_step).for_each(|(sum, value)| *sum += value);
            }
            let shown: Vec<f64> = sum.into_iter().map(positive).collect();
            y.push(plots.arrays.exact(&crate::arrays::thin(&shown)));
        }
        let total: f64 = costs.iter().flat_map(|cost| &cost.per_step).sum();
        sums.push(format!("{} comes to {}", run.name, number(total)));
    }
    let mut traces: Vec<usize> = (TERMS..TERMS + names.len()).collect();
    traces.extend(rest.then_some(TERMS + MOST_TERMS));
    let mut layout = vertical(runs, "cost per step");
    layout.extend((0..runs.len()).map(|index| (format!("{}.type", axis_key("yaxis", index)), json!("log"))));
    View {
        name: "terms of the cost".into(),
        traces: chosen(runs, &traces),
        y,
        layout,
        alternative: format!("Terms of the plan's cost over time: in all, {}.", list(&sums)),
    }
}

/// Some traces of every panel.
fn chosen(runs: &[Run], of: &[usize]) -> Vec<usize> {
    (0..runs.len()).flat_map(|panel| of.iter().map(move |trace| panel * ALL + trace)).collect()
}

/// The title of the vertical axes.
fn vertical(runs: &[Run], label: &str) -> Map<String, Value> {
    (0..runs.len()).map(|index| (format!("{}.title.text", axis_key("yaxis", index)), label.into())).collect()
}
