//! What each measurement gives, how much a controller changes, and that reports survive JSON.

use crate::common::shipped;
use supple::pipeline::TaskState;
use supple::{EvaluateOptions, Evaluation, Matrices, Problem};

fn with_trajectories(problem: &Problem) -> Evaluation {
    let options = EvaluateOptions { trajectories: true, total_gradient: true, rollouts: 2, ..Default::default() };
    problem.evaluate(&problem.parameters.initial(), &options).unwrap()
}

#[test]
fn of_two_measurements_one_alone_and_the_other_beyond_it_give_all() {
    let found = with_trajectories(&shipped("two_mass.toml"));
    let task = &found.tasks[0];
    let [first, second] = &task.trajectory.as_ref().unwrap().measurements[..] else { panic!("two measurements") };
    for (t, all) in task.information.per_step_nats.iter().enumerate() {
        for (one, other) in [(first, second), (second, first)] {
            let sum = one.alone_nats[t] + other.beyond_others_nats[t];
            assert!((sum - all).abs() < 1e-12 * (1.0 + all), "{}, step {t}: {sum} and {all}", one.name);
        }
    }
}

#[test]
fn measurements_share_information() {
    let found = with_trajectories(&shipped("iiwa_door.toml"));
    for task in &found.tasks {
        let measurements = &task.trajectory.as_ref().unwrap().measurements;
        assert_eq!(measurements.len(), 14);
        for (t, &all) in task.information.per_step_nats.iter().enumerate() {
            let alone: f64 = measurements.iter().map(|one| one.alone_nats[t]).sum();
            let beyond: f64 = measurements.iter().map(|one| one.beyond_others_nats[t]).sum();
            assert!(-1e-12 <= beyond && beyond <= all + 1e-12 && all <= alone + 1e-12, "{beyond} {all} {alone}");
        }
    }
}

#[test]
fn a_measurement_saves_the_cost_of_not_reading_it() {
    let problem = shipped("two_mass.toml");
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let mut state = TaskState::new(task);
    let controls = task.guess(&phi, 1.0);
    state.evaluate(task, &phi, &problem.planning, Some(&controls)).unwrap();
    let options = EvaluateOptions { trajectories: true, controls: Some(vec![controls]), ..EvaluateOptions::default() };
    let found = problem.evaluate(&phi, &options).unwrap();
    let measurements = &found.tasks[0].trajectory.as_ref().unwrap().measurements;
    let (p, c, xi) = (&state.belief.predicted, &state.plan.knots.measurement, &state.plan.policy.value_of_information);
    for t in [0, 1, 40, 80, 124] {
        for (left_out, report) in measurements.iter().enumerate() {
            let read = 1 - left_out;
            let without = corrected_by_one(p, c, t, read, state.noise.measurement.get(0, read, read));
            let sum = |of: &dyn Fn(usize, usize) -> f64| -> f64 {
                (0..5).map(|i| (0..5).map(|j| xi.get(t, i, j) * of(i, j)).sum::<f64>()).sum()
            };
            let expected = 0.5 * (sum(&|i, j| without[i][j]) - sum(&|i, j| state.belief.corrected.get(t, i, j)));
            let saved = report.saved_cost[t];
            assert!((saved - expected).abs() < 1e-9 * (1.0 + expected), "step {t}: {saved} and {expected}");
            assert!(saved >= 0.0);
        }
    }
}

/// `P - P c' c P / (c P c' + v)`
fn corrected_by_one(p: &Matrices, c: &Matrices, t: usize, row: usize, variance: f64) -> Vec<Vec<f64>> {
    let pc: Vec<f64> = (0..5).map(|i| (0..5).map(|j| p.get(t, i, j) * c.get(t, row, j)).sum()).collect();
    let innovation: f64 = variance + (0..5).map(|i| c.get(t, row, i) * pc[i]).sum::<f64>();
    (0..5).map(|i| (0..5).map(|j| p.get(t, i, j) - pc[i] * pc[j] / innovation).collect()).collect()
}

#[test]
fn the_variation_of_a_controller_is_that_of_its_gains() {
    let found = with_trajectories(&shipped("two_mass.toml"));
    let task = &found.tasks[0];
    let gains: Vec<Vec<f64>> = task.trajectory.as_ref().unwrap().feedback.iter().map(|gains| gains.concat()).collect();
    let count = gains.len() as f64;
    let mean: Vec<f64> = (0..5).map(|i| gains.iter().map(|k| k[i]).sum::<f64>() / count).collect();
    let square = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let variance = gains.iter().map(|k| square(k, &mean)).sum::<f64>() / count;
    let size = gains.iter().map(|k| square(k, &[0.0; 5])).sum::<f64>() / count;
    let controller = task.controller;
    assert!((controller.feedback_variance / variance - 1.0).abs() < 1e-12);
    assert!((controller.feedback_variation / (variance / size).sqrt() - 1.0).abs() < 1e-12);
    assert!(controller.feedback_variation > 0.0 && controller.feedback_variation < 1.0);
}

#[test]
fn a_report_survives_json() {
    let found = with_trajectories(&shipped("two_mass.toml"));
    let text = serde_json::to_string(&found).unwrap();
    let read: Evaluation = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&read).unwrap(), text);
    assert_eq!(read.parameters, found.parameters);
}

#[test]
fn a_closed_loop_sample_is_the_first_of_the_roll_outs() {
    let problem = shipped("two_mass.toml");
    let options = EvaluateOptions { trajectories: true, rollouts: 1, seed: 7, ..EvaluateOptions::default() };
    let found = problem.evaluate(&problem.parameters.initial(), &options).unwrap();
    let task = &found.tasks[0];
    let sample = &task.trajectory.as_ref().unwrap().sample;
    assert_eq!(sample.cost, task.monte_carlo.as_ref().unwrap().cost_mean);
    assert_eq!((sample.states.len(), sample.estimates.len(), sample.controls.len()), (126, 126, 125));
    // The filter does not know the wall at first, and the truth is where the noise put it.
    assert!(sample.states[0][4] != 0.75 && sample.deviations[0][4] > 0.0);
}

#[test]
fn a_design_of_the_wrong_length_is_an_error() {
    let problem = shipped("two_mass.toml");
    let error = problem.evaluate(&[500.0, 500.0], &EvaluateOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "the list of parameters has length 2, not 4");
    let control = supple::design::Control::default();
    assert!(supple::design::design(&problem, &[500.0], &problem.design, control).is_err());
}
