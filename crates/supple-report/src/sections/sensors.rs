//! Which sensors are worth their price.

use maud::{Markup, html};
use supple_study::sensors::{SensorGoal, SensorSet, Sensors};

use super::context::Context;
use crate::html::{table, words};
use crate::numbers::number;

/// The chosen set and what every sensor is worth, for each study of sensors.
pub fn section(context: &mut Context) -> Option<Markup> {
    let studies = context.part.sensors();
    if studies.is_empty() {
        return None;
    }
    let several = studies.len() > 1;
    Some(html! {
        @for (folder, study) in studies {
            @let of = if several { format!(", {folder}") } else { String::new() };
            (sets(study, &of))
            (values(study, &of))
            @if !study.remarks.is_empty() { ul { @for remark in &study.remarks { li { (remark) } } } }
            p { (certificate(study)) }
        }
    })
}

fn sets(study: &Sensors, of: &str) -> Markup {
    let row = |what: &str, set: &SensorSet, sensors: String| {
        let numbers = [set.expected_cost, set.information_bits, set.price].map(number);
        [what.to_owned()].into_iter().chain(numbers).chain([sensors]).collect::<Vec<_>>()
    };
    let mut rows = vec![row("none of them", &study.none, String::new())];
    rows.extend(study.greedy.as_ref().map(|set| row("greedy choice", set, set.sensors.join(", "))));
    let best = if study.certificate.proved { "the best" } else { "the best found" };
    rows.extend(study.best.as_ref().map(|set| row(best, set, set.sensors.join(", "))));
    rows.push(row("all of them", &study.all, String::new()));
    table(
        &format!("Sets of sensors{of}"),
        &words(["set", "expected cost", "information, bits", "price", "sensors"]),
        &rows,
    )
}

/// The most valuable one alone first.
fn values(study: &Sensors, of: &str) -> Markup {
    let mut sensors: Vec<_> = study.sensors.iter().collect();
    sensors.sort_by(|a, b| b.saved_alone.total_cmp(&a.saved_alone));
    let row = |sensor: &supple_study::sensors::SensorValue| {
        let numbers = [sensor.price, sensor.saved_alone, sensor.saved_beyond_others, sensor.bits_alone];
        let remark = if sensor.chosen { "chosen" } else { "" };
        let all = numbers.into_iter().chain([sensor.bits_beyond_others]).map(number);
        [sensor.name.clone()].into_iter().chain(all).chain([remark.to_owned()]).collect::<Vec<_>>()
    };
    let rows: Vec<_> = sensors.into_iter().map(row).collect();
    let head =
        ["sensor", "price", "saves alone", "saves beyond the others", "bits alone", "bits beyond the others", "remark"];
    table(&format!("What each sensor is worth{of}"), &words(head), &rows)
}

/// How good any set could be, in a sentence.
fn certificate(study: &Sensors) -> String {
    let found = study.certificate;
    let bound = number(found.searched_bound.filter(|_| found.proved).unwrap_or(found.bound));
    let mut text = match (study.options.cost, study.options.goal) {
        (Some(cost), _) => {
            format!("No set with an expected cost of at most {} has a price below {bound}.", number(cost))
        }
        (None, SensorGoal::Cost) => format!("No set within the limits has an expected cost below {bound}."),
        (None, SensorGoal::Information) => format!("No set within the limits gives more than {bound} bits."),
    };
    if let (None, Some(share)) = (study.options.cost, found.certified_ratio) {
        // Rounded down, so that the certified share is not overstated.
        let percent = (1e4 * share).floor() / 100.0;
        text += &format!(" Greedy choice has at least {percent:.2} % of the best possible gain.");
    }
    if found.proved {
        text += " A search of all sets proves its set to be the best one.";
    }
    text
}
