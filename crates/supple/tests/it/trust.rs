//! Whether verdicts on predictions are those of many more samples.

use crate::common;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use supple::{EvaluateOptions, MOST_ROLLOUTS, Problem, Verdict};

/// A number from `low` to `high`, uniform in its logarithm.
fn between(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    let share = random.next_u64() as f64 / u64::MAX as f64;
    low * (high / low).powf(share)
}

/// Two masses before a wall with stiffnesses, noise, smoothing and weights at random: from tasks whose plan is all there is
/// to them to such as never do what is planned.
fn random_task(number: u64) -> Problem {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(number);
    let mut draw = |low: f64, high: f64| between(&mut random, low, high).to_string();
    let text = text
        .replace("contact_smoothing = 0.01", &format!("contact_smoothing = {}", draw(1e-3, 1e-1)))
        .replace("smoothing = 0.1 ", &format!("smoothing = {} ", draw(1e-2, 1.0)))
        .replace("weight = 0.05", &format!("weight = {}", draw(5e-3, 0.5)))
        .replace("bound = 250.0 ", "");
    let text =
        [("k1", 50.0, 600.0), ("k2", 100.0, 600.0), ("wall_variance", 1e-6, 1e-1), ("drive_variance", 1e-4, 1e-1)]
            .into_iter()
            .fold(text, |text, (name, low, high)| {
                let start = text.find(&format!("[parameters.{name}]")).unwrap();
                let from = start + text[start..].find("initial = ").unwrap() + "initial = ".len();
                let to = from + text[from..].find('\n').unwrap();
                format!("{}{}{}", &text[..from], draw(low, high), &text[to..])
            });
    supple_file::parse(&text, "random.toml").unwrap()
}

fn verdict(problem: &Problem, rollouts: usize, seed: u64) -> Option<Verdict> {
    let options = EvaluateOptions { rollouts, seed, ..Default::default() };
    let at = problem.evaluate(&problem.parameters.initial(), &options).ok()?;
    at.tasks[0].trust.as_ref().map(|trust| trust.verdict)
}

/// How many verdicts of 256 roll-outs those of `many` others confirm, of how many; and how often each was given.
fn confirmed(tasks: u64, many: usize) -> (usize, usize, [usize; 3]) {
    let (mut same, mut all, mut given) = (0, 0, [0; 3]);
    for number in 0..tasks {
        let problem = random_task(number);
        let (Some(few), Some(sure)) = (verdict(&problem, 256, 1), verdict(&problem, many, 2)) else { continue };
        all += 1;
        same += usize::from(few == sure);
        given[few as usize] += 1;
    }
    eprintln!("{same} of {all} verdicts confirmed by {many} roll-outs; holds, doubtful, broken: {given:?}");
    (same, all, given)
}

/// The path of the elbow's file, and its text with fewer sub-steps, for a wall that is less sure and drifts faster.
fn coarse_elbow(substeps: usize) -> (std::path::PathBuf, String) {
    let path = common::repository("tasks/elastic_elbow.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let fewer = format!("substeps = {substeps} ");
    let changes =
        [("substeps = 4 ", &*fewer), ("\"c.wall\" = 4e-6 }", "\"c.wall\" = 2.5e-5 }"), ("2.5e-7 }", "1e-6 }")];
    let text = changes.into_iter().fold(text, |text, (shipped, other)| {
        assert_eq!(text.matches(shipped).count(), 1, "{shipped}");
        text.replace(shipped, other)
    });
    (path, text)
}

/// The elbow with other variances of its first velocities, and an uncertain wall.
fn noisy_elbow(substeps: usize, speeds: &str, wall: &str) -> Problem {
    let (path, text) = coarse_elbow(substeps);
    let coarse = "\"v.*\" = 1e-4, \"c.wall\" = 2.5e-5 }";
    assert!(text.contains(coarse));
    let noisy = text.replace(coarse, &format!("\"v.*\" = {speeds}, \"c.wall\" = {wall} }}"));
    supple_file::parse(&noisy, path.to_str().unwrap()).unwrap()
}

/// Plans, and the controllers along them, are those of a robot and not of the steps that it is integrated with.
#[test]
fn shipped_plans_cost_the_same_on_finer_steps() {
    let mut robots = 0;
    for entry in std::fs::read_dir(common::repository("tasks")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|kind| kind != "toml") {
            continue;
        }
        let problem = supple_file::load(&path).unwrap();
        let options = EvaluateOptions { rollouts: 32, ..Default::default() };
        for task in problem.evaluate(&problem.parameters.initial(), &options).unwrap().tasks {
            let Some(finer) = task.monte_carlo.as_ref().and_then(|sampled| sampled.finer.clone()) else { continue };
            robots += 1;
            let ratio = finer.cost_mean / finer.own_cost_mean;
            assert!((ratio - 1.0).abs() < 0.05, "{}, {}: {finer:?}", path.display(), task.name);
        }
    }
    assert!(robots >= 5, "{robots}");
}

/// Steps of 10 ms integrate the motor of the elbow badly. With a control that costs next to nothing the controller inverts
/// what is integrated, not the motor: the same controller sends the elbow off on finer steps.
#[test]
fn controllers_that_only_the_steps_of_a_task_stabilise_are_broken() {
    let (path, text) = coarse_elbow(1);
    for (steps, weight, verdict, says) in [
        ("100\ntime_step = 1e-2", "1e-2", Verdict::Broken, "times their expected value there"),
        ("100\ntime_step = 1e-2", "1e-4", Verdict::Broken, "on the steps of this task, which exceeds the limit"),
        ("200\ntime_step = 5e-3", "1e-2", Verdict::Broken, "on the steps of this task"),
    ] {
        let text = text
            .replace("200\ntime_step = 5e-3", steps)
            .replace("\"control\"\nweight = 1e-2", &format!("\"control\"\nweight = {weight}"));
        let problem = supple_file::parse(&text, path.to_str().unwrap()).unwrap();
        let options = EvaluateOptions { rollouts: 256, ..Default::default() };
        let at = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
        let trust = at.tasks[0].trust.as_ref().unwrap();
        let finer = at.tasks[0].monte_carlo.as_ref().unwrap().finer.as_ref().unwrap();
        assert_eq!(trust.verdict, verdict, "{trust} {finer:?}");
        assert!(trust.to_string().contains(says), "{trust}");
        assert!(trust.to_string().contains("finer steps"), "{trust}");
    }
}

/// The motor of the elbow moves within a step, which its precise sensor sees and its filter does not expect. More sub-steps mend
/// the filter. What sensors tell is not what this filter makes of it: a filter of finer steps finds as many bits with them and
/// without.
#[test]
fn filters_that_lack_what_happens_within_a_step_are_doubtful() {
    let at = |substeps: usize| {
        let (path, text) = coarse_elbow(substeps);
        let problem = supple_file::parse(&text, path.to_str().unwrap()).unwrap();
        let options = EvaluateOptions { rollouts: 256, ..Default::default() };
        let task = problem.evaluate(&problem.parameters.initial(), &options).unwrap().tasks.swap_remove(0);
        let finer = task.monte_carlo.unwrap().finer.unwrap();
        (task.trust.unwrap(), finer.consistency.unwrap().mean, finer.realised_bits.unwrap().mean)
    };
    let (trust, consistency, bits) = at(3);
    assert_eq!((trust.verdict, trust.substeps_advised), (Verdict::Doubtful, Some(24)), "{trust}");
    assert!((1.2..1.4).contains(&consistency) && (180.0..200.0).contains(&bits), "{consistency} {bits}");
    let said =
        format!("squared innovations are {consistency:.3} times their expected value on a plant of 16 times finer");
    assert!(trust.to_string().contains(&said), "{trust}");
    let (trust, consistency, with_substeps) = at(8);
    assert!(trust.substeps_advised.is_none() && !trust.to_string().contains("finer steps"), "{trust}");
    assert!(consistency < 1.1 && (with_substeps / bits - 1.0).abs() < 0.05, "{consistency} {bits} {with_substeps}");
}

/// The bits of the published steps of the door are 7 % too many: a filter of finer steps finds those that sub-steps predict.
#[test]
fn bits_on_finer_steps_are_those_of_substeps() {
    let path = common::repository("tasks/iiwa_door.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let at = |model: &str, rollouts| {
        let problem = supple_file::parse(&text.replace("[model]\n", model), path.to_str().unwrap()).unwrap();
        let options = EvaluateOptions { rollouts, ..Default::default() };
        problem.evaluate(&problem.parameters.initial(), &options).unwrap().tasks
    };
    let (whole, divided) = (at("[model]\n", 32), at("[model]\nsubsteps = 8\n", 0));
    for (whole, divided) in whole.iter().zip(&divided) {
        let finer = whole.monte_carlo.as_ref().unwrap().finer.as_ref().unwrap();
        let (found, predicted) = (finer.realised_bits.unwrap(), divided.information.total_bits);
        let [own, error] = [whole.information.total_bits, found.standard_error];
        assert!(own > 1.05 * predicted && (found.mean - predicted).abs() < 4.0 * error, "{own} {found:?} {predicted}");
    }
}

/// Where the costs of roll-outs differ a lot, 18446744073709551615 of them were recommended.
#[test]
fn no_more_rollouts_are_recommended_than_can_be_made() {
    let (mut hopeless, mut decided) = (0, 0);
    for variance in ["0.001", "0.03", "0.1", "10.0"] {
        let problem = noisy_elbow(3, variance, "2.5e-3");
        let options = EvaluateOptions { rollouts: 64, ..Default::default() };
        let at = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
        let trust = at.tasks[0].trust.as_ref().unwrap();
        assert_ne!(trust.verdict, Verdict::Holds, "{variance}: {trust}");
        assert!(trust.rollouts_needed.is_none_or(|needed| needed <= MOST_ROLLOUTS), "{variance}: {trust}");
        let says = |text: &str| trust.reasons.iter().any(|why| why.contains(text));
        hopeless += usize::from(says("even 10000000 would not estimate it"));
        // More roll-outs would not change what is known already.
        let sampled = at.tasks[0].monte_carlo.as_ref().unwrap();
        let differs = sampled.difference.abs() > 3.0 * sampled.cost_standard_error.max(0.0);
        if differs && says("roll-outs cost") {
            decided += 1;
            assert!(says("is expected: the cost is not quadratic") && trust.rollouts_needed.is_none(), "{trust}");
        }
    }
    assert!(hopeless > 0 && decided > 0, "{hopeless} {decided}");
}

/// A limit that the expected cost keeps and roll-outs exceed is not met, whatever else is only doubtful.
#[test]
fn a_limit_that_rollouts_exceed_breaks_a_plan() {
    let options = EvaluateOptions { rollouts: 4096, ..Default::default() };
    let mut tried = 0;
    for wall in ["2.3e-4", "2.5e-4", "2.7e-4"] {
        let mut problem = noisy_elbow(8, "1e-4", wall);
        let mut with = |bound: Option<f64>| {
            problem.tasks[0].bound = bound.map(Into::into);
            let at = problem.evaluate(&problem.parameters.initial(), &options).unwrap().tasks.remove(0);
            (at.cost.expected, at.monte_carlo.unwrap(), at.trust.unwrap())
        };
        let (expected, sampled, trust) = with(None);
        let surely_above = sampled.difference > (0.1 * expected).max(4.0 * sampled.cost_standard_error);
        if trust.verdict != Verdict::Doubtful || !surely_above {
            continue;
        }
        tried += 1;
        let (.., between) = with(Some(1.01 * expected));
        assert_eq!(between.verdict, Verdict::Broken, "{between}");
        assert!(between.reasons[0].contains("above the limit of"), "{between}");
        // A limit that both keep, and one that neither does, which is said elsewhere.
        for bound in [sampled.cost_mean, 0.5 * expected] {
            assert_eq!(with(Some(bound)).2, trust);
        }
    }
    assert!(tried > 1, "{tried}");
}

#[test]
fn verdicts_are_those_of_many_more_samples() {
    let (same, all, given) = confirmed(30, 2000);
    assert!(all >= 28 && given[0] >= 5 && given[1] >= 5, "{all} {given:?}");
    assert!(same as f64 >= 0.85 * all as f64, "{same} of {all}");
}

/// The same of 200 tasks with 20000 samples: minutes.
#[test]
#[ignore = "takes minutes"]
fn verdicts_of_many_tasks() {
    let (same, all, _) = confirmed(200, 20_000);
    assert!(same as f64 >= 0.9 * all as f64, "{same} of {all}");
}

/// Where a few attempts find a plan that costs much less, an evaluation says so, without a change of its own numbers; and the
/// search that it advises finds one that costs no more than what it said.
#[test]
fn cheaper_plans_are_told() {
    let (mut told, mut tried) = (0, 0);
    for number in 0..40 {
        let problem = random_task(number);
        let phi = problem.parameters.initial();
        let at = |branches: usize, probe: bool| {
            problem.evaluate(&phi, &EvaluateOptions { branches, probe, ..Default::default() }).ok()
        };
        let (Some(plain), Some(probed)) = (at(0, false), at(0, true)) else { continue };
        let (plain, probed) = (&plain.tasks[0], &probed.tasks[0]);
        assert_eq!(plain.cost.expected, probed.cost.expected, "{number}");
        let said = probed.warnings.iter().find_map(|text| text.split_once("another plan costs ").map(|(_, rest)| rest));
        assert!(!plain.warnings.iter().any(|text| text.contains("another plan costs")));
        tried += 1;
        let Some(said) = said else { continue };
        told += 1;
        let cost: f64 = said.split(',').next().unwrap().parse().unwrap();
        let best = &at(10, true).unwrap().tasks[0];
        assert!(cost < 0.99 * plain.cost.expected && best.cost.expected <= cost * (1.0 + 1e-5), "{number}: {said}");
        assert!(!best.warnings.iter().any(|text| text.contains("another plan costs")));
    }
    assert!(tried > 30 && told > 2, "{told} of {tried}");
}

/// One of many roll-outs that runs away decides their mean, and the advice to make ever more of them hid it.
#[test]
fn a_few_rollouts_that_run_away_are_told() {
    let (mut told, mut silent) = (0, 0);
    for number in 0..60 {
        let problem = random_task(number);
        let options = EvaluateOptions { rollouts: 256, seed: 1, ..Default::default() };
        let Ok(at) = problem.evaluate(&problem.parameters.initial(), &options) else { continue };
        let (trust, sampled) = (at.tasks[0].trust.as_ref().unwrap(), at.tasks[0].monte_carlo.as_ref().unwrap());
        let mut costs = sampled.costs.clone();
        costs.sort_by(f64::total_cmp);
        let median = costs[costs.len() / 2];
        let near: Vec<f64> = costs.iter().copied().filter(|cost| *cost <= 10.0 * median).collect();
        let mean = near.iter().sum::<f64>() / near.len() as f64;
        let runs_away = near.len() < costs.len() && sampled.cost_mean > 1.1 * mean;
        let is_told = trust.to_string().contains("times the median");
        if sampled.diverged == 0 {
            assert_eq!(is_told, runs_away, "{number}: {trust}");
        }
        told += usize::from(is_told);
        silent += usize::from(!is_told);
        if is_told {
            let many = costs.len() - near.len();
            assert!(trust.to_string().contains(&format!("{many} of 256 roll-outs cost")), "{trust}");
        }
    }
    assert!(told > 0 && silent > 20, "{told} {silent}");
}
