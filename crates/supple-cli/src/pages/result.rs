use std::fmt::Write;
use std::path::Path;

use supple_study::{About, Steps, StudyResult};

use super::bound::bound_page;
use super::design::{design_page, stopped_design};
use super::evaluation::evaluation_page;
use super::pareto::{pareto_page, stopped_front};
use super::robustness::{robustness_page, stopped_robustness};
use super::sensors::sensors_page;
use super::sweep::{sweep_page, table_page};
use super::trace::{stopped_trace, trace_page};
use crate::tables::heading;

/// The page of a result: what its command prints, and `supple show` again. `folder` is where it is kept.
pub fn result_page(about: &About, result: &StudyResult, folder: Option<&Path>) -> String {
    match (result, folder) {
        (StudyResult::Design(report), _) => design_page(about, report),
        (StudyResult::Evaluate(report), _) => evaluation_page(about, &report.evaluation),
        (StudyResult::Sweep(sweep), Some(folder)) => sweep_page(about, sweep, folder),
        (StudyResult::Sweep(sweep), None) => table_page(about, sweep),
        (StudyResult::Robustness(study), _) => robustness_page(about, study),
        (StudyResult::Pareto(study), _) => pareto_page(about, study),
        (StudyResult::Sensors(study), _) => sensors_page(about, study),
        (StudyResult::Trace(study), _) => trace_page(about, study),
        (StudyResult::Bound(study), _) => bound_page(about, study),
        (StudyResult::Study(study), folder) => study_page(about, study, folder.unwrap_or(Path::new(""))),
    }
}

fn study_page(about: &About, study: &Steps, folder: &Path) -> String {
    let mut page = heading(about);
    let mut line = |what: &str, path: &Path| {
        let _ = writeln!(page, "  {}: {what}", path.display());
    };
    for step in &study.steps {
        line("a step", &folder.join(step));
    }
    for figure in &study.figures {
        line("a figure", &folder.join(figure));
    }
    line("the report", &folder.join(crate::output::REPORT));
    page
}

/// How far a result is that was stopped; `None` if it was not.
pub fn stopped(result: &StudyResult) -> Option<String> {
    match result {
        StudyResult::Design(report) => stopped_design(report),
        StudyResult::Pareto(front) => stopped_front(front),
        StudyResult::Robustness(study) => stopped_robustness(study),
        StudyResult::Trace(study) => stopped_trace(study),
        _ => None,
    }
}
