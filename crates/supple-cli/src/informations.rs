//! The information needed, used and measured, in tables.

use supple::design::InformationWeights;
use supple::{Evaluation, InformationReport, TaskEvaluation};
use supple_study::design::DesignReport;
use supple_study::{About, AboutTask};

use crate::tables::{Rows, number, percent};

/// One kind of information, summed over all tasks: its name, its value, and its weight in the objective.
type OfTasks<'a> = (&'static str, Bits<'a>, f64);

/// Computes the value from an evaluation; `None` if a task lacks it.
type Bits<'a> = Box<dyn Fn(&Evaluation) -> Option<f64> + 'a>;

/// The kinds of information in the order in which they are shown.
fn all(about: &About, aim: InformationWeights) -> [OfTasks<'_>; 4] {
    let sum = |of: fn(&InformationReport) -> Option<f64>| -> Bits<'_> {
        Box::new(move |at| {
            let one =
                |(task, about): (&TaskEvaluation, &AboutTask)| Some(about.information_weight * of(&task.information)?);
            at.tasks.iter().zip(&about.tasks).map(one).sum()
        })
    };
    // Total information of all tasks divided by their total duration, both weighted.
    let rate = |at: &Evaluation| {
        let (mut bits, mut seconds) = (0.0, 0.0);
        for (TaskEvaluation { information, .. }, about) in at.tasks.iter().zip(&about.tasks) {
            bits += about.information_weight * information.total_bits;
            if information.bits_per_second > 0.0 {
                seconds += about.information_weight * information.total_bits / information.bits_per_second;
            }
        }
        (seconds > 0.0).then(|| bits / seconds)
    };
    [
        ("needed, bits", sum(|at| Some(at.needed.as_ref()?.total_bits)), aim.needed),
        ("used, bits", sum(|at| Some(at.used.as_ref()?.total_bits)), aim.used),
        ("measured, bits", sum(|at| Some(at.total_bits)), aim.measured),
        ("measured, bits/s", Box::new(rate), 0.0),
    ]
}

/// Adds the information of a search: values at the start and at the optimum.
pub fn add_rows(table: &mut Rows, about: &About, report: &DesignReport) {
    let DesignReport { start, optimum, settings, .. } = report;
    let is_weighted = about.tasks.iter().any(|task| task.information_weight != 1.0);
    for (name, of, weight) in all(about, settings.information) {
        if let (Some(from), Some(to)) = (of(start), of(optimum)) {
            let weighted = is_weighted.then_some("tasks weighted by `information_weight`");
            let notes: Vec<&str> = (weight > 0.0).then_some("minimised").into_iter().chain(weighted).collect();
            let note = notes.join("; ");
            table.add_row([name.into(), number(from), number(to), percent(from, to), String::new(), note]);
        }
    }
}

/// The rows of one task: name, value and note.
pub fn of_task(information: &InformationReport) -> Vec<(&'static str, String, String)> {
    let mut rows = Vec::new();
    if let Some(needed) = &information.needed {
        let why = if needed.limit_out_of_reach { "; even full information exceeds the cost limit" } else { "" };
        let note = format!(
            "bits, with any sensors and any controller about this plan, at a cost of {}{why}",
            number(needed.cost)
        );
        rows.push(("information needed", number(needed.total_bits), note));
    } else if information.needed_takes_long {
        let note = "not computed: slow with this many states; `supple bound` may compute it".into();
        rows.push(("information needed", "-".into(), note));
    } else if let Some(why) = &information.needed_not_found {
        rows.push(("information needed", "-".into(), format!("not found: {why}")));
    }
    if let Some(used) = &information.used {
        rows.push(("information used", number(used.total_bits), "bits that the controller uses".into()));
    }
    rows.push(("information measured", number(information.total_bits), "bits".into()));
    rows.push(("", number(information.bits_per_step), "bits per step".into()));
    rows.push(("", number(information.bits_per_second), "bits/s".into()));
    rows
}

/// A note on the kinds of information that reached zero, after which the search minimised the next kind.
pub fn passed(report: &DesignReport) -> String {
    let most = report.starts.iter().map(|start| start.passed).max().unwrap_or(0);
    let first = if report.settings.information.needed > 0.0 { "needed" } else { "used" };
    match (most, first) {
        (0, _) => String::new(),
        (1, "needed") => "\nNo information is needed there; the search then minimised the information used, among designs that need none.".into(),
        (_, "needed") => {
            "\nNo information is needed or used there; the search then minimised the information measured, among designs that need none.".into()
        }
        _ => "\nNo information is used there; the search then minimised the information measured.".into(),
    }
}
