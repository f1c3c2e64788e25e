//! Pareto fronts: their ends, their shape, and the design at the task's own bounds.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use supple::EvaluateOptions;
use supple::Stop;
use supple::design::{Control, DesignStatus, design};
use supple_study::pareto::{Pareto, ParetoOptions, ParetoPoint, run};
use supple_study::{LoadedTask, Silent, StudyError, Watch};

fn shipped(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks").join(name)).unwrap()
}

fn load(text: &str) -> LoadedTask {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("task.toml");
    std::fs::write(&path, text).unwrap();
    LoadedTask::load(&path).unwrap()
}

fn front(task: &LoadedTask, points: usize) -> Result<Pareto, StudyError> {
    let options = ParetoOptions { points, starts: 2, seed: 3 };
    run(task, &options, None, Watch::default())
}

/// Tightening never lowers information, and no point breaks its bounds.
fn assert_front(found: &Pareto) {
    for pair in found.points.windows(2) {
        assert!(pair[0].factor < pair[1].factor);
        assert!(pair[1].information_nats <= pair[0].information_nats * (1.0 + 1e-9), "{pair:?}");
    }
    for point in &found.points {
        for (cost, bound) in point.costs.iter().zip(&point.bounds) {
            assert!(*cost <= bound * (1.0 + 2e-6), "{point:?}");
        }
    }
}

#[test]
fn the_front_of_two_masses() {
    let task = load(&shipped("two_mass.toml"));
    let found = front(&task, 12).unwrap();
    assert_eq!(found.points.len(), 12);
    assert_front(&found);
    assert!(found.points.iter().all(|point| point.status == DesignStatus::Converged), "{:?}", found.points);

    // At the task's own bounds: what `supple design` finds.
    let own = found.points.iter().find(|point| point.factor == 1.0).unwrap();
    let control = Control::default();
    let best = design(&task.problem, &task.phi, &task.problem.design, control).unwrap();
    let best = &best.starts[best.best];
    assert!((own.information_nats - best.information).abs() < 1e-6 * best.information, "{own:?}");
    assert!((own.parameters.0[0].1 - best.to[0]).abs() < 1e-2, "{own:?}");
    assert!((own.prices[0] - best.multipliers[0]).abs() < 0.02 * best.multipliers[0], "{own:?}");

    // Prices are slopes of the front.
    for around in found.points[2..].windows(3).take(8) {
        let slope =
            (around[0].information_nats - around[2].information_nats) / (around[2].bounds[0] - around[0].bounds[0]);
        assert!((slope / around[1].prices[0] - 1.0).abs() < 0.25, "{slope}, {around:?}");
    }
    let (tight, loose) = (&found.points[0], &found.points[11]);
    assert!(tight.prices[0].is_nan() && loose.prices[0] == 0.0);

    // No design of a grid is cheaper than the tight end, nor needs less information than the loose one.
    let side = |bounds: [f64; 2]| (0..4).map(move |i| bounds[0] * (bounds[1] / bounds[0]).powf(i as f64 / 3.0));
    for k1 in side([50.0, 600.0]) {
        for k2 in side([100.0, 600.0]) {
            let phi = [k1, k2, task.phi[2], task.phi[3]];
            let at = task.problem.evaluate(&phi, &EvaluateOptions { branches: 16, ..Default::default() }).unwrap();
            assert!(at.tasks[0].cost.expected >= tight.costs[0] * (1.0 - 1e-6), "{k1}, {k2}: {tight:?}");
            assert!(at.objective.information_nats >= loose.information_nats * (1.0 - 1e-6), "{k1}, {k2}: {loose:?}");
        }
    }
}

/// With noisy sensors, plans of one branch end in the midst of the front: no plan that did not converge is taken for a
/// design, and what is searched for anew goes on from there.
#[test]
fn the_front_of_dear_sensors_crosses_branches() {
    let task = load(&shipped("two_mass_sensors.toml"));
    let found = front(&task, 10).unwrap();
    let worth = |point: &ParetoPoint| point.information_nats + task.problem.design.price_weight * point.price.unwrap();
    for pair in found.points.windows(2) {
        assert!(worth(&pair[1]) <= worth(&pair[0]) * (1.0 + 1e-9), "{pair:?}");
    }
    for point in &found.points {
        assert!(point.status != DesignStatus::BoundViolated, "{point:?}");
        assert!(point.costs[0] > 0.0 && point.costs[0] <= point.bounds[0] * (1.0 + 2e-6), "{point:?}");
        assert!(point.price.unwrap() <= 200.0 * (1.0 + 1e-6), "{point:?}");
    }
    let converged = found.points.iter().filter(|point| point.status == DesignStatus::Converged).count();
    assert!(converged >= 5, "{:?}", found.points);
    // Prices are inverse to the variances.
    let tight = &found.points[0];
    let of = |name: &str| tight.parameters.get(name).unwrap();
    let price = 0.05 / of("position_variance") + 0.5 / of("force_variance");
    assert!((tight.price.unwrap() / price - 1.0).abs() < 1e-12, "{tight:?}");
}

#[test]
fn several_tasks_share_one_factor() {
    let text = shipped("two_mass_small.toml");
    let (head, press) = text.split_once("[[tasks]]").unwrap();
    let second = press.replace("name = \"press\"", "name = \"again\"").replace("bound = 25.0", "bound = 15.0");
    let task = load(&format!("{head}[[tasks]]{press}\n[[tasks]]{second}"));
    let found = front(&task, 5).unwrap();
    assert_front(&found);
    assert_eq!(found.bounds, [25.0, 15.0]);
    for point in &found.points {
        assert!((point.information_nats - point.task_nats.iter().sum::<f64>()).abs() < 1e-9 * point.information_nats);
        // The same task twice: the tighter bound is the one that is active, and sets the factor at both ends.
        assert!((point.task_nats[0] - point.task_nats[1]).abs() < 1e-6 * point.task_nats[0]);
        assert_eq!(point.prices[0], 0.0, "{point:?}");
    }
    let (tight, loose) = (&found.points[0], &found.points[4]);
    assert!((tight.costs[1] / 15.0 - tight.factor).abs() < 1e-6 && (loose.costs[1] / 15.0 - loose.factor).abs() < 1e-9);
    assert!(
        found.remarks.iter().any(|it| it.text == "the cost limit of press is nowhere active"),
        "{:?}",
        found.remarks
    );
}

/// A parameter that changes the cost alone is free at the loose end. Of all its values the front ends at the cheapest: with
/// any other, its last points would cost more for the same information.
#[test]
fn the_front_ends_at_the_cheapest_of_designs_that_are_equally_informative() {
    let text = |bound: f64| {
        format!(
            r#"
            model = {{ kind = "linear", A = [[1.05]], B = [["g"]], C = [[1.0]] }}
            parameters.g = {{ initial = 0.3, bounds = [0.1, 2.0] }}
            parameters.v = {{ initial = 0.1, bounds = [0.01, 1.0], scale = "log" }}
            [[tasks]]
            name = "hold"
            steps = 10
            time_step = 0.1
            bound = {bound}
            initial_state = [1.0]
            noise = {{ initial = [1.0], process = [0.1], measurement = ["v"] }}
            costs = [{{ kind = "quadratic", Q = [[1.0]], R = [[0.2]] }}]
            "#
        )
    };
    let task = load(&text(20.0));
    let found = front(&task, 5).unwrap();
    assert_front(&found);
    // The cost at the noisiest sensor, least over the gain of the controls.
    let cost =
        |gain: f64| task.problem.evaluate(&[gain, 1.0], &EvaluateOptions::default()).unwrap().tasks[0].cost.expected;
    let least = (100..=200).map(|hundredths| cost(f64::from(hundredths) / 100.0)).fold(f64::INFINITY, f64::min);
    let [.., before, last] = &found.points[..] else { panic!("five points") };
    let width = last.factor - found.points[0].factor;
    assert!((20.0 * last.factor - least).abs() <= 3e-4 * 20.0 * width, "{last:?}: {least}");
    assert!(before.information_nats > 1.01 * last.information_nats, "{before:?}");
    // Within the limits of the task file, factors of them.
    assert!(front(&load(&text(5.0)), 3).unwrap().remarks[0].text.contains("from a factor of 1.38"));

    // Where no parameter changes the information, the cheapest design is all there is.
    let alone = text(20.0).replace("parameters.v =", "# parameters.v =").replace(r#"["v"]"#, "[0.1]");
    let found = front(&load(&alone), 4).unwrap();
    assert_eq!(found.points.len(), 1, "{:?}", found.points);
    assert!((found.points[0].parameters.0[0].1 - 2.0).abs() < 1e-9, "{:?}", found.points);
    assert!(
        found.remarks.iter().any(|remark| remark.text.ends_with("the front is a single point")),
        "{:?}",
        found.remarks
    );
}

#[test]
fn the_same_on_any_number_of_threads() {
    let task = load(&shipped("two_mass_small.toml"));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        // As JSON, where a price that is not a number equals itself.
        pool.install(|| serde_json::to_string(&front(&task, 5).unwrap()).unwrap())
    };
    let alone = run(1);
    assert_eq!(alone, run(5));
    let again: Pareto = serde_json::from_str(&alone).unwrap();
    assert_eq!(serde_json::to_string(&again).unwrap(), alone, "what is kept is read again");
}

/// The tightest point had the information needed at the file's own limit, which was less than at looser ones.
#[test]
fn needed_information_is_that_of_each_points_own_limit() {
    let text = r#"
        model = { kind = "linear", A = [["a"]], B = [[1.0]], C = [["c"]] }
        parameters.a = { initial = 1.1, bounds = [0.8, 1.4] }
        parameters.c = { initial = 1.0, bounds = [0.1, 10.0], scale = "log" }
        design.information = "needed"
        [[tasks]]
        name = "hold"
        steps = 6
        time_step = 0.1
        initial_state = [0.5]
        bound = 3.0
        noise = { initial = [0.4], process = ["0.1 * (1 + 3 * (a - 1.05)^2)"], measurement = [0.2] }
        costs = [{ kind = "quadratic", Q = [[1.0]], R = [[0.3]], final = [[2.0]] }]
    "#;
    let found = front(&load(text), 5).unwrap();
    let bits: Vec<f64> = found.points.iter().map(|point| point.information_nats / std::f64::consts::LN_2).collect();
    assert!(bits.windows(2).all(|pair| pair[0] >= pair[1]), "{bits:?}");
    // By another solver.
    assert!((bits[0] - 18.1034).abs() < 1e-3, "{bits:?}");
    // It ends where the cost of the best design without measurements is met.
    let without_measurements = |a: f64| {
        let (mut value, mut gains) = (2.0, Vec::new());
        for _ in 0..6 {
            let gain = a * value / (0.3 + value);
            gains.push(gain);
            value = 1.0 + 0.3 * gain * gain + (a - gain) * (a - gain) * value;
        }
        let (mut variance, mut cost) = (0.4, 0.25 * value);
        for _ in 0..6 {
            cost += variance;
            variance = a * a * variance + 0.1 * (1.0 + 3.0 * (a - 1.05) * (a - 1.05));
        }
        cost + 2.0 * variance
    };
    let least = (0..=600).map(|i| without_measurements(0.8 + 1e-3 * f64::from(i))).fold(f64::INFINITY, f64::min);
    let last = found.points.last().unwrap();
    assert!((last.factor - least / 3.0).abs() < 1e-6 && bits[bits.len() - 1] < 1e-6, "{} {bits:?}", last.factor);
}

#[test]
fn a_front_needs_bounds_above_zero_and_a_stop_is_heard() {
    let text = shipped("two_mass_small.toml");
    let error = front(&load(&text.replace("bound = 25.0", "")), 5).unwrap_err().to_string();
    assert!(error.contains("no task has a cost limit") && error.contains("supple evaluate"), "{error}");
    let error = front(&load(&text.replace("bound = 25.0", "bound = 0.0")), 5).unwrap_err().to_string();
    assert!(error.contains("the cost limit of task `press` is 0"), "{error}");
    let options = ParetoOptions { points: 5, starts: 2, seed: 0 };
    let flag = AtomicBool::new(true);
    let watch = Watch { progress: &Silent, stop: Stop::when(&flag) };
    assert!(matches!(run(&load(&text), &options, None, watch), Err(StudyError::Stopped)));
}
