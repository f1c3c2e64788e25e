//! Controllers taken from results: as C that is compiled and run, as JSON, and what is refused.
#![allow(clippy::print_stderr, clippy::print_stdout, clippy::unwrap_used)]

mod compiled;
mod files;

use std::path::{Path, PathBuf};

use supple::EvaluateOptions;
use supple_study::controller::ExportedController;
use supple_study::evaluate::EvaluateReport;
use supple_study::study::Work;
use supple_study::{Folder, LoadedTask, Made, StudyResult};

/// A file of the repository.
fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// A shipped task.
fn shipped(name: &str) -> LoadedTask {
    LoadedTask::load(&repository("tasks").join(name)).unwrap()
}

/// A shipped task with `from` replaced in its file, which must be there.
fn edited(name: &str, from: &str, to: &str) -> LoadedTask {
    let mut sources = shipped(name).sources;
    assert!(sources[0].text.contains(from), "{name} has no `{from}`");
    sources[0].text = sources[0].text.replace(from, to);
    LoadedTask::restore(&sources).unwrap()
}

/// A task at its initial parameters, evaluated.
fn evaluated(task: &LoadedTask, seed: u64) -> Folder {
    let wanted = EvaluateOptions { seed, trajectories: true, ..Default::default() };
    let evaluation = task.problem.evaluate(&task.phi, &wanted).unwrap();
    let result = StudyResult::Evaluate(Box::new(EvaluateReport { evaluation }));
    Folder {
        path: PathBuf::new(),
        made: Made::of(task, Work::Evaluate(supple_study::evaluate::EvaluateOptions { seed, ..Default::default() })),
        result,
    }
}

/// The controller of a task of an evaluation, and the measurements of its run in closed loop with the plant itself.
fn exported(folder: &Folder, name: Option<&str>) -> (ExportedController, Vec<Vec<f64>>) {
    let exported = ExportedController::of(folder, None, name, None).unwrap();
    let StudyResult::Evaluate(report) = &folder.result else { panic!("no evaluation") };
    let task = report.evaluation.tasks.iter().find(|task| task.name == exported.task.name).unwrap();
    (exported, task.trajectory.as_ref().unwrap().sample.measurements.clone())
}
