//! The shipped task of the arm that opens a door: against an independent program, and its total gradients.

use supple::pipeline::TaskState;
use supple::plan::PlanSettings;
use supple::{EvaluateOptions, Problem, Task};

use crate::common::reference::differences::{FUNCTIONALS, gradients, numbers as values, tight};
use crate::common::reference::{assert_near, relative_error};
use crate::common::{numbers, shipped};

fn door() -> Problem {
    shipped("iiwa_door.toml")
}

fn open(problem: &Problem) -> &Task {
    problem.tasks.iter().find(|task| task.name == "open").unwrap()
}

/// With `--nocapture` it says what is reached.
#[allow(clippy::print_stderr)]
#[track_caller]
fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    eprintln!("{what}: off by {:.1e}", relative_error(&[found], &[expected]));
    assert_near(what, found, expected, tolerance);
}

#[test]
fn opening_the_door_agrees_with_an_independent_program() {
    let golden: serde_json::Value = serde_json::from_str(include_str!("../../golden/door_open_1e6.json")).unwrap();
    let problem = door();
    let options = EvaluateOptions { trajectories: true, ..Default::default() };
    let at = problem.evaluate(&numbers(&golden["linear_stiffness"]), &options).unwrap();
    let task = at.tasks.iter().find(|task| task.name == "open").unwrap();
    assert!(task.status.is_converged(), "{}", task.status);
    let expected = |key: &str| golden[key].as_f64().unwrap();
    let costs = [
        ("nominal_cost", task.cost.parts.nominal),
        ("belief_cost", task.cost.parts.belief),
        ("process_cost", task.cost.parts.process),
        ("initial_cost", task.cost.parts.initial),
        ("expected_cost", task.cost.expected),
    ];
    for (key, found) in costs {
        near(key, found, expected(key), 1e-6);
    }
    let information = &task.information;
    near("directed information", information.total_nats, expected("directed_information_nat"), 1e-5);
    let per_step = &information.per_step_nats;
    assert_eq!(per_step.len(), 501);
    let [first, last] = ["first", "last"].map(|end| numbers(&golden[format!("information_per_step_nat_{end}3")]));
    let ends = first.iter().zip(per_step).chain(last.iter().zip(&per_step[498..]));
    for (t, (expected, found)) in ends.enumerate() {
        near(&format!("information per step, {t}"), *found, *expected, 1e-5);
    }
    let trajectory = task.trajectory.as_ref().unwrap();
    let angle = trajectory.state_names.iter().position(|name| name == "q.right_door_hinge").unwrap();
    near("angle at step 250", trajectory.states[250][angle], expected("door_angle_at_step_250"), 1e-6);
    near("angle at the end", trajectory.states[500][angle], expected("door_angle_at_end"), 1e-6);
    let peak = trajectory.controls.iter().flatten().fold(0.0, |peak: f64, torque| peak.max(torque.abs()));
    near("peak torque", peak, expected("peak_torque"), 1e-6);
}

/// The golden gradients come from differences, and are about 3e-4 accurate.
#[test]
fn gradients_at_the_start_agree_with_an_independent_program() {
    let golden: serde_json::Value = serde_json::from_str(include_str!("../../golden/door_open_1e6.json")).unwrap();
    let problem = door();
    let options = EvaluateOptions { total_gradient: true, ..Default::default() };
    let at = problem.evaluate(&numbers(&golden["linear_stiffness"]), &options).unwrap();
    let task = at.tasks.iter().find(|task| task.name == "open").unwrap();
    let total = task.gradient.as_ref().unwrap().total.as_ref().unwrap();
    assert!(total.valid);
    let pairs = [
        ("directed_information", &total.information_nats),
        ("nominal_cost", &total.nominal_cost),
        ("process_cost", &total.process_cost),
    ];
    for (key, found) in pairs {
        let expected = numbers(&golden["total_gradient_per_N_per_m"][key]);
        let found: Vec<f64> = found.0.iter().take(3).map(|(_, entry)| *entry).collect();
        let error = relative_error(&found, &expected);
        assert!(error < 1e-3, "{key}: {found:?} instead of {expected:?}, off by {error:.1e}");
    }
}

/// Errors of the total gradients by `log k` at a stiffness, against differences of the task solved anew.
fn gradient_errors(problem: &Problem, phi: &[f64], settings: &PlanSettings, step: f64) -> Vec<(&'static str, f64)> {
    let task = open(problem);
    let mut state = TaskState::new(task);
    state.evaluate(task, phi, settings, None).unwrap();
    assert!(state.plan.status.is_converged(), "{phi:?}: {}", state.plan.status);
    let controls = state.plan.trajectory.controls.clone();
    let mut again = TaskState::new(task);
    let steps: Vec<f64> = phi.iter().map(|k| step * k).collect();
    let expected = gradients(phi, &steps, |phi| {
        again.evaluate(task, phi, settings, Some(&controls)).unwrap();
        assert!(again.plan.status.is_converged(), "{phi:?}: {}", again.plan.status);
        values(&again)
    });
    let by_log = |gradient: &[f64]| gradient.iter().zip(phi).map(|(g, k)| g * k).collect::<Vec<_>>();
    let mut found = Vec::new();
    let mut errors = Vec::new();
    for ((name, functional), expected) in FUNCTIONALS.into_iter().zip(&expected) {
        state.total_gradient(task, phi, functional, &mut found).unwrap();
        errors.push((name, relative_error(&by_log(&found), &by_log(expected))));
    }
    state.nominal_gradient(task, phi, &mut found).unwrap();
    errors.push(("nominal cost", relative_error(&by_log(&found), &by_log(&expected[FUNCTIONALS.len()]))));
    errors
}

/// Steps of 1e-3 in log k: less is lost to rounding of the plans, more to higher orders. With `--nocapture` it says
/// what is reached.
#[test]
#[allow(clippy::print_stderr)]
fn total_gradients_are_those_of_the_task_planned_anew() {
    let problem = door();
    for phi in [[1e6, 1e6, 1e6], [1e5, 1e4, 3e4], [3e3, 1e4, 2e3]] {
        for (name, error) in gradient_errors(&problem, &phi, &tight(), 1e-3) {
            eprintln!("{name} at {phi:?}: off by {error:.1e}");
            assert!(error < 1e-4, "{name} at {phi:?}: off by {error:.1e}");
        }
    }
}
