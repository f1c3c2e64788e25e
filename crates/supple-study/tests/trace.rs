//! Traces: what searches visit, and where they end.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use supple::Stop;
use supple::design::{Control, DesignSettings, DesignStatus, GradientKind, Method, design};
use supple_study::trace::{Trace, TraceOptions, run};
use supple_study::{LoadedTask, Silent, StudyError, Watch};

fn load(name: &str) -> LoadedTask {
    LoadedTask::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks").join(name)).unwrap()
}

fn trace(task: &LoadedTask, options: &TraceOptions) -> Result<Trace, StudyError> {
    run(task, options, None, Watch::default())
}

fn options() -> TraceOptions {
    let methods = vec![Method::Sqp, Method::Barrier];
    TraceOptions { starts: 3, methods, gradients: vec![GradientKind::Total, GradientKind::Frozen], seed: 7 }
}

#[test]
fn traces_begin_at_the_same_starts_and_end_where_designs_end() {
    let task = load("two_mass.toml");
    let found = trace(&task, &options()).unwrap();
    assert_eq!(found.runs.len(), 2 * 2 * 3);
    for (number, kind) in found.runs.chunks(3).enumerate() {
        let (method, gradient) = (kind[0].method, kind[0].gradient);
        assert_eq!((method, gradient), (options().methods[number / 2], options().gradients[number % 2]));
        let settings = DesignSettings { method, gradient, starts: 3, seed: 7, ..task.problem.design.clone() };
        let control = Control::default();
        let alone = design(&task.problem, &task.phi, &settings, control).unwrap();
        for (start, (run, summary)) in kind.iter().zip(&alone.starts).enumerate() {
            let values = |named: &supple::Named| named.0.iter().map(|(_, value)| *value).collect::<Vec<_>>();
            assert_eq!((run.start, run.status), (start, summary.status));
            assert_eq!(values(&run.end.parameters), summary.to);
            assert_eq!((run.end.information_nats, &run.end.costs), (summary.information, &summary.costs));
            assert_eq!(run.path.len(), summary.evaluations);
            assert_eq!(values(&run.path[0].parameters), summary.from);
            assert_eq!(run.path[0].parameters, found.runs[start].path[0].parameters, "the same start for every kind");
            assert!(run.path.iter().any(|point| point.parameters == run.end.parameters), "the end is on the path");
        }
    }
    assert!(found.runs[..3].iter().all(|run| run.status == DesignStatus::Converged), "SQP by the total gradient");
    assert_eq!(values_of_first(&found), task.phi, "the first start is the task's");
}

fn values_of_first(found: &Trace) -> Vec<f64> {
    found.runs[0].path[0].parameters.0.iter().map(|(_, value)| *value).collect()
}

#[test]
fn the_same_on_any_number_of_threads() {
    let task = load("two_mass_small.toml");
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| trace(&task, &options()).unwrap())
    };
    assert_eq!(run(1), run(5));
}

#[test]
fn what_is_asked_for_twice_or_not_at_all_is_an_error() {
    let task = load("two_mass_small.toml");
    let twice = TraceOptions { methods: vec![Method::Sqp, Method::Sqp], ..options() };
    assert!(trace(&task, &twice).unwrap_err().to_string().contains("the method sqp is named twice"));
    let none = TraceOptions { gradients: Vec::new(), ..options() };
    assert!(trace(&task, &none).unwrap_err().to_string().contains("no gradient is named"));
    let flag = AtomicBool::new(true);
    let watch = Watch { progress: &Silent, stop: Stop::when(&flag) };
    assert!(matches!(run(&task, &options(), None, watch), Err(StudyError::Stopped)));
}
