use std::fmt::Write;

use supple::design::{DesignStatus, GradientKind, Method};
use supple_study::About;
use supple_study::trace::{Trace, TraceRun};

use crate::tables::{align_right, heading, number, table};

/// Ends whose information is within this share of the least one's count as the same.
const SAME_END: f64 = 1e-4;

/// The page of `supple trace`.
pub fn trace_page(about: &About, study: &Trace) -> String {
    let mut header = vec![
        "method".to_owned(),
        "gradient".into(),
        "converged".into(),
        "within limits".into(),
        "information, bits".into(),
    ];
    header.extend(about.tasks.iter().map(|task| format!("cost of {}", task.name)));
    header.push("evaluations".into());
    let mut rows = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    for (method, gradient) in kinds(study) {
        let runs: Vec<&TraceRun> =
            study.runs.iter().filter(|run| (run.method, run.gradient) == (method, gradient)).collect();
        let count = |wanted: &dyn Fn(&TraceRun) -> bool| {
            format!("{} of {}", runs.iter().filter(|run| wanted(run)).count(), runs.len())
        };
        let bits = |run: &&TraceRun| run.end.information_nats / std::f64::consts::LN_2;
        let mut row = vec![
            method.to_string(),
            gradient.to_string(),
            count(&|run| run.status == DesignStatus::Converged),
            count(&TraceRun::is_within),
            spread(runs.iter().map(bits)),
        ];
        for task in 0..about.tasks.len() {
            row.push(spread(runs.iter().filter_map(|run| run.end.costs.get(task).copied())));
        }
        row.push(runs.iter().map(|run| run.path.len()).sum::<usize>().to_string());
        rows.add_row(row);
    }
    align_right(&mut rows, 2..header.len());
    let mut page = heading(about);
    let _ = writeln!(page, "{rows}\n\n{}", best(study));
    if let Some(stopped) = stopped_trace(study) {
        let _ = writeln!(page, "Warning: {stopped}.");
    }
    for run in &study.runs {
        if let Some(error) = &run.error {
            let _ = writeln!(page, "{} {}, start {}: {error}", run.method, run.gradient, run.start + 1);
        }
    }
    page
}

/// How far a study of traces is that was stopped.
pub fn stopped_trace(study: &Trace) -> Option<String> {
    let ended = study.runs.iter().filter(|run| run.status != DesignStatus::Stopped).count();
    let total = kinds(study).len() * study.options.starts;
    study.stopped.then(|| {
        let ended = if ended == 0 { "none".to_owned() } else { ended.to_string() };
        format!("stopped: {ended} of {total} searches had finished; unfinished searches are stored up to this point")
    })
}

/// Methods and gradients in the order of the runs.
fn kinds(study: &Trace) -> Vec<(Method, GradientKind)> {
    let gradients = |&method: &Method| study.options.gradients.iter().map(move |&gradient| (method, gradient));
    study.options.methods.iter().flat_map(gradients).collect()
}

/// The least and the greatest of some numbers.
fn spread(values: impl Iterator<Item = f64>) -> String {
    let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match number(least) == number(greatest) {
        _ if values.is_empty() => "none".to_owned(),
        true => number(least),
        false => format!("{} to {}", number(least), number(greatest)),
    }
}

/// Who found the best design.
fn best(study: &Trace) -> String {
    let Some(best) = study.best() else {
        return "No search ended at a design within all cost limits.\n".to_owned();
    };
    let least = best.end.information_nats;
    let within = study.runs.iter().filter(|run| run.is_within());
    let same = within.filter(|run| (run.end.information_nats - least).abs() <= SAME_END * least.abs()).count();
    let values: Vec<String> =
        best.end.parameters.0.iter().map(|(name, value)| format!("{name} = {}", number(*value))).collect();
    format!(
        "The best design, {}, has {} bits; {} with the {} gradient found it from start {}.\n{same} of {} searches met all \
         cost limits and ended within {} % of its information. Seed {}.\n",
        values.join(", "),
        number(least / std::f64::consts::LN_2),
        best.method,
        best.gradient,
        best.start + 1,
        study.runs.len(),
        100.0 * SAME_END,
        study.options.seed
    )
}
