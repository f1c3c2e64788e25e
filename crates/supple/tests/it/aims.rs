//! Gradients of what designs minimise.

use crate::common;
use supple::aims::weighted_information;
use supple::design::InformationWeights;
use supple::design::best_plan;
use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::{Problem, Task};

/// All shipped tasks with total gradients and 20 states or fewer.
fn tasks() -> Vec<(String, Problem)> {
    let problems = common::task_files().into_iter().map(|name| (name.clone(), common::shipped(&name)));
    let small = |task: &Task| task.system.dimensions().states <= 20;
    problems.filter(|(_, p)| p.planning.plan.has_total_gradient() && p.tasks.iter().all(small)).collect()
}

/// Numbers that are multiplied in one Newton step of the search for what is needed.
fn effort(task: &Task) -> f64 {
    let n = task.system.dimensions().states as f64;
    task.steps as f64 * (n * (n + 1.0) / 2.0).powi(3)
}

fn value(at: (&Task, &[f64]), weights: InformationWeights, state: &mut TaskState) -> f64 {
    weighted_information(at.0, at.1, weights, state, &mut Vec::new()).unwrap()
}

/// The relative error of the best of central differences of several steps, with two terms of Richardson's.
fn error_of(gradient: f64, size: f64, scale: f64, mut at: impl FnMut(f64) -> f64) -> f64 {
    let mut best = f64::INFINITY;
    for step in [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5] {
        let h = step * size;
        let mut central = |h: f64| (at(h) - at(-h)) / (2.0 * h);
        let found = (4.0 * central(0.5 * h) - central(h)) / 3.0;
        best = best.min((found - gradient).abs() * size / scale);
        if best <= 1e-6 {
            break;
        }
    }
    best
}

fn assert_gradients(name: &str, problem: &Problem, kind: &str) {
    let phi = problem.parameters.initial();
    let weights = InformationWeights::of_kind(kind).unwrap();
    let planning = PlanSettings { tolerance: 1e-11, ..problem.planning.clone() };
    let without_bound = |task: &Task| Task { bound: None, ..task.clone() };
    let tasks = problem.tasks.iter().flat_map(|task| [task.clone(), without_bound(task)]);
    for task in &tasks.collect::<Vec<_>>() {
        let limited = if task.bound.is_some() { "within its bound" } else { "at its own cost" };
        let mut state = TaskState::new(task);
        best_plan(problem, task, &phi, None, &mut state).unwrap();
        let first = state.plan.trajectory.controls.clone();
        state.evaluate(task, &phi, &planning, Some(&first)).unwrap();
        let mut gradient = Vec::new();
        let nats = weighted_information(task, &phi, weights, &mut state, &mut gradient).unwrap();
        let controls = state.plan.trajectory.controls.clone();
        let indices = problem.parameters.design();
        let sizes: Vec<f64> = indices.iter().map(|&index| phi[index].abs().max(1e-3)).collect();
        let scale = indices.iter().zip(&sizes).map(|(&i, size)| (gradient[i] * size).abs()).fold(1e-6, f64::max);
        for (&index, &size) in indices.iter().zip(&sizes) {
            let error = error_of(gradient[index], size, scale, |h| {
                let mut moved = phi.clone();
                moved[index] += h;
                let mut again = TaskState::new(task);
                again.evaluate(task, &moved, &planning, Some(&controls)).unwrap();
                value((task, &moved), weights, &mut again)
            });
            let parameter = &problem.parameters.get(index).name;
            eprintln!("{name} {limited} {kind} {nats:.6} d/d{parameter} {:.6e}: {error:.1e}", gradient[index]);
            // What is needed is found to some 1e-10 nats, which differences over short steps show.
            assert!(error <= 3e-5, "{name} {limited}, {kind}, {parameter}: {error:.2e}");
        }
    }
}

#[test]
fn gradients_of_what_is_used_are_those_of_differences() {
    let tasks = tasks();
    assert!(tasks.len() >= 8);
    tasks.iter().for_each(|(name, problem)| assert_gradients(name, problem, "used"));
}

#[test]
fn gradients_of_what_is_needed_are_those_of_differences() {
    let mut tasks = tasks();
    // The door's horizon takes a minute a difference: its benchmark has it.
    tasks.retain(|(_, problem)| problem.tasks.iter().all(|task| effort(task) < 3e8));
    assert!(tasks.len() >= 8);
    tasks.iter().for_each(|(name, problem)| assert_gradients(name, problem, "needed"));
}
