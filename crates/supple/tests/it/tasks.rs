//! Every shipped task file loads, plans from its first guess and has right gradients; robots' files say what a design
//! gives.

use crate::common::reference;

use crate::common::reference::differences::total_gradient_errors;
use crate::common::{repository, shipped, task_files};
use supple::design::{Control, DesignSettings, DesignStatus, design};
use supple::pipeline::TaskState;
use supple::{CostTerm, EvaluateOptions, Problem, Verdict};

/// Plants with nothing to design, there to be bounded.
const PLANTS: [&str; 1] = ["tanaka_plant.toml"];

#[test]
fn every_task_plans_from_its_file() {
    assert!(task_files().len() >= 7);
    for file in task_files().into_iter().filter(|file| !PLANTS.contains(&file.as_str())) {
        let problem = shipped(&file);
        let found = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default()).unwrap();
        for task in &found.tasks {
            assert!(task.status.is_converged(), "{file}, {}: {}", task.name, task.status);
            assert!(task.cost.bound.is_some(), "{file}, {} has no bound", task.name);
        }
        assert!(found.feasible, "{file} starts above a bound");
        assert!(!problem.parameters.design().is_empty(), "{file} has nothing to design");
    }
}

/// What the costs of every shipped task ask for is what its plan does: the terms add up to the nominal cost, targets of the final
/// cost are covered, and the values are those of the trajectory.
#[test]
fn every_task_covers_the_way_to_its_targets() {
    for file in task_files() {
        let problem = shipped(&file);
        let options = EvaluateOptions { trajectories: true, ..EvaluateOptions::default() };
        let found = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
        for task in &found.tasks {
            let (terms, nominal) = (&task.cost.terms, task.cost.parts.nominal);
            let sum: f64 = terms.iter().map(CostTerm::total).sum();
            assert!((sum - nominal).abs() <= 1e-9 * nominal.abs(), "{file}, {}: {sum} of {nominal}", task.name);
            assert!(terms.iter().all(|term| !term.targets.is_empty()), "{file}, {}", task.name);
            let missed: Vec<_> = task.cost.missed_targets().collect();
            assert!(missed.is_empty(), "{file}, {}: {missed:?}", task.name);
            let along = &task.trajectory.as_ref().unwrap().quantities;
            let of_terms =
                terms.iter().enumerate().flat_map(|(cost, term)| term.targets.iter().map(move |to| (cost, to)));
            for (cost, to) in of_terms {
                let of = format!("cost {}", cost + 1);
                if let Some(curve) = along.iter().find(|curve| curve.of == of && curve.name == to.name) {
                    let known = (curve.values.first(), curve.values.last(), curve.target);
                    assert_eq!(known, (Some(&to.start), Some(&to.end), Some(to.target)), "{file}, {}", to.name);
                }
            }
        }
    }
}

#[test]
fn total_gradients_are_those_of_tasks_planned_anew() {
    for file in task_files().into_iter().filter(|file| !PLANTS.contains(&file.as_str())) {
        let problem = shipped(&file);
        let phi = problem.parameters.initial();
        let scales: Vec<f64> = phi.iter().map(|value| value.abs()).collect();
        for task in &problem.tasks {
            let mut state = TaskState::new(task);
            state.evaluate(task, &phi, &reference::differences::tight(), None).unwrap();
            for (name, error) in total_gradient_errors(task, &mut state, &phi, &scales) {
                assert!(error < 1e-4, "{file}, {}, {name}: off by {error:.1e}", task.name);
            }
        }
    }
}

/// Three digits.
fn short(number: f64) -> String {
    let last = number.abs().log10().floor() - 2.0;
    let (unit, digits) = (10f64.powf(last.max(0.0)), (-last).max(0.0) as usize);
    let number = if last > 0.0 { (number / unit).round() * unit } else { number };
    let text = format!("{number:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// What a file says of its design: parameters, bits, costs; and the design itself.
fn said(problem: &Problem) -> (Vec<String>, DesignStatus, Vec<f64>) {
    let start = problem.parameters.initial();
    let control = Control::default();
    let settings = DesignSettings { starts: 1, ..problem.design.clone() };
    let found = design(problem, &start, &settings, control).unwrap();
    let best = &found.starts[found.best];
    let before = problem.evaluate(&start, &EvaluateOptions::default()).unwrap();
    let line = |name: &str, from: f64, to: f64, unit: &str| {
        format!("#     {name}: {} -> {} {unit}", short(from), short(to)).trim_end().to_owned()
    };
    let mut lines = Vec::new();
    for (parameter, (&from, &to)) in problem.parameters.iter().zip(start.iter().zip(&best.to)) {
        lines.push(line(&parameter.name, from, to, &parameter.unit));
    }
    let bits = best.information / std::f64::consts::LN_2;
    lines.push(line("information", before.objective.information_bits, bits, "bits"));
    for (task, &cost) in before.tasks.iter().zip(&best.costs) {
        lines.push(line(&format!("cost of {}", task.name), task.cost.expected, cost, ""));
    }
    (lines, found.status, best.to.clone())
}

#[test]
fn files_say_what_a_design_gives() {
    for file in ["elastic_elbow", "wiping_arm", "soft_gripper", "peg_on_wall", "iiwa_door"] {
        let path = format!("{file}.toml");
        let text = std::fs::read_to_string(repository("tasks").join(&path)).unwrap();
        let problem = shipped(&path);
        let (lines, status, design) = said(&problem);
        assert_eq!(status, DesignStatus::Converged, "{path}");
        let missing: Vec<_> = lines.iter().filter(|line| !text.lines().any(|other| other == *line)).collect();
        assert!(missing.is_empty(), "{path} does not say\n{}", lines.join("\n"));
        for (place, phi) in [("start", &problem.parameters.initial()), ("design", &design)] {
            is_what_rollouts_do((&path, place), &problem, phi);
        }
    }
}

/// Closed-loop roll-outs stay with the plan, cost and deliver what is predicted, and contacts touch in them.
fn is_what_rollouts_do(of: (&str, &str), problem: &Problem, phi: &[f64]) {
    let options = EvaluateOptions { rollouts: 500, seed: 1, ..Default::default() };
    for task in &problem.evaluate(phi, &options).unwrap().tasks {
        let (expected, sampled) = (task.cost.expected, task.monte_carlo.as_ref().unwrap().cost_mean);
        assert!((sampled / expected - 1.0).abs() < 0.1, "{of:?}, {}: {sampled}, predicted {expected}", task.name);
        let trust = task.trust.as_ref().unwrap();
        match trust.verdict {
            Verdict::Holds => {}
            // The paper's noise shakes joints beyond the speeds that they are made for, and its steps are too long for its
            // optimum (docs/paper.md).
            Verdict::Doubtful if of.0 == "iiwa_door.toml" => assert!(trust.reasons[0].contains("velocity of joint")),
            Verdict::Broken if of == ("iiwa_door.toml", "design") => {
                assert!(trust.reasons[0].contains("on a plant of 16 times finer steps"), "{trust}");
            }
            _ => panic!("{of:?}, {}: {trust}", task.name),
        }
    }
}
