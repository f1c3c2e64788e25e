//! Terms of the cost along plans, and what became of the numbers that they weigh.

use maud::{Markup, html};
use supple::{CostTerm, TargetReport, TaskEvaluation};

use super::context::Context;
use super::series::titled;
use crate::html::{table, words};
use crate::numbers::{labelled, number, with_unit};
use crate::part::Part;
use crate::plots::Plots;

/// A table by task.
pub fn section(context: &mut Context) -> Option<Markup> {
    let about = html! {
        "What each term of the cost costs along the plan without noise, over its stages and at its end, and the numbers that it "
        "weighs: their targets, and what they are at the start, on average, and at the end. Of terms that weigh more than "
        "three numbers, the one that ends farthest from its target is shown."
    };
    context.by_task(&about, terms)
}

fn terms(part: &Part, task: usize, _: &mut Plots) -> Option<Markup> {
    let head = words(["cost", "design", "nominal", "share", "weighs", "target", "at the start", "mean", "at the end"]);
    let mut rows = Vec::new();
    for shown in part.designs() {
        if let Some(task) = shown.at.tasks.get(task) {
            rows.extend(task.cost.terms.iter().flat_map(|term| of_term(&shown.name, task, term)));
        }
    }
    (!rows.is_empty()).then(|| table(&titled(part, "Terms of the cost", task), &head, &rows))
}

/// A row for each number of a term, or one without numbers.
fn of_term(design: &str, task: &TaskEvaluation, term: &CostTerm) -> Vec<Vec<String>> {
    let share = term.share(task.cost.parts.nominal).map_or_else(String::new, |share| with_unit(100.0 * share, "%"));
    let cells = [term.name.clone(), design.to_owned(), number(term.total()), share];
    let numbers = term.shown();
    if numbers.is_empty() {
        return vec![cells.iter().cloned().chain(vec![String::new(); 5]).collect()];
    }
    let row = |target: &TargetReport| {
        let values = [target.target, target.start, target.mean, target.end].map(number);
        cells.iter().cloned().chain([labelled(&target.name, &target.unit)]).chain(values).collect()
    };
    numbers.into_iter().map(row).collect()
}
