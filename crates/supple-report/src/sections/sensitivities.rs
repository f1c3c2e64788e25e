//! How information and costs change with each parameter.

use maud::{Markup, html};
use serde_json::{Value, json};
use supple::{Named, TotalReport};
use supple_text::capitalised;

use super::context::Context;
use super::series::titled;
use crate::html::{table, words};
use crate::numbers::{bits, labelled, number, signed};
use crate::part::{Part, Shown};
use crate::plots::{Choice, Plot, Plots, View, colour};
use crate::words::list;

/// A plot and a table by task.
pub fn section(context: &mut Context) -> Option<Markup> {
    let part = context.part;
    if part.about.parameters.is_empty() {
        return None;
    }
    let mut pieces = Vec::new();
    for task in 0..part.about.tasks.len() {
        let designs = designs(part, task);
        if !designs.is_empty() {
            pieces.push(bars(part, task, &designs, context.plots));
            pieces.push(numbers(part, task, &designs));
        }
    }
    if pieces.is_empty() {
        return None;
    }
    Some(html! {
        p {
            "From the total gradient, in which plan, feedback and filter all vary: the change when a parameter increases "
            "by 1 %, to first order."
        }
        @for piece in pieces { (piece) }
    })
}

/// A design with its gradient.
struct Sensitive<'a> {
    shown: Shown<'a>,
    gradient: &'a TotalReport,
}

fn designs<'a>(part: &Part<'a>, task: usize) -> Vec<Sensitive<'a>> {
    let of = |shown: Shown<'a>| {
        let gradient = shown.at.tasks.get(task)?.gradient.as_ref()?.total.as_ref()?;
        Some(Sensitive { shown, gradient })
    };
    part.designs().into_iter().filter_map(of).collect()
}

impl Sensitive<'_> {
    /// Changes by 1 % of every parameter.
    fn percent(&self, of: &Named, scale: f64) -> Vec<f64> {
        let parameters = &self.shown.at.parameters;
        of.0.iter().map(|(name, slope)| scale * slope * 0.01 * parameters.get(name).unwrap_or(f64::NAN)).collect()
    }

    fn change(&self, quantity: &Quantity) -> Vec<f64> {
        let scale = if quantity.unit == BITS { bits(1.0) } else { 1.0 };
        (quantity.slopes)(self.gradient).map_or_else(Vec::new, |slopes| self.percent(slopes, scale))
    }
}

/// What changes with a parameter.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    slopes: fn(&TotalReport) -> Option<&Named>,
}

const BITS: &str = "bits";

/// What changes with a parameter, as far as it is known of any design: each kind of information, and the cost.
fn quantities(designs: &[Sensitive]) -> Vec<Quantity> {
    let all = [
        Quantity { name: "needed information", unit: BITS, slopes: |total| total.needed_nats.as_ref() },
        Quantity { name: "used information", unit: BITS, slopes: |total| total.used_nats.as_ref() },
        Quantity { name: "measured information", unit: BITS, slopes: |total| Some(&total.information_nats) },
        Quantity { name: "expected cost", unit: "cost", slopes: |total| Some(&total.expected_cost) },
    ];
    let is_known = |quantity: &Quantity| designs.iter().any(|design| (quantity.slopes)(design.gradient).is_some());
    all.into_iter().filter(is_known).collect()
}

fn bars(part: &Part, task: usize, designs: &[Sensitive], plots: &mut Plots) -> Markup {
    let names: Vec<&str> = part.about.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    let mut traces = Vec::new();
    for (index, design) in designs.iter().enumerate() {
        let shape = ["", "/", ".", "x", "-", "+"][index % 6];
        traces.push(json!({
            "type": "bar", "name": design.shown.name, "x": names, "y": Value::Null,
            "marker": { "color": colour(index), "pattern": { "shape": shape, "fgopacity": 0.6 } },
        }));
    }
    let of_quantity = |quantity: Quantity| {
        let (name, unit) = (capitalised(quantity.name), quantity.unit);
        let mut view = View { name: name.clone(), traces: (0..designs.len()).collect(), ..Default::default() };
        let mut most = Vec::new();
        for design in designs {
            let values = design.change(&quantity);
            let size = |index: &usize| values[*index].abs();
            let finite = (0..values.len()).filter(|&index| values[index].is_finite());
            if let Some(index) = finite.max_by(|a, b| size(a).total_cmp(&size(b))) {
                most.push(format!("{} by {} at {}", signed(values[index]), names[index], design.shown.name));
            }
            view.y.push(plots.arrays.exact(&values));
        }
        view.layout.insert("yaxis.title.text".into(), format!("{unit} per +1 %").into());
        view.alternative = format!("{name} per +1 % of each parameter, in {unit}; most: {}.", list(&most));
        view
    };
    let views: Vec<View> = quantities(designs).into_iter().map(of_quantity).collect();
    plots.add(Plot {
        title: titled(part, "Change per +1 % of a parameter", task),
        alternative: views.first().map_or_else(String::new, |view| view.alternative.clone()),
        caption: "Bars by parameter and design.".into(),
        height: 360,
        traces,
        layout: json!({ "barmode": "group", "xaxis": { "type": "category" }, "yaxis": { "title": { "text": "" } } }),
        choice: Some(Choice { label: "Of".into(), views }),
    })
}

fn numbers(part: &Part, task: usize, designs: &[Sensitive]) -> Markup {
    let quantities = quantities(designs);
    let mut head = words(["parameter"]);
    let mut columns = Vec::new();
    for design in designs {
        for quantity in &quantities {
            let Quantity { name, unit, .. } = quantity;
            let what = if *unit == BITS { labelled(name, unit) } else { (*name).to_owned() };
            head.push(format!("{}: {what}", design.shown.name));
            columns.push(design.change(quantity));
        }
    }
    let row = |(index, parameter): (usize, &supple::parameters::Parameter)| {
        let values = columns.iter().map(|column| column.get(index).map_or_else(|| number(f64::NAN), |&v| signed(v)));
        std::iter::once(parameter.name.clone()).chain(values).collect()
    };
    let rows: Vec<_> = part.about.parameters.iter().enumerate().map(row).collect();
    table(&titled(part, "Change per +1 % of a parameter", task), &head, &rows)
}
