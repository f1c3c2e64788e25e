use maud::{Markup, html};
use supple::simulate::MonteCarlo;
use supple::{Evaluation, LimitViolation, TaskEvaluation, Trust};
use supple_study::sweep::misses_contact;

use crate::numbers::number;
use crate::part::Part;
use crate::words;

/// That roll-outs contradict a plan, in words; `None` where they do not.
fn broken(trust: &Trust) -> Option<String> {
    trust.is_broken().then(|| format!("roll-outs: {trust}"))
}

/// What speaks against the plan of a task, about which the numbers in a folder are computed.
fn of_plan(folder: &str, task: &str, warnings: &[String], trust: Option<&Trust>, list: &mut Vec<String>) {
    let all = warnings.iter().cloned().chain(trust.and_then(broken));
    list.extend(all.map(|why| format!("In {folder}, about the plan of {task}: {why}.")));
}

/// What a reader must know before trusting the numbers of a part.
pub fn warnings(part: &Part) -> Vec<String> {
    let mut list = Vec::new();
    for shown in part.designs() {
        for task in &shown.at.tasks {
            of_task(&shown.name, shown.at, task, &mut list);
        }
    }
    for (folder, sweep) in part.sweeps().into_iter().filter(|(_, sweep)| !sweep.complete) {
        let rows = sweep.table.rows.len();
        list.push(format!("The sweep in {folder} is not complete: it has {rows} points."));
    }
    for (folder, sweep) in part.sweeps() {
        for column in sweep.table.columns.iter().filter(|column| misses_contact(column).is_some()) {
            let missed = sweep.table.numbers(&column.name).unwrap_or_default();
            let count = missed.iter().filter(|&&missed| missed == 1.0).count();
            let all = missed.len();
            if count > 0 {
                list.push(format!(
                    "In {folder}, {count} of {all} points have a plan that never makes a contact whose \
                     force a cost tracks (column {}).",
                    column.name
                ));
            }
        }
    }
    for (_, front) in part.fronts() {
        for point in &front.points {
            let at = |warning| format!("At factor {} of the front, {warning}.", number(point.factor));
            list.extend(point.warnings.iter().map(at));
            list.extend(
                point
                    .trust
                    .iter()
                    .filter_map(broken)
                    .map(|why| format!("At factor {} of the front, {why}.", number(point.factor))),
            );
        }
    }
    for (folder, study) in part.bounds() {
        for task in &study.report.tasks {
            of_plan(folder, &task.name, &task.warnings, task.trust.as_ref(), &mut list);
        }
    }
    for (folder, study) in part.sensors() {
        for plan in &study.plans {
            of_plan(folder, &plan.task, &plan.warnings, plan.trust.as_ref(), &mut list);
        }
    }
    for (folder, study) in part.robustness() {
        for design in &study.designs {
            list.extend(design.warnings.iter().map(|warning| format!("At {} in {folder}, {warning}.", design.name)));
        }
        let all = study.cells.len();
        let missing = study.cells.iter().filter(|cell| cell.is_missing()).count();
        if missing > 0 {
            list.push(format!("The study in {folder} was stopped before {missing} of {all} mean costs were computed."));
        }
        let failed = study.cells.iter().filter(|cell| !cell.is_missing());
        let failed = failed.filter(|cell| cell.error.is_some() || !cell.mean.is_finite()).count();
        if failed > 0 {
            list.push(format!(
                "In {folder}, {failed} of {all} mean costs could not be computed, or a roll-out diverged."
            ));
        }
    }
    for (folder, trace) in part.traces() {
        for error in trace.runs.iter().filter_map(|run| Some((run, run.error.as_ref()?))) {
            let (run, error) = error;
            let method = words::method(run.method, run.gradient);
            list.push(format!("In {folder}, the search from start {} ({method}) ended early: {error}.", run.start + 1));
        }
    }
    for (_, report) in part.searches() {
        let told = report.unconfirmed(part.about).map(|found| found.to_string()).into_iter().chain(report.rises());
        list.extend(told.map(|found| format!("{}.", supple_text::capitalised(&found))));
        for (index, error) in report.starts.iter().enumerate().filter_map(|(i, start)| Some((i, start.error.as_ref()?)))
        {
            list.push(format!("The search from start {} ended early: {error}.", index + 1));
        }
    }
    list
}

fn of_task(design: &str, at: &Evaluation, task: &TaskEvaluation, list: &mut Vec<String>) {
    let which = if at.tasks.len() > 1 { format!("{} at {design}", task.name) } else { format!("the task at {design}") };
    if !task.status.is_converged() {
        list.push(format!(
            "The plan of {which} {}; its numbers are those of the last iterate.",
            task.status.description()
        ));
    }
    if let Some(worst) = task.limits_violated.iter().max_by(|a, b| excess(a).total_cmp(&excess(b))) {
        let limits = words::count(task.limits_violated.len(), "limit");
        let steps = words::count(worst.steps, "step");
        let (name, numbers) = (plain(&worst.name), against(worst));
        list.push(format!(
            "The plan of {which} exceeds {limits}; the largest violation is {name}: {numbers}, at {steps}."
        ));
    }
    if task.stability.numerically_unstable {
        list.push(format!("In {which}, {}.", task.stability));
    }
    list.extend(task.warnings.iter().map(|warning| format!("At {design}, {warning}.")));
    if task.belief_repairs > 0 {
        let times = words::count(task.belief_repairs, "time");
        list.push(format!("In {which}, rounding errors in the covariance were corrected {times}."));
    }
    let total = task.gradient.as_ref().and_then(|gradient| gradient.total.as_ref());
    if total.is_some_and(|total| !total.valid) {
        list.push(format!("The plan of {which} is not stationary enough for its gradients to be valid."));
    }
}

/// A table of all limits that plans exceed; `None` if there are none.
pub fn limits(part: &Part) -> Option<Markup> {
    let mut rows = Vec::new();
    for shown in part.designs() {
        for task in &shown.at.tasks {
            rows.extend(task.limits_violated.iter().map(|limit| {
                let numbers = against(limit);
                vec![shown.name.clone(), task.name.clone(), plain(&limit.name), numbers, limit.steps.to_string()]
            }));
        }
    }
    let head = crate::html::words(["design", "task", "limit", "worst", "steps"]);
    folded("Limits that plans exceed", &head, &rows)
}

/// A table of all limits that roll-outs exceed; `None` if there are none.
pub fn limits_in_rollouts(part: &Part) -> Option<Markup> {
    let mut rows = Vec::new();
    for shown in part.designs() {
        for task in &shown.at.tasks {
            let exceeded = task.monte_carlo.iter().flat_map(MonteCarlo::limits_exceeded);
            rows.extend(exceeded.map(|(limit, finer)| {
                let side = if limit.upper { "at most" } else { "at least" };
                let bound = crate::numbers::with_unit(limit.limit, &limit.unit);
                let bound = format!("{}, {side} {bound}", plain(&limit.name));
                let [share, time] =
                    [limit.share, limit.share_of_time].map(|share| format!("{} %", number(100.0 * share)));
                let on_finer = finer.map_or_else(String::new, |finer| number(finer.worst));
                let [median, worst] = [limit.median, limit.worst].map(number);
                vec![shown.name.clone(), task.name.clone(), bound, share, time, median, worst, on_finer]
            }));
        }
    }
    let head = ["design", "task", "limit", "roll-outs", "time", "median", "worst", "worst on finer steps"];
    folded("Limits that roll-outs exceed", &crate::html::words(head), &rows)
}

/// A table that opens on demand; `None` without rows.
fn folded(title: &str, head: &[String], rows: &[Vec<String>]) -> Option<Markup> {
    let all = title.replacen('L', "All l", 1);
    (!rows.is_empty()).then(|| html! { details { summary { (all) } (crate::html::table(title, head, rows)) } })
}

/// How far outside a value is, relative to its limit.
fn excess(limit: &LimitViolation) -> f64 {
    (limit.worst - limit.limit).abs() / limit.limit.abs().max(f64::MIN_POSITIVE)
}

/// A value and the limit it is beyond.
fn against(limit: &LimitViolation) -> String {
    let side = if limit.worst > limit.limit { "above" } else { "below" };
    format!("{}, {side} {}", number(limit.worst), crate::numbers::with_unit(limit.limit, &limit.unit))
}

/// A name without the marks around it.
fn plain(name: &str) -> String {
    name.replace('`', "")
}
