//! What studies over many designs found, each in a sentence.

use supple::design::DesignStatus;
use supple_study::bound::BoundStudy;
use supple_study::pareto::Pareto;
use supple_study::robustness::Robustness;
use supple_study::sensors::{SensorGoal, Sensors};
use supple_study::sweep::Sweep;
use supple_study::trace::Trace;

use crate::numbers::{bits, number, with_unit};
use crate::part::Part;
use crate::words::{count, list};

/// A sentence about one study.
pub struct Headline {
    /// The name of the section that shows it.
    pub section: &'static str,
    /// What the link to the section says.
    pub what: String,
    /// What was found.
    pub text: String,
}

/// A sentence for each sweep, front, trace of searches, study of robustness, of bounds and of sensors.
pub fn headlines(part: &Part) -> Vec<Headline> {
    let of = |section, kind: &str, folder: &str, text| Headline { section, what: format!("{kind} in {folder}"), text };
    let mut all = Vec::new();
    all.extend(part.sweeps().iter().map(|(folder, it)| of("landscape", "Sweep", folder, sweep(it))));
    all.extend(part.fronts().iter().map(|(folder, it)| of("pareto", "Pareto front", folder, front(it))));
    all.extend(part.traces().iter().map(|(folder, it)| of("convergence", "Searches", folder, trace(part, it))));
    all.extend(part.robustness().iter().map(|(folder, it)| of("robustness", "Robustness", folder, robustness(it))));
    all.extend(part.bounds().iter().map(|(folder, it)| of("bound", "Bounds", folder, bound(it))));
    all.extend(part.sensors().iter().map(|(folder, it)| of("sensors", "Sensors", folder, sensors(it))));
    all
}

fn sweep(sweep: &Sweep) -> String {
    let points = count(sweep.table.rows.len(), "point");
    let Some(least) = sweep.least() else { return format!("{points}, none of which has any information.") };
    let value = |axis: &supple_study::sweep::Axis| {
        let value = sweep.table.numbers(&axis.parameter)?[least.row];
        Some(format!("{} = {}", axis.parameter, with_unit(value, &axis.unit)))
    };
    let at = list(&sweep.options.axes.iter().filter_map(value).collect::<Vec<_>>());
    let bits = number(least.bits);
    match least.among {
        0 => format!(
            "no point can be recommended: none is within all cost limits with plans that converged and make their \
             contacts. Of all {points}, the least information is {bits} bits at {at}."
        ),
        among => format!("of {points}, {among} within all cost limits; the least information is {bits} bits at {at}."),
    }
}

fn front(front: &Pareto) -> String {
    let (Some(tight), Some(loose)) = (front.points.first(), front.points.last()) else {
        return "it has no points.".into();
    };
    let [tight, loose] = [tight, loose].map(|point| {
        let costs = list(&point.costs.iter().map(|&cost| number(cost)).collect::<Vec<_>>());
        format!("{} bits at a cost of {costs}", number(bits(point.information_nats)))
    });
    let untouched = front.points.iter().filter(|point| !point.warnings.is_empty()).count();
    let missed = match untouched {
        0 => String::new(),
        missed => format!("; at {missed} of them a plan never makes a contact whose force a cost tracks"),
    };
    format!("{}, from {tight} to {loose}{missed}.", count(front.points.len(), "design"))
}

fn trace(part: &Part, trace: &Trace) -> String {
    let converged = trace.runs.iter().filter(|run| run.status == DesignStatus::Converged).count();
    let ended = format!("{converged} of {} converged", trace.runs.len());
    match trace.best() {
        Some(best) => {
            let end = &best.end;
            let at = list(&part.describe(&end.parameters));
            format!("{ended}; the best one ended at {at} with {} bits.", number(bits(end.information_nats)))
        }
        None => format!("{ended}; none ended within all cost limits."),
    }
}

fn robustness(study: &Robustness) -> String {
    let vary = &study.options.vary;
    let [from, to] = [vary.values.first(), vary.values.last()].map(|value| value.copied().unwrap_or(f64::NAN));
    let names: Vec<String> = study.designs.iter().map(|design| design.name.clone()).collect();
    format!(
        "cost of {} in closed loop as {} goes from {} to {}.",
        list(&names),
        vary.parameter,
        number(from),
        with_unit(to, &vary.unit)
    )
}

fn bound(study: &BoundStudy) -> String {
    let tasks = study.report.tasks.iter().map(|task| {
        let (bits, cost) = (number(task.minimum_bits_per_step), number(task.cost));
        let least = format!("{bits} bits per step for {} at an expected cost of {cost}", task.name);
        if task.not_proved.is_some() || task.not_certified().is_some() {
            format!("{least} (not certified)")
        } else {
            least
        }
    });
    format!("the least that any sensors and controller need is {}.", list(&tasks.collect::<Vec<_>>()))
}

fn sensors(study: &Sensors) -> String {
    let set = &study.chosen;
    let names = if set.sensors.is_empty() { "no sensor".to_owned() } else { list(&set.sensors) };
    let numbers = format!(
        "expected cost {}, {} bits, price {}",
        number(set.expected_cost),
        number(set.information_bits),
        number(set.price)
    );
    let what = match (study.options.cost, study.options.goal) {
        (Some(cost), _) => format!("cheapest within an expected cost of {}", number(cost)),
        (None, SensorGoal::Cost) => "least expected cost".into(),
        (None, SensorGoal::Information) => "most information".into(),
    };
    let best = if study.certificate.proved { what } else { format!("{what}, as far as found") };
    format!("{best}: {names} ({numbers}).")
}
