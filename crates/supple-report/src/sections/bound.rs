//! The section on the minimum information required.

use maud::{Markup, html};
use serde_json::json;
use supple::bound::TaskBound;
use supple_study::bound::{Curve, CurvePoint};

use super::context::Context;
use crate::html::{table, words};
use crate::numbers::{number, with_unit};
use crate::plots::{Plot, Plots, line};

/// A table of bounds, the virtual sensor and plots for each task of each study of bounds.
pub fn section(context: &mut Context) -> Option<Markup> {
    let studies = context.part.bounds();
    if studies.is_empty() {
        return None;
    }
    let several = studies.len() > 1;
    let mut pieces = Vec::new();
    for (folder, study) in studies {
        for (index, task) in study.report.tasks.iter().enumerate() {
            let name = if several { format!("{}, {folder}", task.name) } else { task.name.clone() };
            pieces.push(bounds(task, &name));
            pieces.push(sensor(task, &name));
            if !task.stationary {
                pieces.push(over_time(task, &name, context.plots));
            }
            if let Some(curve) = study.curves.get(index) {
                pieces.push(over_cost(task, curve, &name, context.plots));
            }
        }
    }
    Some(html! {
        p {
            "The minimum is the least directed information with which any sensors and any controller keep the expected "
            "cost D of the table. The virtual sensor attains this minimum; a real design measures more because of its own sensors."
        }
        @for piece in pieces { (piece) }
    })
}

fn shown(bits: Option<f64>) -> String {
    bits.map_or_else(|| "unknown".to_owned(), number)
}

fn bounds(task: &TaskBound, name: &str) -> Markup {
    let row =
        |line: &supple::bound::OrderLine| vec![line.what.clone(), shown(line.bits_per_step), line.assumption.clone()];
    let rows: Vec<_> = task.order.iter().map(row).collect();
    let share = |share: f64| format!("{} %", number(100.0 * share));
    html! {
        (table(&format!("Bounds for {name}"), &words(["information", "bits per step", "for"]), &rows))
        p {
            "Cost limit: " (number(task.cost)) "; minimum cost, with the state known exactly: "
            (number(task.minimum_cost)) ". "
            @match (&task.not_proved, task.not_certified()) {
                (None, None) => { "The minimum is certified to " (number(task.duality_gap_bits)) " bits per step. " }
                (None, Some(reason)) => { "The minimum is not certified: " (reason) ". " }
                (Some(reason), _) => { "The minimum has no proved lower bound: " (reason) ". " }
            }
            @if let Some(efficiency) = task.efficiency {
                "It is " (share(efficiency)) " of the information that this design measures"
                @if let Some(efficiency) = task.control_efficiency {
                    " and " (share(efficiency)) " of the information that its controller uses"
                }
                ". "
            }
            "Prefix-free codes with scalar quantisers require at most "
            (number(task.quantiser_bits_per_step)) " bits per step."
        }
        @if !task.remarks.is_empty() { ul { @for remark in &task.remarks { li { (remark) } } } }
    }
}

fn sensor(task: &TaskBound, name: &str) -> Markup {
    let mut rows = Vec::new();
    for window in &task.virtual_sensor.windows {
        let span = match task.stationary {
            true => "any".to_owned(),
            false => format!("{} to {}", number(window.from_s), number(window.until_s)),
        };
        for direction in &window.directions {
            rows.push(vec![
                span.clone(),
                number(window.strongest as f64 * task.time_step_s),
                number(direction.bits),
                direction.text.clone(),
                with_unit(direction.deviation, &direction.unit),
            ]);
        }
    }
    let head = words(["time, s", "peak at, s", "bits at peak", "measures", "standard deviation"]);
    html! { @if !rows.is_empty() { (table(&format!("Virtual sensor for {name}"), &head, &rows)) } }
}

fn over_time(task: &TaskBound, name: &str, plots: &mut Plots) -> Markup {
    let time: Vec<f64> = (0..task.steps).map(|t| t as f64 * task.time_step_s).collect();
    let x = plots.arrays.exact(&time);
    let lines = [
        ("minimum", &task.minimum_per_step_bits),
        ("DI(x → u)", &task.control_per_step_bits),
        ("DI(x → y)", &task.measurement_per_step_bits),
    ];
    let mut traces = Vec::new();
    for (index, (what, bits)) in lines.into_iter().enumerate().filter(|(_, (_, bits))| !bits.is_empty()) {
        traces.push(json!({
            "type": "scatter", "mode": "lines", "name": what, "x": x, "y": plots.arrays.exact(bits), "line": line(index),
        }));
    }
    plots.add(Plot {
        title: format!("Information at each decision, {name}"),
        alternative: format!(
            "Bits at each decision over time: {} in total for the minimum, {} per step.",
            number(task.minimum_bits),
            number(task.minimum_bits_per_step)
        ),
        caption:
            "Terms of the minimum (L.2), distributed over time optimally for the task; the design's own sensors measure at every step."
                .into(),
        height: 340,
        traces,
        layout: json!({ "xaxis": { "title": { "text": "time, s" } }, "yaxis": { "title": { "text": "bits" } } }),
        choice: None,
    })
}

fn over_cost(task: &TaskBound, curve: &Curve, name: &str, plots: &mut Plots) -> Markup {
    let excess: Vec<f64> = curve.points.iter().map(|point| point.cost - task.minimum_cost).collect();
    let bits: Vec<f64> = curve.points.iter().map(|point| point.minimum_bits_per_step).collect();
    let text: Vec<String> = curve
        .points
        .iter()
        .map(|point| {
            let doubt = point.error.as_ref().map_or_else(String::new, |error| format!("\n{error}"));
            format!("cost {}\n{} bits per step{doubt}", number(point.cost), number(point.minimum_bits_per_step))
        })
        .collect();
    let symbol = |point: &CurvePoint| if point.error.is_some() { "circle-open" } else { "circle" };
    let symbols: Vec<&str> = curve.points.iter().map(symbol).collect();
    let open = if curve.points.iter().any(|point| point.error.is_some()) {
        " Open points are not certified: their cursor's text says why."
    } else {
        ""
    };
    let mut traces = vec![json!({
        "type": "scatter", "mode": "lines+markers", "name": "minimum", "x": plots.arrays.exact(&excess),
        "y": plots.arrays.exact(&bits), "text": text, "hoverinfo": "text", "line": line(0),
        "marker": { "symbol": symbols },
    })];
    let own = task.own_cost.map(|cost| cost - task.minimum_cost);
    let designs = [("DI(x → u)", task.control_bits_per_step), ("DI(x → y)", task.measurement_bits_per_step)];
    for (index, (what, bits)) in designs.into_iter().enumerate() {
        if let (Some(own), Some(bits)) = (own, bits) {
            traces.push(json!({
                "type": "scatter", "mode": "markers", "name": format!("{what} of the design"), "x": [own], "y": [bits],
                "marker": { "color": crate::plots::colour(index + 1), "size": 11, "symbol": super::pareto::marker(index) },
            }));
        }
    }
    let end = |place: Option<&f64>| number(place.copied().unwrap_or(f64::NAN));
    plots.add(Plot {
        title: format!("Minimum information over the cost limit, {name}"),
        alternative: format!(
            "Minimum information over the cost limit: from {} bits per step at {} above the minimum cost to {} at {}.",
            end(bits.first()),
            end(excess.first()),
            end(bits.last()),
            end(excess.last())
        ),
        caption: format!("The minimum cost, with the state known exactly, is {}.{open}", number(task.minimum_cost)),
        height: 420,
        traces,
        layout: json!({
            "xaxis": { "title": { "text": "expected cost above the minimum" }, "type": "log" },
            "yaxis": { "title": { "text": "bits per step" } }, "hovermode": "closest",
        }),
        choice: None,
    })
}
