//! Terms of the cost along plans, as text.

use supple::{TargetReport, TaskEvaluation};
use supple_text::short;

use crate::tables::{Rows, align_right, first_lines, number, table, title, with_unit};

/// What each term of a task's cost costs, and what became of the numbers that it weighs; `None` if the terms are not known, or all 0.
pub fn table_of(task: &TaskEvaluation) -> Option<Rows> {
    let terms = &task.cost.terms;
    if terms.iter().all(|term| term.total() == 0.0) {
        return None;
    }
    let mut rows = table(&["cost", "nominal", "share", "weighs", "target", "at start", "mean", "at end"]);
    for term in terms {
        let share = term.share(task.cost.parts.nominal);
        let share = share.map_or_else(String::new, |share| format!("{} %", short(100.0 * share, 2)));
        let mut cells = [term.name.clone(), number(term.total()), share];
        let shown = term.shown();
        if shown.is_empty() {
            rows.add_row(&cells);
        }
        let is_one_of_many = shown.len() < term.targets.len();
        for target in shown {
            let named = title(&target.name, &target.unit);
            let named = match is_one_of_many {
                true => format!("{named} (the farthest of {})", term.targets.len()),
                false => named,
            };
            let [at_target, start, mean, end] = [target.target, target.start, target.mean, target.end].map(number);
            rows.add_row(cells.iter().cloned().chain([named, at_target, start, mean, end]));
            cells = Default::default();
        }
    }
    align_right(&mut rows, 1..3);
    align_right(&mut rows, 4..8);
    Some(rows)
}

/// A line for each target that the plan of a task misses by far.
pub fn missed(task: &TaskEvaluation) -> String {
    let line = |(term, target): (&str, &TargetReport)| {
        let TargetReport { name, unit, start, end, target, .. } = target;
        let [start, target] = [number(*start), with_unit(*target, unit)];
        format!(
            "`{name}` of cost {term} ends at {} on its way from {start} to {target}: raise `final_weight` or `steps` if {} is to \
             reach its target.\n",
            number(*end),
            task.name
        )
    };
    let lines: Vec<String> = task.cost.missed_targets().map(line).collect();
    first_lines(lines.into_iter())
}
