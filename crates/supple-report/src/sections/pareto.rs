//! The least information over the bound on cost.

use maud::{Markup, html};
use serde_json::{Value, json};
use supple::Verdict;
use supple::design::DesignStatus;
use supple::parameters::Scale;
use supple_study::pareto::{Pareto, ParetoPoint, RangeEnd, Remark};

use super::context::Context;
use crate::html::{table, words};
use crate::numbers::{bits, labelled, number, unit};
use crate::part::Part;
use crate::plots::{Choice, Plot, Plots, View, line};
use crate::words::ended;

/// Two plots, remarks and a table for each front.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    let fronts = part.fronts();
    if fronts.is_empty() {
        return None;
    }
    let several = fronts.len() > 1;
    let mut pieces = Vec::new();
    for (folder, front) in fronts.into_iter().filter(|(_, front)| !front.points.is_empty()) {
        let name = |what: &str| if several { format!("{what}, {folder}") } else { what.to_owned() };
        let axis = Axis::of(part, front);
        pieces.push(tradeoff(part, front, &axis, name("Minimum information against the cost limit"), context.plots));
        let remarks: Vec<String> = front.remarks.iter().map(|remark| in_print(part, remark)).collect();
        pieces.push(html! { @if !remarks.is_empty() { ul { @for remark in remarks { li { (remark) } } } } });
        pieces.push(parameters(part, front, &axis, name("Parameters along the front"), context.plots));
        pieces.push(numbers(part, front, &axis, &name("Points of the front")));
    }
    Some(html! {
        p {
            "Every point is a separate design: the least information that the search finds while no expected cost exceeds "
            "its bound. With looser cost limits the controller receives less information, until the limits are no longer active."
        }
        @for piece in pieces { (piece) }
    })
}

/// A remark, with units as they are printed.
fn in_print(part: &Part, remark: &Remark) -> String {
    let of_end = |end: &RangeEnd| {
        let parameter = part.about.parameters.iter().find(|parameter| parameter.name == end.parameter)?;
        Some(end.text(&unit(&parameter.unit)))
    };
    remark.end.as_ref().and_then(of_end).unwrap_or_else(|| remark.text.clone())
}

/// The horizontal axis: the bound of the one task, or the factor of all bounds.
struct Axis {
    title: String,
    values: Vec<f64>,
}

impl Axis {
    fn of(part: &Part, front: &Pareto) -> Self {
        match (&part.about.tasks[..], &front.bounds[..]) {
            ([task], [_]) => {
                let bound = |point: &ParetoPoint| point.bounds.first().copied().unwrap_or(f64::NAN);
                let values = front.points.iter().map(bound).collect();
                Self { title: format!("limit on the expected cost of {}", task.name), values }
            }
            _ => Self {
                title: "cost limits, relative to those of the task".into(),
                values: front.points.iter().map(|point| point.factor).collect(),
            },
        }
    }
}

/// A point in words, by lines.
fn describe(part: &Part, point: &ParetoPoint) -> String {
    let mut lines = part.describe(&point.parameters);
    lines.push(format!("{} bits", number(bits(point.information_nats))));
    for (task, cost) in part.about.tasks.iter().zip(&point.costs) {
        lines.push(format!("cost of {}: {}", task.name, number(*cost)));
    }
    if point.status != DesignStatus::Converged {
        lines.push(format!("the search {}", ended(point.status)));
    }
    lines.extend(point.warnings.iter().cloned());
    lines.extend(
        point.trust.iter().filter(|trust| trust.verdict != Verdict::Holds).map(|trust| format!("roll-outs: {trust}")),
    );
    lines.join("\n")
}

/// Whether there are warnings about its plans, or roll-outs contradict them.
fn is_doubted(point: &ParetoPoint) -> bool {
    !point.warnings.is_empty() || point.is_broken()
}

/// Full where the search converged, open where not; a cross where there are warnings about a plan, or roll-outs contradict it.
fn symbols(front: &Pareto) -> Vec<&'static str> {
    let of = |point: &ParetoPoint| match point.status {
        _ if is_doubted(point) => "x",
        DesignStatus::Converged => "circle",
        _ => "circle-open",
    };
    front.points.iter().map(of).collect()
}

fn tradeoff(part: &Part, front: &Pareto, axis: &Axis, title: String, plots: &mut Plots) -> Markup {
    let y: Vec<f64> = front.points.iter().map(|point| bits(point.information_nats)).collect();
    let text: Vec<String> = front.points.iter().map(|point| describe(part, point)).collect();
    let mut traces = vec![json!({
        "type": "scatter", "mode": "lines+markers", "name": "front", "x": plots.arrays.exact(&axis.values),
        "y": plots.arrays.exact(&y), "text": text, "hoverinfo": "text", "line": line(0),
        "marker": { "color": "@1", "size": 8, "symbol": symbols(front) },
    })];
    if let ([_], [_]) = (&part.about.tasks[..], &front.bounds[..]) {
        for (index, shown) in part.designs().iter().enumerate() {
            let Some(task) = shown.at.tasks.first() else { continue };
            traces.push(json!({
                "type": "scatter", "mode": "markers", "name": shown.name, "x": [task.cost.expected],
                "y": [shown.at.objective.information_bits], "hoverinfo": "text",
                "text": [format!("{}\n{}", shown.name, part.describe(&shown.at.parameters).join("\n"))],
                "marker": { "color": crate::plots::colour(index + 1), "size": 11, "symbol": marker(index) },
            }));
        }
    }
    let (tight, loose) = (0, y.len() - 1);
    let alternative = format!(
        "Least information over {}: {} bits at {}, {} bits at {}.",
        axis.title,
        number(y[tight]),
        number(axis.values[tight]),
        number(y[loose]),
        number(axis.values[loose])
    );
    let crosses = if front.points.iter().any(is_doubted) { CROSSES } else { "" };
    plots.add(Plot {
        title,
        alternative,
        caption: format!(
            "Open points: searches that did not converge.{crosses} Other designs are drawn at their expected cost."
        ),
        height: 420,
        traces,
        layout: json!({
            "xaxis": { "title": { "text": axis.title } }, "yaxis": { "title": { "text": "information, bits" } },
            "hovermode": "closest",
        }),
        choice: None,
    })
}

/// What captions say of crossed points.
pub const CROSSES: &str = " Crosses: designs whose plan never makes a contact whose force a cost tracks, or whose predictions roll-outs contradict.";

/// The symbol of a design.
pub fn marker(index: usize) -> &'static str {
    ["square", "star", "diamond", "triangle-up", "cross", "x"][index % 6]
}

fn parameters(part: &Part, front: &Pareto, axis: &Axis, title: String, plots: &mut Plots) -> Markup {
    let design = part.about.parameters.design();
    let (mut traces, mut views) = (Vec::new(), Vec::new());
    let mut together = View { name: "All, as shares of their ranges".into(), ..Default::default() };
    let x = plots.arrays.exact(&axis.values);
    for (place, &index) in design.iter().enumerate() {
        let parameter = part.about.parameters.get(index);
        let value = |point: &ParetoPoint| point.parameters.get(&parameter.name).unwrap_or(f64::NAN);
        let values: Vec<f64> = front.points.iter().map(value).collect();
        let scaled = |value: f64| if parameter.scale == Scale::Log { value.ln() } else { value };
        let [least, most] = parameter.bounds.map(scaled);
        let shares: Vec<f64> = values.iter().map(|&value| (scaled(value) - least) / (most - least)).collect();
        traces.push(json!({
            "type": "scatter", "mode": "lines+markers", "name": parameter.name, "x": x, "y": Value::Null,
            "line": line(place), "marker": { "symbol": symbols(front), "size": 6 },
        }));
        together.traces.push(place);
        together.y.push(plots.arrays.exact(&shares));
        let mut own = View { name: parameter.name.clone(), traces: vec![place], ..Default::default() };
        own.y.push(plots.arrays.exact(&values));
        own.layout.insert("yaxis.title.text".into(), labelled(&parameter.name, &parameter.unit).into());
        own.layout.insert("yaxis.type".into(), if parameter.scale == Scale::Log { "log" } else { "linear" }.into());
        let ends = [values.first(), values.last()].map(|value| number(value.copied().unwrap_or(f64::NAN)));
        own.alternative = format!("{} along the front: from {} to {}.", own.name, ends[0], ends[1]);
        views.push(own);
    }
    together.layout.insert("yaxis.title.text".into(), "share of the range".into());
    together.layout.insert("yaxis.type".into(), "linear".into());
    together.alternative = views.iter().map(|view| view.alternative.as_str()).collect::<Vec<_>>().join(" ");
    views.insert(0, together);
    plots.add(Plot {
        title,
        alternative: views[0].alternative.clone(),
        caption:
            "A share of 0 is the lower end of a parameter's range, 1 the upper end; logarithmic for parameters with a logarithmic scale."
                .into(),
        height: 380,
        traces,
        layout: json!({ "xaxis": { "title": { "text": axis.title } }, "yaxis": { "title": { "text": "" } } }),
        choice: Some(Choice { label: "Parameter".into(), views }),
    })
}

fn numbers(part: &Part, front: &Pareto, axis: &Axis, caption: &str) -> Markup {
    let mut head = vec![axis.title.clone(), "information, bits".into()];
    head.extend(part.about.tasks.iter().map(|task| format!("cost of {}", task.name)));
    head.extend(part.about.tasks.iter().map(|task| format!("bits per unit of the cost limit of {}", task.name)));
    let design = part.about.parameters.design();
    head.extend(design.iter().map(|&index| {
        let parameter = part.about.parameters.get(index);
        labelled(&parameter.name, &parameter.unit)
    }));
    let has_prices = front.points.iter().any(|point| point.price.is_some());
    head.extend(has_prices.then(|| "price".into()));
    head.extend(words(["search"]));
    let row = |(point, at): (&ParetoPoint, &f64)| {
        let mut row = vec![number(*at), number(bits(point.information_nats))];
        row.extend(point.costs.iter().map(|&cost| number(cost)));
        row.extend(point.prices.iter().map(|&price| number(bits(price))));
        let name = |&index: &usize| &part.about.parameters.get(index).name;
        row.extend(design.iter().map(|index| number(point.parameters.get(name(index)).unwrap_or(f64::NAN))));
        row.extend(has_prices.then(|| number(point.price.unwrap_or(f64::NAN))));
        row.push(ended(point.status).to_owned());
        row
    };
    let rows: Vec<_> = front.points.iter().zip(&axis.values).map(row).collect();
    html! { details { summary { (caption) } (table(caption, &head, &rows)) } }
}
