//! Closed-loop roll-outs against the predicted cost.

use crate::common;

use crate::common::shipped;
use supple::simulate::student_quantile;
use supple::{EvaluateOptions, Evaluation, Problem};

fn sampled(problem: &Problem, phi: &[f64], rollouts: usize) -> Evaluation {
    problem.evaluate(phi, &EvaluateOptions { rollouts, seed: 1, ..Default::default() }).unwrap()
}

const HOLD: &str = r#"
        [model]
        kind = "linear"
        A = [[1.0, 0.1], [-0.2, 0.95]]
        B = [[0.0], [0.1]]
        C = [[1.0, 0.0]]
        [[tasks]]
        name = "hold"
        steps = 40
        time_step = 0.1
        initial_state = [1.0, 0.0]
        initial_control = [0.0]
        noise = { initial = [0.1, 0.2], process = [0.01, 0.02], measurement = [0.05] }
        [[tasks.costs]]
        kind = "quadratic"
        Q = [[1.0, 0.0], [0.0, 0.1]]
        R = [[0.2]]
    "#;

/// Where everything is linear and the cost quadratic the prediction is exact.
#[test]
fn linear_quadratic_prediction_is_exact() {
    let problem = supple_file::parse(HOLD, "test").unwrap();
    let at = sampled(&problem, &[], 20_000);
    let sampled = at.tasks[0].monte_carlo.as_ref().unwrap();
    assert!(sampled.cost_standard_error < 0.01 * sampled.cost_mean);
    let off = sampled.difference / sampled.cost_standard_error;
    assert!(off.abs() < 4.0, "{} standard errors off", off);
    assert_interval(sampled.cost_interval_95, (sampled.cost_mean, sampled.cost_standard_error), 20_000);
    let bits = sampled.realised_bits.unwrap();
    assert_interval(bits.interval_95, (bits.mean, bits.standard_error), 20_000);
    let json = serde_json::to_value(sampled).unwrap();
    for key in ["cost_interval_95", "realised_bits/interval_95", "consistency/lower_95", "consistency/upper_95"] {
        assert!(json.pointer(&format!("/{key}")).is_some_and(|found| !found.is_null()), "{key}");
    }
}

fn assert_interval(interval: Option<[f64; 2]>, (mean, standard_error): (f64, f64), rollouts: usize) {
    let [low, high] = interval.unwrap();
    let half = student_quantile(0.05, rollouts as f64 - 1.0) * standard_error;
    assert!((0.5 * (low + high) - mean).abs() < 1e-9 * mean.abs());
    assert!((0.5 * (high - low) - half).abs() < 1e-9 * mean.abs());
}

/// However few roll-outs there are, about 95 % of the intervals have the expectation within them, and chance is not taken for
/// a fault of the model.
#[test]
fn intervals_of_few_rollouts_are_honest() {
    let problem = supple_file::parse(HOLD, "test").unwrap();
    for rollouts in [2, 4, 8] {
        let (mut within, mut blamed, seeds) = ([0, 0], 0, 300_u32);
        for seed in 0..seeds {
            let options = EvaluateOptions { rollouts, seed: u64::from(seed), ..Default::default() };
            let at = problem.evaluate(&[], &options).unwrap();
            let task = &at.tasks[0];
            let sampled = task.monte_carlo.as_ref().unwrap();
            let bits = (sampled.realised_bits.unwrap().interval_95, task.information.total_bits);
            let costs = (sampled.cost_interval_95, task.cost.expected);
            for (within, (interval, expected)) in within.iter_mut().zip([costs, bits]) {
                let [low, high] = interval.unwrap();
                *within += i32::from((low..=high).contains(&expected));
            }
            let trust = task.trust.as_ref().unwrap();
            let is_blamed = |reason: &String| !(reason.contains("too few") || reason.contains("so much"));
            blamed += i32::from(trust.reasons.iter().any(is_blamed));
        }
        // Costs are skewed, so that a little less than 95 % is right; normal intervals of two would have about 70 %.
        for within in within {
            let share = f64::from(within) / f64::from(seeds);
            assert!((0.91..0.98).contains(&share), "{rollouts} roll-outs: {share}");
        }
        // As seldom as beyond three standard deviations, by three comparisons.
        assert!(f64::from(blamed) <= 0.02 * f64::from(seeds), "{rollouts} roll-outs: blamed {blamed} times");
    }
}

/// A single roll-out says nothing about how far its cost is from the expected one.
#[test]
fn a_single_rollout_has_no_interval() {
    let problem = shipped("two_mass.toml");
    let at = sampled(&problem, &problem.parameters.initial(), 1);
    let sampled = at.tasks[0].monte_carlo.as_ref().unwrap();
    assert_eq!((sampled.cost_interval_95, sampled.realised_bits), (None, None));
    assert!(sampled.cost_mean.is_finite() && sampled.cost_standard_error.is_nan());
}

/// At full noise the two masses cost a little less than predicted: the prediction is a quadratic in the noise, while
/// the force's cost grows less than that once the contact opens. Less noise closes the gap faster than it closes the
/// price of the noise.
#[test]
fn difference_to_the_prediction_is_of_higher_order_in_the_noise() {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
    // The two variances that are parameters are numbers of the file too.
    let scaled = |factor: f64| {
        let number = |value: f64| format!("{:e}", value * factor);
        let mut text = text.replace("initial = 1e-4", &format!("initial = {}", number(1e-4)));
        text = text.replace("initial = 5e-3", &format!("initial = {}", number(5e-3)));
        let lists = [
            ("[1e-3, 1e-3, 1e-3, 1e-3, \"wall_variance\"]", &[1e-3; 4][..], ", \"wall_variance\"]"),
            ("[1e-7, \"drive_variance\", 1e-7, 1e-2, 0.0]", &[1e-7][..], ""),
            ("[1e-3, 1e-2]", &[1e-3, 1e-2][..], "]"),
        ];
        for (list, values, end) in lists {
            assert!(text.contains(list), "{list}");
            let values: Vec<String> = values.iter().map(|&value| number(value)).collect();
            let new = match end {
                "" => format!("[{}, \"drive_variance\", {}, {}, 0.0]", values[0], values[0], number(1e-2)),
                end => format!("[{}{end}", values.join(", ")),
            };
            text = text.replace(list, &new);
        }
        supple_file::parse(&text, "test").unwrap()
    };
    let relative = |factor: f64| {
        let problem = scaled(factor);
        let at = sampled(&problem, &common::starting_with(&problem, &[300.0, 300.0]), 2000);
        let task = &at.tasks[0];
        let price = task.cost.expected - task.cost.parts.nominal;
        let sampled = task.monte_carlo.as_ref().unwrap();
        (sampled.difference / price, sampled.cost_standard_error / price)
    };
    let (full, full_error) = relative(1.0);
    assert!(full.abs() < 0.15, "the prediction is within 15 % of the price of the noise: {full}");
    assert!(full_error < 0.05);
    let (small, small_error) = relative(0.01);
    assert!(small.abs() < 0.02 + 4.0 * small_error, "it is exact for little noise: {small} +- {small_error}");
}

/// The table of docs/theory/cost.md.
#[test]
fn documented_roll_outs() {
    let text = std::fs::read_to_string(common::repository("docs/theory/cost.md")).unwrap();
    let problem = shipped("two_mass.toml");
    for stiffness in [300.0, 500.0] {
        let options = EvaluateOptions { rollouts: 2000, ..Default::default() };
        let at = problem.evaluate(&common::starting_with(&problem, &[stiffness, stiffness]), &options).unwrap();
        let (cost, sampled) = (&at.tasks[0].cost, at.tasks[0].monte_carlo.as_ref().unwrap());
        let row = format!(
            "| {stiffness}, {stiffness} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            cost.expected,
            cost.expected - cost.parts.nominal,
            sampled.cost_mean,
            sampled.cost_standard_error,
            sampled.difference
        );
        assert!(text.contains(&row), "{row}");
    }
}

#[test]
fn same_seed_gives_the_same_bits_on_any_number_of_threads() {
    let problem = shipped("two_mass_small.toml");
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let at = pool.install(|| sampled(&problem, &problem.parameters.initial(), 100));
        at.tasks[0].monte_carlo.clone().unwrap().costs
    };
    let one = run(1);
    assert_eq!(one.len(), 100);
    assert_eq!(one, run(8));
    // A shorter run draws the same samples: each has a stream of its own.
    let few = sampled(&problem, &problem.parameters.initial(), 33).tasks[0].monte_carlo.clone().unwrap().costs;
    assert_eq!(few, one[..33]);
}

/// The paper's way to plan ends close to the nominal plan, and says that its gradients do not hold.
#[test]
fn sampled_plans_come_close_to_nominal_ones() {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass_small.toml")).unwrap();
    let sampled = supple_file::parse(&format!("{text}\n[planning]\nmode = \"sampled\"\n"), "test").unwrap();
    let nominal = shipped("two_mass_small.toml");
    let phi = nominal.parameters.initial();
    let options = EvaluateOptions { total_gradient: true, ..Default::default() };
    let (a, b) = (sampled.evaluate(&phi, &options).unwrap(), nominal.evaluate(&phi, &options).unwrap());
    let ratio = a.tasks[0].cost.expected / b.tasks[0].cost.expected;
    assert!((0.95..1.1).contains(&ratio), "{ratio}");
    let information = a.tasks[0].information.total_nats / b.tasks[0].information.total_nats;
    assert!((information - 1.0).abs() < 0.01, "{information}");
    let valid = |at: &Evaluation| at.tasks[0].gradient.as_ref().unwrap().total.as_ref().unwrap().valid;
    assert!(!valid(&a) && valid(&b));
    let again = sampled.evaluate(&phi, &options).unwrap();
    assert_eq!(a.tasks[0].cost.expected, again.tasks[0].cost.expected, "the seed decides");
}

#[test]
fn information_under_its_older_key_still_reads() {
    let problem = crate::common::shipped("two_mass_small.toml");
    let at = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default()).unwrap();
    let mut json = serde_json::to_value(&at.tasks[0].information).unwrap();
    let used = json.as_object_mut().unwrap().remove("used").unwrap();
    json["control"] = used;
    let read: supple::InformationReport = serde_json::from_value(json).unwrap();
    assert_eq!(read.used, at.tasks[0].information.used);
    assert!(read.used.is_some_and(|used| used.total_bits > 1.0));
}
