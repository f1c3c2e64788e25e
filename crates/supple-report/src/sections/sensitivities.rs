//! How information and costs change with each parameter.

use maud::{Markup, html};
use serde_json::{Value, json};
use supple::{Named, TotalReport};

use super::Context;
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

    fn information(&self) -> Vec<f64> {
        self.percent(&self.gradient.information_nats, bits(1.0))
    }

    fn cost(&self) -> Vec<f64> {
        self.percent(&self.gradient.expected_cost, 1.0)
    }
}

/// A name, a unit, and the changes of a design.
type Quantity = (&'static str, &'static str, fn(&Sensitive) -> Vec<f64>);

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
    let kinds: [Quantity; 2] =
        [("Information", "bits", |at| at.information()), ("Expected cost", "cost", |at| at.cost())];
    let views = kinds.map(|(name, unit, values)| {
        let mut view = View { name: name.into(), traces: (0..designs.len()).collect(), ..Default::default() };
        let mut most = Vec::new();
        for design in designs {
            let values = values(design);
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
    });
    plots.add(Plot {
        title: titled(part, "Change per +1 % of a parameter", task),
        alternative: views[0].alternative.clone(),
        caption: "Bars by parameter and design.".into(),
        height: 360,
        traces,
        layout: json!({ "barmode": "group", "xaxis": { "type": "category" }, "yaxis": { "title": { "text": "" } } }),
        choice: Some(Choice { label: "Of".into(), views: views.into() }),
    })
}

fn numbers(part: &Part, task: usize, designs: &[Sensitive]) -> Markup {
    let mut head = words(["parameter"]);
    for design in designs {
        head.push(labelled(&design.shown.name, "bits"));
        head.push(format!("{}, cost", design.shown.name));
    }
    let columns: Vec<Vec<f64>> = designs.iter().flat_map(|design| [design.information(), design.cost()]).collect();
    let row = |(index, parameter): (usize, &supple::parameters::Parameter)| {
        let values = columns.iter().map(|column| column.get(index).map_or_else(|| number(f64::NAN), |&v| signed(v)));
        std::iter::once(parameter.name.clone()).chain(values).collect()
    };
    let rows: Vec<_> = part.about.parameters.iter().enumerate().map(row).collect();
    table(&titled(part, "Change per +1 % of a parameter", task), &head, &rows)
}
