//! Results to draw, and what snapshots keep of figures.
#![allow(dead_code)]

use std::path::{Path, PathBuf};

use serde_json::Value;
use supple::Stop;
use supple::design::{DesignStatus, GradientKind, InformationWeights, Method};
use supple::{EvaluateOptions, Named};
use supple_figures::Figure;
use supple_study::bound::BoundOptions;
use supple_study::evaluate::EvaluateReport;
use supple_study::pareto::{Pareto, ParetoOptions, ParetoPoint};
use supple_study::robustness::{DesignChoice, PlannedFor, RobustCell, RobustDesign, Robustness, RobustnessOptions};
use supple_study::study::Work;
use supple_study::sweep::{self, Axis, SweepOptions};
use supple_study::trace::{Trace, TraceOptions, TracePoint, TraceRun};
use supple_study::{Folder, LoadedTask, Made, Silent, StudyResult, Watch};

pub fn task() -> LoadedTask {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass_small.toml");
    LoadedTask::load(&path).unwrap()
}

pub fn folder(name: &str, result: StudyResult) -> Folder {
    Folder { path: PathBuf::from(name), made: Made::of(&task(), Work::Evaluate(Default::default())), result }
}

pub fn design() -> Folder {
    let task = task();
    let watch = Watch::default();
    let settings = supple::design::DesignSettings { starts: 1, ..task.problem.design.clone() };
    folder("design", StudyResult::Design(Box::new(supple_study::design::run(&task, &settings, None, watch).unwrap())))
}

pub fn evaluate() -> Folder {
    let task = task();
    let wanted = EvaluateOptions { trajectories: true, ..Default::default() };
    let evaluation = task.problem.evaluate(&task.phi, &wanted).unwrap();
    folder("evaluate", StudyResult::Evaluate(Box::new(EvaluateReport { evaluation })))
}

pub fn sweep(axes: &[&str]) -> Folder {
    let task = task();
    let axes = axes.iter().map(|text| Axis::parse(text, &task).unwrap()).collect();
    let options = SweepOptions { axes, rollouts: 0, starts: 0, branches: 0, seed: 0 };
    let found = sweep::run(&task, &options, None, Watch { progress: &Silent, stop: Stop::never() }).unwrap();
    folder("sweep", StudyResult::Sweep(Box::new(found)))
}

pub fn bound() -> Folder {
    let task = task();
    let options = BoundOptions { curve: Some(5), ..Default::default() };
    let watch = Watch::default();
    folder("bound", StudyResult::Bound(Box::new(supple_study::bound::run(&task, &options, watch).unwrap())))
}

fn named(k1: f64, k2: f64) -> Named {
    Named(vec![("k1".into(), k1), ("k2".into(), k2)])
}

pub fn trace() -> Folder {
    let point = |k1: f64, k2: f64| TracePoint { parameters: named(k1, k2), information_nats: k1, costs: vec![k2] };
    let run = |gradient, end: f64| TraceRun {
        method: Method::Sqp,
        gradient,
        start: 0,
        status: DesignStatus::Converged,
        path: vec![point(60.0, 30.0), point(40.0, 35.0)],
        steps: vec![0, 1],
        end: point(20.0, end),
        error: None,
    };
    let gradients = vec![GradientKind::Total, GradientKind::Frozen];
    let options = TraceOptions { starts: 1, methods: vec![Method::Sqp], gradients, seed: 0 };
    let runs = vec![run(GradientKind::Total, 40.0), run(GradientKind::Frozen, 10.0)];
    folder("trace", StudyResult::Trace(Box::new(Trace { options, runs, stopped: false })))
}

pub fn pareto() -> Folder {
    let point = |index: usize| {
        let factor = 0.8 + 0.1 * index as f64;
        ParetoPoint {
            factor,
            bounds: vec![25.0 * factor],
            status: if index == 0 { DesignStatus::NotConverged } else { DesignStatus::Converged },
            parameters: named(100.0 / factor, 20.0 * factor),
            information_nats: 80.0 / factor,
            task_nats: vec![80.0 / factor],
            costs: vec![25.0 * factor],
            prices: vec![1.0],
            price: None,
            at_ends: Vec::new(),
            warnings: Vec::new(),
            trust: Vec::new(),
        }
    };
    let options = ParetoOptions { points: 4, starts: 1, seed: 0 };
    let points = (0..4).map(point).collect();
    folder("pareto", {
        let (information, bounds, remarks) = (InformationWeights::MEASURED, vec![25.0], vec![]);
        StudyResult::Pareto(Box::new(Pareto { options, information, bounds, points, remarks, stopped: false }))
    })
}

pub fn robustness() -> Folder {
    let task = task();
    let vary = Axis::parse("k1=log:20:120:3", &task).unwrap();
    let cell = |design: usize, planned_for, level: usize| {
        let mean = 20.0 + 5.0 * (level * (design + 1)) as f64;
        // One point could not be computed.
        let mean = if design == 0 && level == 2 { f64::NAN } else { mean };
        let quantiles = [-4.0, -1.0, 0.0, 2.0, 9.0].map(|more| mean + more);
        let expected = (planned_for == PlannedFor::Truth).then_some(mean + 0.5);
        let (deviation, confidence) = (3.0, 1.5);
        RobustCell {
            design,
            task: 0,
            planned_for,
            level,
            mean,
            deviation,
            half_width_95: confidence,
            quantiles,
            expected,
            diverged: 0,
            error: None,
        }
    };
    let cells = (0..2).flat_map(|design| {
        let both = [PlannedFor::Nominal, PlannedFor::Truth].into_iter();
        both.flat_map(move |planned| (0..3).map(move |level| cell(design, planned, level)))
    });
    let design = |name: &str, k1| RobustDesign {
        name: name.into(),
        parameters: named(k1, 30.0),
        information_nats: k1,
        status: None,
        warnings: Vec::new(),
    };
    let designs = vec![DesignChoice::Start, DesignChoice::Optimum];
    let study = Robustness {
        options: RobustnessOptions { designs, vary, rollouts: 20, seed: 0 },
        nominal: 60.0,
        designs: vec![design("start", 60.0), design("optimum", 20.0)],
        cells: cells.collect(),
        comparisons: Vec::new(),
        stopped: false,
    };
    folder("robustness", StudyResult::Robustness(Box::new(study)))
}

/// A figure with rounded numbers, and with long rows of them as their count, ends and range.
pub fn summary(figure: &Figure) -> Value {
    shortened(serde_json::to_value(figure).unwrap())
}

fn shortened(value: Value) -> Value {
    match value {
        Value::Array(list) if list.len() > 6 && list.iter().all(|entry| entry.is_number() || entry.is_null()) => {
            let numbers: Vec<f64> = list.iter().map(|entry| entry.as_f64().unwrap_or(f64::NAN)).collect();
            let (low, high) = numbers.iter().fold((f64::NAN, f64::NAN), |(a, b), v| (a.min(*v), b.max(*v)));
            let [first, last] = [numbers[0], numbers[numbers.len() - 1]].map(rounded);
            let (low, high) = (rounded(low), rounded(high));
            Value::String(format!("{} from {first} to {last}, within {low} and {high}", numbers.len()))
        }
        Value::Array(list) => list.into_iter().map(shortened).collect(),
        Value::Object(map) => map.into_iter().map(|(key, value)| (key, shortened(value))).collect(),
        Value::Number(number) if !number.is_u64() => {
            rounded(number.as_f64().unwrap()).parse::<f64>().map_or(Value::Null, Value::from)
        }
        other => other,
    }
}

/// To three digits that count; what is all but nothing is nothing.
fn rounded(value: f64) -> String {
    if value.abs() < 1e-9 { "0".into() } else { format!("{:e}", format!("{value:.2e}").parse::<f64>().unwrap()) }
}
