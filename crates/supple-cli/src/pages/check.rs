use std::fmt::Write;

use supple::check::{CheckReport, Row, TaskCheck, VISIBLE};
use supple_study::About;

use crate::tables::{align_right, heading, number, table};

/// Maximum number of list entries to print.
const NAMED: usize = 8;

/// The page of `supple check`.
pub fn check_page(about: &About, report: &CheckReport) -> String {
    let mut page = heading(about);
    for task in &report.tasks {
        let _ = writeln!(page, "{}: plan {}, stationarity {:.1e}\n", task.name, task.status, task.stationarity);
        let mut rows = table(&["derivative", "worst error", "tolerance", "at", "analytic", "finite difference", ""]);
        for row in &task.rows {
            rows.add_row([
                row.name.clone(),
                format!("{:.1e}", row.error),
                format!("{:.1e}", row.tolerance),
                row.place.clone(),
                format!("{:.6e}", row.analytic),
                format!("{:.6e}", row.numeric),
                if row.passed { String::new() } else { "FAILS".into() },
            ]);
        }
        align_right(&mut rows, 1..3);
        let _ = writeln!(page, "{rows}\n");
        page.push_str(&notes(task));
        let mut facts = table(&["knots", "", ""]);
        for fact in &task.facts {
            facts.add_row([fact.name.clone(), number(fact.value), fact.note.clone()]);
        }
        let _ = writeln!(page, "{facts}\n");
    }
    page.push_str(if report.passed { "All derivatives agree.\n" } else { "Some derivatives do not agree.\n" });
    page
}

/// What the check did not cover.
fn notes(task: &TaskCheck) -> String {
    let mut text = String::new();
    let mut note = |of: &Row, entries: &[String], what: &str| {
        if !entries.is_empty() {
            let _ = writeln!(text, " {}: {what}: {}.", of.name, shortened(entries, ", "));
        }
    };
    for row in &task.rows {
        note(row, &row.not_compared, "not compared: no neighbouring point could be evaluated");
        let small = format!("too small relative to rounding to detect an error of {VISIBLE}");
        note(row, &row.unresolved, &small);
    }
    if !task.left_out.is_empty() {
        let _ = writeln!(text, " Left out of the differences: {}.", shortened(&task.left_out, "; "));
    }
    if text.is_empty() { text } else { text + "\n" }
}

fn shortened(list: &[String], between: &str) -> String {
    let named = list[..list.len().min(NAMED)].join(between);
    if list.len() > NAMED { format!("{named} and {} more", list.len() - NAMED) } else { named }
}
