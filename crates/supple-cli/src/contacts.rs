//! Contacts along plans, as text.

use supple::{ContactReport, Evaluation, TaskEvaluation};
use supple_study::design::DesignReport;

use crate::tables::{Rows, align_right, number, table, with_unit};

/// The contacts along the plan of a task, one row per contact.
pub fn table_of(task: &TaskEvaluation) -> Rows {
    let mut rows =
        table(&["contact", "first, s", "last, s", "share of time", "peak, N", "mean, N", "least clearance, m"]);
    for contact in &task.contacts {
        let time = |time: Option<f64>| time.map_or_else(|| "never".to_owned(), number);
        rows.add_row([
            contact.name.clone(),
            time(contact.first_s),
            time(contact.last_s),
            format!("{:.3}", contact.share_of_time),
            number(contact.peak_force),
            number(contact.mean_force),
            number(contact.least_clearance_m),
        ]);
    }
    align_right(&mut rows, 1..7);
    rows
}

/// A line for each contact that pushes although the surfaces never meet, as its force is smoothed.
pub fn apart(task: &TaskEvaluation) -> String {
    let apart = task.contacts.iter().filter(|contact| contact.touches && contact.least_clearance_m > 0.0);
    let line = |contact: &ContactReport| {
        let gap = with_unit(contact.least_clearance_m, "m");
        format!(
            "`{}` never meets its wall: its force acts from {gap} away, as `smoothing` spreads it that far.\n",
            contact.name
        )
    };
    apart.map(line).collect()
}

/// A line for each warning of the tasks.
pub fn warnings(at: &Evaluation) -> String {
    let lines: String = at.warnings().map(|warning| format!("Warning: {warning}.\n")).collect();
    if lines.is_empty() { lines } else { lines + "\n" }
}

/// How many designs of a search never make a contact whose force a cost tracks; empty if all do.
pub fn note(report: &DesignReport) -> String {
    match report.evaluations_without_contact {
        0 => String::new(),
        1 => "\n1 of these designs never makes a contact whose force a cost tracks.".into(),
        count => format!("\n{count} of these designs never make a contact whose force a cost tracks."),
    }
}
