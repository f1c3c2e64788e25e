//! Studies that were stopped resume from their journal to the result of an uninterrupted one, bit for bit.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use serde::Serialize;
use supple::Stop;
use supple::design::{DesignSettings, GradientKind, Method};
use supple::parameters::Scale;
use supple_study::design::{self, DesignReport};
use supple_study::pareto::{self, ParetoOptions};
use supple_study::robustness::{self, DesignChoice, RobustnessOptions};
use supple_study::sweep::Axis;
use supple_study::trace::{self, TraceOptions};
use supple_study::{JOURNAL, LoadedTask, Progress, Silent, StudyError, Watch, kept_parts};

static AT_ONCE: AtomicBool = AtomicBool::new(true);

/// Nobody looks, and nobody stops.
const RUNNING: Watch = Watch { progress: &Silent, stop: Stop::never() };

/// Tells a study to stop once so many parts are done.
struct StopAfter {
    parts: u64,
    done: AtomicU64,
    stop: AtomicBool,
}

impl Progress for StopAfter {
    fn begin(&self, _: &str, _: u64, _: u64) {}

    fn advance(&self, parts: u64) {
        if self.done.fetch_add(parts, Ordering::Relaxed) + parts >= self.parts {
            self.stop.store(true, Ordering::Relaxed);
        }
    }
}

fn small() -> LoadedTask {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass_small.toml");
    LoadedTask::load(&path).unwrap()
}

/// As JSON, where a price that is not a number equals itself and every other number keeps its bits.
fn json<T: Serialize>(found: &T) -> String {
    serde_json::to_string(found).unwrap()
}

/// Stops a study after some parts and resumes it; what it kept when it was stopped.
fn assert_resumes<T: Serialize>(parts: u64, run: impl Fn(Option<&Path>, Watch) -> Result<T, StudyError>) -> u64 {
    let whole = json(&run(None, RUNNING).unwrap());
    let kept_in = tempfile::tempdir().unwrap();
    let kept_in = kept_in.path();
    let folder = Some(kept_in);
    let stop = StopAfter { parts, done: AtomicU64::new(0), stop: AtomicBool::new(false) };
    match run(folder, Watch { progress: &stop, stop: Stop::when(&stop.stop) }) {
        Err(StudyError::Stopped) => {}
        found => assert_ne!(json(&found.unwrap()), whole, "it was not stopped"),
    }
    let kept = kept_parts(kept_in).unwrap();
    assert!(kept > 0);
    let resumed = run(folder, RUNNING).unwrap();
    assert_eq!(json(&resumed), whole);
    assert!(kept_parts(kept_in).unwrap() > kept);
    // All parts are there: nothing is left to compute, whatever the result is made of.
    assert_eq!(json(&run(folder, RUNNING).unwrap()), whole);
    kept
}

fn traces() -> TraceOptions {
    let gradients = vec![GradientKind::Total, GradientKind::Frozen];
    TraceOptions { starts: 3, methods: vec![Method::Sqp, Method::Barrier], gradients, seed: 7 }
}

fn noises(task: &LoadedTask, designs: &str) -> RobustnessOptions {
    let designs = DesignChoice::parse_list(designs, task).unwrap();
    let vary = Axis::parse_as("drive_variance=1e-4:1e-2:4", task, Scale::Log).unwrap();
    RobustnessOptions { designs, vary, rollouts: 4, seed: 2 }
}

#[test]
fn fronts_resume() {
    let task = small();
    let options = ParetoOptions { points: 5, starts: 2, seed: 3 };
    let run = |folder: Option<&Path>, watch: Watch| pareto::run(&task, &options, folder, watch);
    // The ends count as two: stopped as soon as both are known, and after the first point between them.
    for parts in [2, 3] {
        // From two starts each, and once from the other end.
        assert!(assert_resumes(parts, run) >= 5);
    }
}

/// The same without wall times.
fn timeless(mut found: DesignReport) -> DesignReport {
    (found.seconds, found.report_seconds) = (0.0, 0.0);
    found
}

#[test]
fn design_searches_resume() {
    let task = small();
    let settings = DesignSettings { starts: 5, rollouts: Some(2), ..task.problem.design.clone() };
    let run = |folder: Option<&Path>, watch: Watch| design::run(&task, &settings, folder, watch).map(timeless);
    assert!(assert_resumes(2, run) >= 1);
}

/// Tells a search to stop once so many combinations of catalogue entries are designed.
struct StopAmongCombinations {
    combinations: u64,
    stop: AtomicBool,
}

impl Progress for StopAmongCombinations {
    fn begin(&self, _: &str, _: u64, _: u64) {}

    fn advance(&self, _: u64) {}

    fn say(&self, found: &str) {
        if found.starts_with(&format!("{} of 12 combinations", self.combinations)) {
            self.stop.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn choices_from_catalogues_resume_among_their_combinations() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass_small.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let first = "bounds = [20.0, 120.0]\ncatalogue = [30.0, 50.0, 70.0, 90.0]";
    let text = text.replace("bounds = [20.0, 120.0]", first);
    let second = "bounds = [3.0, 50.0]\ncatalogue = [5.0, 10.0, 20.0]";
    let text = text.replace("bounds = [3.0, 50.0]", second);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("task.toml"), text).unwrap();
    let task = LoadedTask::load(&folder.path().join("task.toml")).unwrap();
    let settings = DesignSettings { starts: 1, rollouts: Some(2), ..task.problem.design.clone() };
    let run = |folder: Option<&Path>, watch: Watch| timeless(design::run(&task, &settings, folder, watch).unwrap());
    let whole = run(None, RUNNING);
    assert_eq!(whole.catalogue.as_ref().map(|found| (found.combinations, found.designed)), Some((12, 12)));
    let kept_in = tempfile::tempdir().unwrap();
    let stop = StopAmongCombinations { combinations: 4, stop: AtomicBool::new(false) };
    let stopped = run(Some(kept_in.path()), Watch { progress: &stop, stop: Stop::when(&stop.stop) });
    assert!(!stopped.catalogue.as_ref().unwrap().complete);
    let kept = kept_parts(kept_in.path()).unwrap();
    // The start and at least three combinations; some may have been under way on other threads.
    assert!((4..13).contains(&kept), "{kept}");
    assert_eq!(json(&run(Some(kept_in.path()), RUNNING)), json(&whole));
    assert_eq!(kept_parts(kept_in.path()).unwrap(), 13);
}

#[test]
fn traces_resume() {
    let task = small();
    assert!(assert_resumes(1, |folder, watch| trace::run(&task, &traces(), folder, watch)) >= 1);
}

#[test]
fn robustness_resumes_in_its_search_and_among_its_levels() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass.toml");
    let mut task = LoadedTask::load(&path).unwrap();
    task.problem.design.starts = 2;
    let options = noises(&task, "start,optimum");
    let run = |folder: Option<&Path>, watch: Watch| robustness::run(&task, &options, folder, watch);
    // One design is planned; one level is done.
    for parts in [1, 3] {
        assert!(assert_resumes(parts, run) >= 2);
    }
}

#[test]
fn what_is_kept_is_not_computed_again() {
    let task = small();
    let folder = tempfile::tempdir().unwrap();
    let stop = StopAfter { parts: 2, done: AtomicU64::new(0), stop: AtomicBool::new(false) };
    let watch = Watch { progress: &stop, stop: Stop::when(&stop.stop) };
    trace::run(&task, &traces(), Some(folder.path()), watch).unwrap();
    let kept = kept_parts(folder.path()).unwrap();
    // Told to stop from the start, it computes nothing: all that it has is what was kept.
    let watch = Watch { progress: &Silent, stop: Stop::when(&AT_ONCE) };
    let found = trace::run(&task, &traces(), Some(folder.path()), watch).unwrap();
    assert_eq!(found.runs.len() as u64, kept);
    assert!(found.stopped);
}

#[test]
fn another_study_is_refused_with_the_difference() {
    let task = small();
    let kept_in = tempfile::tempdir().unwrap();
    let kept_in = kept_in.path();
    let folder = Some(kept_in);
    let options = ParetoOptions { points: 3, starts: 1, seed: 3 };
    pareto::run(&task, &options, folder, RUNNING).unwrap();
    let bytes = std::fs::read(kept_in.join(JOURNAL)).unwrap();
    let refused = |error: StudyError, lines: &[&str]| {
        let text = error.to_string();
        assert!(matches!(error, StudyError::Kept { .. }) && text.contains("; give another --out, or remove the file"));
        lines.iter().for_each(|line| assert!(text.lines().any(|found| found == *line), "no `{line}` in\n{text}"));
        assert!(std::fs::read(kept_in.join(JOURNAL)).unwrap() == bytes, "the journal was changed");
    };
    let seed = ParetoOptions { seed: 4, ..options.clone() };
    refused(pareto::run(&task, &seed, folder, RUNNING).unwrap_err(), &["-seed 3", "+seed 4"]);
    let mut softer = small();
    softer.phi[0] *= 0.5;
    let name = &task.problem.parameters.get(0).name;
    let [was, is] =
        [(&task, '-'), (&softer, '+')].map(|(of, sign)| format!("{sign}parameter {name} = {:?}", of.phi[0]));
    refused(pareto::run(&softer, &options, folder, RUNNING).unwrap_err(), &[&was, &is]);
    let kinds = ["-study Pareto front", "+study study of traces", "+gradient frozen"];
    refused(trace::run(&task, &traces(), folder, RUNNING).unwrap_err(), &kinds);
}
