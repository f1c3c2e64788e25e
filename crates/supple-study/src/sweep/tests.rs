#![allow(clippy::unwrap_used)]

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use supple::ParameterHandle;
use supple::Problem;
use supple::Stop;

use super::*;
use crate::{Cell, Progress, Silent, Table};

/// Nobody looks, and nobody stops.
pub const RUNNING: Watch = Watch { progress: &Silent, stop: Stop::never() };

/// Stops once a number of points are kept.
pub struct StopAfter(pub u64, pub AtomicBool, AtomicU64);

impl StopAfter {
    pub fn new(points: u64) -> Self {
        Self(points, AtomicBool::new(false), AtomicU64::new(0))
    }

    pub fn watch(&self) -> Watch<'_> {
        Watch { progress: self, stop: Stop::when(&self.1) }
    }
}

impl Progress for StopAfter {
    fn begin(&self, _: &str, _: u64, _: u64) {}

    fn advance(&self, parts: u64) {
        if self.2.fetch_add(parts, Ordering::Relaxed) + parts >= self.0 {
            self.1.store(true, Ordering::Relaxed);
        }
    }
}

/// A shipped task with parameters of both roles.
pub fn task() -> LoadedTask {
    LoadedTask::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/two_mass.toml")).unwrap()
}

/// A plain sweep over axes.
pub fn options(task: &LoadedTask, axes: &[&str]) -> SweepOptions {
    let axes = axes.iter().map(|axis| Axis::parse(axis, task).unwrap()).collect();
    SweepOptions { axes, rollouts: 0, starts: 0, branches: 0, seed: 0 }
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

#[test]
fn the_table_is_the_same_on_any_number_of_threads() {
    let task = task();
    let plain = options(&task, &["drive_variance=log:1e-3:1e-2:2", "k2=log:100:600:20"]);
    let sampled = SweepOptions { rollouts: 3, seed: 5, ..options(&task, &["k1=60,500", "k2=100,600"]) };
    let designed = SweepOptions { starts: 2, seed: 5, ..options(&task, &["k1=300,500"]) };
    for options in [plain, sampled, designed] {
        let table = |threads| {
            let table = on_threads(threads, || run(&task, &options, None, RUNNING)).unwrap().table;
            assert_eq!(table.rows.len(), options.points());
            (table.to_csv(), table.to_jsonl())
        };
        let first = table(1);
        assert!(table(2) == first && table(8) == first);
    }
}

#[test]
fn a_point_is_what_evaluate_finds_unless_its_neighbour_leads_to_a_cheaper_plan() {
    let task = task();
    let options = SweepOptions { rollouts: 4, seed: 9, ..options(&task, &["k1=100,400", "k2=log:100:600:5"]) };
    let table = run(&task, &options, None, RUNNING).unwrap().table;
    let column = |name: &str| table.numbers(name).unwrap();
    let mut same = 0;
    for point in 0..10 {
        let phi: Vec<f64> = task.problem.parameters.iter().map(|p| column(&p.name)[point]).collect();
        let wanted = supple::EvaluateOptions { rollouts: 4, seed: 9, ..Default::default() };
        let found = task.problem.evaluate(&phi, &wanted).unwrap();
        let nominal = found.tasks[0].cost.parts.nominal;
        assert!(column("press.nominal_cost")[point] <= nominal);
        if column("press.nominal_cost")[point] == nominal {
            same += 1;
            let sampled = found.tasks[0].monte_carlo.as_ref().unwrap();
            for (name, expected) in [
                ("information_nats", found.objective.information_nats),
                ("information_bits", found.objective.information_bits),
                ("feasible", f64::from(u8::from(found.feasible))),
                ("press.information_nats", found.tasks[0].information.total_nats),
                ("press.bits_per_second", found.tasks[0].information.bits_per_second),
                ("press.expected_cost", found.tasks[0].cost.expected),
                ("press.sampled_cost_mean", sampled.cost_mean),
                ("press.sampled_cost_standard_error", sampled.cost_standard_error),
            ] {
                assert_eq!(column(name)[point], expected, "{name} at point {point}");
            }
        }
    }
    assert!(same >= 5, "{same} of 10 points");
}

#[test]
fn designs_hold_the_parameters_on_axes() {
    let task = task();
    let options = SweepOptions { starts: 2, seed: 1, ..options(&task, &["k1=300,500"]) };
    let table = run(&task, &options, None, RUNNING).unwrap().table;
    assert_eq!(table.numbers("k1").unwrap(), [300.0, 500.0]);
    let mut held = super::tests::task();
    held.problem.parameters = held.problem.parameters.held([ParameterHandle::at(0)]);
    for (point, k1) in [300.0, 500.0].into_iter().enumerate() {
        let settings = supple::design::DesignSettings { starts: 2, seed: 1, ..held.problem.design.clone() };
        let control = supple::design::Control { observer: &supple::design::NoObserver, stop: Stop::never() };
        let found = supple::design::design(&held.problem, &[k1, 500.0, 1e-4, 5e-3], &settings, control).unwrap();
        let best = &found.starts[found.best];
        let [k2, nats] = ["k2", "information_nats"].map(|name| table.numbers(name).unwrap()[point]);
        assert_eq!((k2, best.to[0]), (best.to[1], k1));
        assert!(k2 != 500.0 && (nats - best.information).abs() < 1e-9 * nats, "{k1} {k2} {nats}");
        assert_eq!(table.rows[point][table.column("design_status").unwrap()], Cell::Text(found.status.to_string()));
    }
    let nothing = SweepOptions {
        axes: [options.axes.clone(), vec![Axis::parse("k2=100,200", &task).unwrap()]].concat(),
        ..options
    };
    let error = run(&task, &nothing, None, RUNNING).unwrap_err().to_string();
    assert!(error.contains("there is nothing to design"), "{error}");
}

#[test]
fn a_table_comes_back_from_its_folder() {
    let task = task();
    let folder = tempfile::tempdir().unwrap();
    let sweep = run(&task, &options(&task, &["k1=60,500", "k2=100,600"]), Some(folder.path()), RUNNING).unwrap();
    assert!(sweep.complete);
    sweep.save_table(folder.path()).unwrap();
    let bare = || Sweep { table: Table::default(), ..sweep.clone() };
    let mut read = bare();
    read.load_table(folder.path()).unwrap();
    assert_eq!(read, sweep);
    let path = folder.path().join(TABLE_JSONL);
    let text = std::fs::read_to_string(&path).unwrap();
    let first = text.find('\n').unwrap();
    for (damaged, said) in [
        (text[first + 1..].to_owned(), "has 3 rows, not 4"),
        (text[..text.len() - 20].to_owned(), "line 4: "),
        (text.replacen("\"k1\"", "\"k9\"", 1), "line 1: its names are not those of the columns"),
        ("{}\n".repeat(4), "line 1: its names are not those of the columns"),
        ("[1]\n".to_owned() + &text, "line 1: "),
    ] {
        std::fs::write(&path, damaged).unwrap();
        let error = bare().load_table(folder.path()).unwrap_err().to_string();
        assert!(error.contains(TABLE_JSONL) && error.contains(said), "{error}");
    }
    std::fs::remove_file(&path).unwrap();
    assert!(bare().load_table(folder.path()).unwrap_err().to_string().contains(TABLE_JSONL));
}

#[test]
fn a_stopped_sweep_has_the_rows_that_are_done() {
    let task = task();
    let stop = StopAfter::new(5);
    let sweep = run(&task, &options(&task, &["k1=50:600:60"]), None, stop.watch()).unwrap();
    assert!(!sweep.complete && (5..60).contains(&sweep.table.rows.len()), "{}", sweep.table.rows.len());
}

#[test]
fn a_neighbour_that_leads_to_a_cheaper_plan_is_followed_and_no_other() {
    let good = task();
    let text = good.sources[0].text.replace("initial_control = [57.0]", "initial_control = [0.0]");
    let poor = supple_file::parse(&text, "poor.toml").unwrap();
    let plan = |problem: &Problem, neighbour: Option<&supple::Matrices>| {
        let task = &problem.tasks[0];
        let mut state = supple::pipeline::TaskState::new(task);
        supple::design::best_plan(problem, task, &good.phi, neighbour, &mut state).unwrap();
        (state.plan.nominal_cost, state.plan.trajectory.controls)
    };
    let (best, controls) = plan(&good.problem, None);
    let (worse, poor_controls) = plan(&poor, None);
    assert!(best < worse - 1.0, "{best} and {worse}");
    assert!((plan(&poor, Some(&controls)).0 - best).abs() < 1e-9 * best);
    // The same bits as without a neighbour, whether that is worse or on the same branch.
    for neighbour in [&poor_controls, &controls] {
        let (cost, found) = plan(&good.problem, Some(neighbour));
        assert!(cost == best && found.as_slice() == controls.as_slice());
    }
}

#[test]
fn units_done_elsewhere_in_any_order_make_the_same_table() {
    let task = task();
    let plain = options(&task, &["k1=300,400", "k2=log:100:600:40"]);
    let designed = SweepOptions { starts: 1, seed: 5, ..options(&task, &["k1=300,500"]) };
    for options in [plain, designed] {
        let expected = run(&task, &options, None, RUNNING).unwrap();
        let folder = tempfile::tempdir().unwrap();
        // Stopped in the middle of a segment, or not at all where there are only a few points.
        let stop = StopAfter::new(20);
        run(&task, &options, Some(folder.path()), stop.watch()).unwrap();
        let units = SweepUnits::new(&task, &options).unwrap();
        for path in [None, Some(folder.path())] {
            let mut collector = Collector::open(&task, &options, path).unwrap();
            let (before, points) = collector.points();
            assert_eq!(points, options.points());
            let given: Vec<SweepUnit> = std::iter::from_fn(|| collector.next_unit(2)).collect();
            let mut kept = 0;
            for unit in given.into_iter().rev() {
                let rows = units.work(&unit, Stop::never()).unwrap();
                let others = vec![(unit.clone(), rows[1..].to_vec())];
                assert!(collector.keep(&others).unwrap_err().to_string().contains("do not belong to point"));
                kept += collector.keep(&[(unit.clone(), rows.clone())]).unwrap();
                assert!(collector.keep(&[(unit, rows)]).is_err());
            }
            assert_eq!(kept, points - before);
            assert_eq!(collector.finish().unwrap(), expected);
        }
        let stopped = AtomicBool::new(true);
        let unit = Collector::open(&task, &options, None).unwrap().next_unit(1).unwrap();
        assert!(matches!(units.work(&unit, Stop::when(&stopped)), Err(StudyError::Stopped)));
    }
}
