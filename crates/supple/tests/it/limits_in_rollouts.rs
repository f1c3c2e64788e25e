//! Limits along roll-outs: against runs one by one, within steps, in verdicts, and on every shipped task.

use supple::pipeline::TaskState;
use supple::simulate::{LimitShare, MonteCarlo, Rollouts, SampleId, monte_carlo, sample_number};
use supple::system::{Points, Times};
use supple::{EvaluateOptions, Matrices, Problem, Scratch, Task, Verdict};

use crate::common::{repository, shipped, task_files};
use crate::robot::arm::{Description, arm, compliance, cost};

/// The peg on its wall, with some limits more.
fn peg(limits: &str) -> Problem {
    let file = repository("tasks/peg_on_wall.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    supple_file::parse(&format!("{text}\n{limits}"), &file.to_string_lossy()).unwrap()
}

const LIMITS: &str = "
[[tasks.limits]]
kind = \"contact_force\"
contact = \"wall\"
upper = 1.8
[[tasks.limits]]
kind = \"joint_acceleration\"
select = [\"peg_tilt\"]
lower = -100
upper = 100
[[tasks.limits]]
kind = \"control\"
lower = [-15, -10]
";

fn sampled(task: &Task, phi: &[f64], state: &TaskState, count: usize) -> MonteCarlo {
    let rollouts = Rollouts { count, seed: 4 };
    monte_carlo(task, phi, &state.plan, &state.noise, state.cost.expected(), rollouts).unwrap()
}

/// What each side of each limit of a task is in runs, one by one: the furthest values, and how often it is exceeded.
fn one_by_one(task: &Task, phi: &[f64], state: &TaskState, count: u64) -> Vec<(Vec<f64>, Vec<usize>)> {
    let numbers: Vec<_> = task.system.followed(phi).into_iter().enumerate().filter(|(_, n)| n.is_limited()).collect();
    let mut sides = vec![(Vec::new(), Vec::new()); 2 * numbers.len()];
    for run in 0..count {
        let run = sample_number(task, phi, &state.plan, &state.noise, SampleId { seed: 4, number: run }).unwrap();
        let idle = vec![0.0; run.controls[0].len()];
        let at = |step: usize| {
            let u = run.controls.get(step).unwrap_or(&idle);
            task.system.follow(&run.states[step], u, phi)
        };
        let along: Vec<Vec<f64>> = (0..run.states.len()).map(at).collect();
        for (place, (index, number)) in numbers.iter().enumerate() {
            let steps = if number.depends_on_control { run.controls.len() } else { run.states.len() };
            let values = || along[..steps].iter().map(|all| all[*index]);
            let [lower, upper] = number.limits;
            sides[2 * place].0.push(values().fold(f64::NEG_INFINITY, f64::max));
            sides[2 * place].1.push(values().filter(|value| *value > upper).count());
            sides[2 * place + 1].0.push(values().fold(f64::INFINITY, f64::min));
            sides[2 * place + 1].1.push(values().filter(|value| *value < lower).count());
        }
    }
    let finite = numbers.iter().flat_map(|(_, number)| [number.limits[1], number.limits[0]]);
    sides.into_iter().zip(finite).filter(|(_, limit)| limit.is_finite()).map(|(side, _)| side).collect()
}

/// Shares, medians and worst values are those of the same runs, one by one.
#[test]
fn limits_of_rollouts_are_those_of_their_runs() {
    let problem = peg(LIMITS);
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let mut state = TaskState::new(task);
    state.evaluate(task, &phi, &problem.planning, None).unwrap();
    let count = 41;
    let all = sampled(task, &phi, &state, count).limits;
    // Those of the robot's file come first.
    let found = &all[all.len() - 5..];
    let own = one_by_one(task, &phi, &state, count as u64);
    assert_eq!(own.len(), 5);
    for (limit, (mut furthest, beyond)) in found.iter().zip(own) {
        furthest.sort_by(|one, other| if limit.upper { one.total_cmp(other) } else { other.total_cmp(one) });
        let close = |found: f64, own: f64| (found - own).abs() < 1e-9 * (1.0 + own.abs());
        assert!(close(limit.median, furthest[20]) && close(limit.worst, furthest[40]), "{limit:?}: {furthest:?}");
        let share = beyond.iter().filter(|steps| **steps > 0).count() as f64 / count as f64;
        let time = beyond.iter().sum::<usize>() as f64 / (count * (task.steps + 1)) as f64;
        assert!(close(limit.share, share) && close(limit.share_of_time, time), "{limit:?}: {share}, {time}");
    }
    assert!(found.iter().filter(|limit| limit.share > 0.0 && limit.share < 1.0).count() >= 2, "{found:?}");
}

/// Which limit is the worst in the verdict's reason.
fn reason(problem: &Problem, rollouts: usize) -> (Verdict, String) {
    let options = EvaluateOptions { rollouts, ..EvaluateOptions::default() };
    let trust = problem.evaluate(&problem.parameters.initial(), &options).unwrap().tasks[0].trust.clone().unwrap();
    (trust.verdict, trust.reasons.join("; "))
}

/// A plan that is held at a limit is in doubt where noise takes half of the roll-outs a tenth beyond it; not where the
/// limit is so wide that few exceed it, nor where the plan itself exceeds it, which is told as such.
#[test]
fn limits_that_rollouts_leave_make_a_plan_doubtful() {
    let force = |upper: f64, enforce: bool| {
        let limit = "[[tasks.limits]]\nkind = \"contact_force\"\ncontact = \"wall\"\n";
        peg(&format!("{limit}upper = {upper}\nenforce = {enforce}\n"))
    };
    let (verdict, reasons) = reason(&force(1.8, true), 256);
    assert!(verdict == Verdict::Doubtful && reasons.contains("although its limit is 1.8 N"), "{reasons}");
    assert!(reasons.contains("normal force of wall reaches 2."), "{reasons}");
    let (verdict, reasons) = reason(&force(5.5, true), 256);
    assert!(verdict == Verdict::Holds, "{reasons}");
    let (_, reasons) = reason(&force(1.8, false), 256);
    assert!(!reasons.contains("although its limit"), "{reasons}");
}

/// With hardly any noise and no feedback, roll-outs on finer steps are the free motion in finer steps, each of which is looked
/// at: the fastest swing falls within a step of the task.
#[test]
fn limits_are_looked_at_within_steps() {
    let spring = compliance("spring", "rail", "joint = \"slide\"\nstiffness = 2e3\nrest = 0.0");
    let limits = "[[tasks.limits]]\nkind = \"joint_velocity\"\nselect = [\"slide\"]\nlower = -5.0\nupper = 5.0\n";
    let problem = Description {
        noise: "initial = { \"*\" = 1e-20 }\nprocess = { \"*\" = 1e-20 }\n".into(),
        costs: cost("control", "weight = 1.0") + limits,
        ..arm().with(&spring)
    }
    .problem();
    let phi = problem.parameters.initial();
    let options = EvaluateOptions { rollouts: 4, ..EvaluateOptions::default() };
    let found = problem.evaluate(&phi, &options).unwrap().tasks.remove(0).monte_carlo.unwrap();
    let finer = found.finer.unwrap();

    let task = &problem.tasks[0];
    let start: Vec<f64> = task.initial_state.iter().map(|value| value.resolve(&phi)).collect();
    let mut x = Matrices::of_rows(&[start], task.system.dimensions().states);
    let idle = Matrices::vectors(1, task.system.dimensions().controls);
    let velocity = |x: &Matrices| task.system.follow(x.vector(0), idle.vector(0), &phi)[0];
    let mut reached = vec![velocity(&x)];
    for step in 0..task.steps {
        for _ in 0..finer.times {
            let (at, mut next) = (x.clone(), x.clone());
            let at = Points { states: &at, controls: &idle, stages: 1, has_end: false, times: Times::At(step) };
            task.system.step_part(finer.times, at, &phi, &mut next, &mut Scratch::new());
            x = next;
            reached.push(velocity(&x));
        }
    }
    let least = reached.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = reached.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let [.., upper, lower] = &finer.limits[..] else { panic!("{:?}", finer.limits) };
    assert!(upper.upper && (upper.worst - greatest).abs() < 1e-7 && (lower.worst - least).abs() < 1e-7, "{upper:?}");
    let beyond = reached.iter().filter(|value| value.abs() > 5.0).count();
    let share = upper.share_of_time + lower.share_of_time;
    assert!(
        beyond > 0 && (share - beyond as f64 / reached.len() as f64).abs() < 1e-12,
        "{beyond}: {upper:?} {lower:?}"
    );
    let own = &found.limits[found.limits.len() - 2];
    assert!(upper.worst - own.worst > 0.1, "{own:?} {upper:?}");
}

/// On every shipped task: shares are shares, the median is not beyond the worst, and a limit is exceeded by some where the
/// worst is beyond it; finer steps have the same limits.
#[test]
fn limits_of_shipped_tasks_are_in_order() {
    let mut looked = 0;
    for file in task_files() {
        let problem = shipped(&file);
        let options = EvaluateOptions { rollouts: 32, ..EvaluateOptions::default() };
        let found = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
        for task in &found.tasks {
            let sampled = task.monte_carlo.as_ref().unwrap();
            let finer = sampled.finer.as_ref().map_or(&[][..], |finer| &finer.limits);
            assert!(finer.is_empty() || finer.len() == sampled.limits.len(), "{file}");
            for limit in sampled.limits.iter().chain(finer) {
                looked += 1;
                let LimitShare { median, worst, share, share_of_time, .. } = *limit;
                let place = || format!("{file}: {limit:?}");
                assert!(limit.beyond(median) <= limit.beyond(worst), "{}", place());
                assert!((0.0..=1.0).contains(&share) && (0.0..=share).contains(&share_of_time), "{}", place());
                assert_eq!(share > 0.0, limit.beyond(worst) > 1e-8, "{}", place());
                assert_eq!(share > 0.0, share_of_time > 0.0, "{}", place());
            }
            let violated = |name: &str| task.limits_violated.iter().any(|limit| limit.name == name);
            for limit in &sampled.limits {
                assert!(limit.is_kept_by_plan() || violated(&limit.name), "{file}: {limit:?}");
            }
        }
    }
    assert!(looked > 100, "{looked} limits of all tasks");
}
