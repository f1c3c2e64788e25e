//! What plans touch: every contact of the model, over the whole plan.

use maud::{Markup, html};
use supple::ContactReport;

use super::context::Context;
use super::series::titled;
use crate::html::{table, words};
use crate::numbers::{number, with_unit};
use crate::part::Part;
use crate::plots::Plots;
use crate::words::list;

/// A table by task.
pub fn section(context: &mut Context) -> Option<Markup> {
    let about = html! {
        "A contact touches at a step if its clearance is below one smoothing length and its normal force is above 1e−6 of "
        "stiffness times smoothing. Times, forces and clearances refer to the plan without noise; the mean force is over "
        "the steps at which it touches, and a negative clearance is a penetration. The last column is the greatest force "
        "at steps with a clearance of more than one smoothing length."
    };
    context.by_task(&about, contacts)
}

fn contacts(part: &Part, task: usize, _: &mut Plots) -> Option<Markup> {
    let head = words([
        "contact",
        "design",
        "first touch, s",
        "last touch, s",
        "share of time",
        "peak force, N",
        "mean force, N",
        "least clearance, m",
        "force apart, N",
    ]);
    let row = |design: &str, contact: &ContactReport| {
        let time = |time: Option<f64>| time.map_or_else(|| "never".to_owned(), number);
        vec![
            contact.name.clone(),
            design.to_owned(),
            time(contact.first_s),
            time(contact.last_s),
            number(contact.share_of_time),
            number(contact.peak_force),
            number(contact.mean_force),
            number(contact.least_clearance_m),
            number(contact.greatest_force_apart),
        ]
    };
    let mut rows = Vec::new();
    for shown in part.designs() {
        if let Some(task) = shown.at.tasks.get(task) {
            rows.extend(task.contacts.iter().map(|contact| row(&shown.name, contact)));
        }
    }
    (!rows.is_empty()).then(|| table(&titled(part, "Contacts of the plan", task), &head, &rows))
}

/// When a design touches what, in words; `None` if the model has no contacts.
pub fn in_words(design: &str, contacts: &[ContactReport]) -> Option<String> {
    let one = |contact: &ContactReport| match (contact.first_s, contact.last_s) {
        (Some(first), Some(last)) => format!(
            "touches {} from {} to {} with up to {}",
            contact.name,
            number(first),
            with_unit(last, "s"),
            with_unit(contact.peak_force, "N")
        ),
        _ => format!("never touches {}", contact.name),
    };
    let all: Vec<String> = contacts.iter().map(one).collect();
    (!all.is_empty()).then(|| format!("{design}: {}.", list(&all)))
}
