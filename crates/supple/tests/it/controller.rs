//! The controller along a plan: against roll-outs with the extended filter, and against its own formulas.

use crate::common::shipped;
use supple::design::{Attempts, plan_at};
use supple::pipeline::TaskState;
use supple::simulate::{Rollouts, monte_carlo};
use supple::{Controller, Error, EvaluateOptions, Problem};

/// The controller of a problem's first task at its initial parameters, and what made it.
fn planned(problem: &Problem) -> (Controller, TaskState) {
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let mut state = TaskState::new(task);
    plan_at(problem, task, &phi, None, Attempts::default(), &mut state).unwrap();
    (Controller::of(task, &phi, &state.plan).unwrap(), state)
}

/// Where the system is linear, and its noise does not vary, roll-outs run the same filter: their controls are the same.
#[test]
fn controls_are_those_of_roll_outs_of_a_linear_system() {
    let problem = shipped("tanaka_plant.toml");
    let (controller, _) = planned(&problem);
    let mut largest = 0.0_f64;
    for seed in 0..20 {
        let wanted = EvaluateOptions { seed, trajectories: true, ..Default::default() };
        let evaluation = problem.evaluate(&problem.parameters.initial(), &wanted).unwrap();
        let sample = &evaluation.tasks[0].trajectory.as_ref().unwrap().sample;
        let mut run = controller.start();
        for (t, expected) in sample.controls.iter().enumerate() {
            assert!(controller.step(&mut run, &sample.measurements[t]).unwrap());
            for (u, expected) in run.controls.iter().zip(expected) {
                assert!((u - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "step {t}: {u} for {expected}");
                largest = largest.max(u.abs());
            }
            for (x, expected) in run.estimate.iter().zip(&sample.estimates[t]) {
                assert!((x - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "step {t}: {x} for {expected}");
            }
        }
    }
    assert!(largest > 1.0, "the controls move: {largest}");
}

/// Roll-outs with this filter, of nonlinear plants and under noise that varies with the state, run what `step` computes.
///
/// They hold the estimate itself, not its deviation from the plan, which rounds to the last bit of the plan's state: where
/// the dynamics are as stiff as the door's, entries of `A` near 600 and gains near 10000 make more of that.
#[test]
fn steps_are_those_of_roll_outs_along_the_plan() {
    let tasks = [("two_mass", 1e-12), ("soft_gripper", 1e-12), ("light_dark", 1e-12), ("iiwa_door", 1e-6)];
    for (file, tolerance) in tasks {
        let file = &format!("{file}.toml");
        let problem = shipped(file);
        let (controller, _) = planned(&problem);
        let sample = controller.sample(&problem.tasks[0], &problem.parameters.initial(), 2).unwrap();
        assert!(sample.cost.is_finite(), "{file}");
        let (mut run, mut worst) = (controller.start(), 0.0_f64);
        for (t, expected) in sample.controls.iter().enumerate() {
            assert!(controller.step(&mut run, &sample.measurements[t]).unwrap());
            for (u, expected) in run.controls.iter().zip(expected) {
                worst = worst.max((u - expected).abs() / (1.0 + expected.abs()));
            }
        }
        println!("{file}: controls differ by {worst:.1e}");
        assert!(worst <= tolerance, "{file}: controls differ by {worst}");
    }
}

/// The cost of the controller in closed loop, and the consistency of its filter, are those of the extended one where both
/// are the same filter.
#[test]
fn closed_loops_of_a_linear_system_are_the_same() {
    let problem = shipped("tanaka_plant.toml");
    let (controller, state) = planned(&problem);
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let rollouts = Rollouts { count: 100, seed: 7 };
    let along = controller.monte_carlo(task, &phi, 0.0, rollouts).unwrap();
    let extended = monte_carlo(task, &phi, &state.plan, &state.noise, 0.0, rollouts).unwrap();
    for (cost, expected) in along.costs.iter().zip(&extended.costs) {
        assert!((cost - expected).abs() <= 1e-10 * expected, "{cost} for {expected}");
    }
    let [along, extended] =
        [along, extended].map(|found| (found.consistency.unwrap().mean, found.realised_bits.unwrap().mean));
    assert!((along.0 - extended.0).abs() < 1e-10 && (along.1 - extended.1).abs() < 1e-10 * extended.1);
}

/// Measurements that the plan expects leave it as it is, whatever the system.
#[test]
fn what_the_plan_expects_changes_nothing() {
    for file in ["two_mass.toml", "soft_gripper.toml", "light_dark.toml"] {
        let (controller, state) = planned(&shipped(file));
        let mut run = controller.start();
        for t in 0..controller.steps() {
            assert!(controller.step(&mut run, controller.expected.vector(t)).unwrap());
            let (ubar, k) = (state.plan.trajectory.controls.vector(t), state.plan.policy.feedforward.vector(t));
            for ((u, ubar), k) in run.controls.iter().zip(ubar).zip(k) {
                assert!((u - ubar - k).abs() <= 1e-7 * (1.0 + ubar.abs()), "{file}, step {t}: {u} for {ubar} + {k}");
            }
        }
    }
}

/// Covariances are those that information and cost were computed with, and gains are those of the filter in its first form.
#[test]
fn covariances_and_gains_are_those_of_the_belief() {
    for file in ["two_mass.toml", "peg_on_wall.toml", "light_dark.toml"] {
        let (controller, state) = planned(&shipped(file));
        assert_eq!(controller.corrected.as_slice(), state.belief.corrected.as_slice(), "{file}");
        assert_eq!(controller.predicted.as_slice(), state.belief.predicted.as_slice(), "{file}");
        let (n, p) = (controller.dimensions.states, controller.dimensions.measurements);
        for t in 0..=controller.steps() {
            // L V = Sigma C'.
            for (i, j) in (0..n).flat_map(|i| (0..p).map(move |j| (i, j))) {
                let gain = |k| controller.filter_gain.get(t, i, k);
                let left: f64 = (0..p).map(|k| gain(k) * controller.noise.measurement.get(t, k, j)).sum();
                let sigma_c = |k| controller.corrected.get(t, i, k) * controller.measurement.get(t, j, k);
                let right: f64 = (0..n).map(sigma_c).sum();
                let size: f64 = (0..n).map(|k| sigma_c(k).abs()).sum();
                assert!((left - right).abs() <= 1e-6 * size + 1e-300, "{file}, step {t}: {left} and {right}");
            }
        }
    }
}

/// After N steps nothing is read past the end, and `start` begins anew.
#[test]
fn a_plan_ends_and_begins_anew() {
    let (controller, _) = planned(&shipped("two_mass.toml"));
    let measured = vec![0.3; controller.dimensions.measurements];
    let run_all = || {
        let mut run = controller.start();
        let mut controls = Vec::new();
        while controller.step(&mut run, &measured).unwrap() {
            controls.push(run.controls.clone());
        }
        (run, controls)
    };
    let (mut run, controls) = run_all();
    assert_eq!((controls.len(), run.step), (125, 125));
    let before = run.clone();
    assert!(!controller.step(&mut run, &measured).unwrap());
    assert_eq!(run, before);
    assert_eq!(run_all().1, controls);
}

#[test]
fn wrong_measurements_are_refused_and_change_nothing() {
    let (controller, _) = planned(&shipped("two_mass.toml"));
    let mut run = controller.start();
    let p = controller.dimensions.measurements;
    controller.step(&mut run, &vec![0.1; p]).unwrap();
    let before = run.clone();
    let short = controller.step(&mut run, &vec![0.1; p + 1]).unwrap_err();
    assert_eq!(short.to_string(), format!("the measurement has length {}, not {p}", p + 1));
    let mut broken = vec![0.1; p];
    broken[p - 1] = f64::NAN;
    let broken = controller.step(&mut run, &broken).unwrap_err();
    assert!(matches!(broken, Error::Lqg(supple::lqg::Error::NotFinite { step: 1, .. })), "{broken}");
    assert_eq!(run, before);
}

/// A law that is not of the task's lengths is an error, and no panic.
#[test]
fn laws_of_other_lengths_are_refused() {
    let problem = shipped("two_mass.toml");
    let (controller, state) = planned(&problem);
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let policy = &state.plan.policy;
    let [feedforward, feedback] = [&policy.feedback, &policy.feedback].map(Clone::clone);
    let error = Controller::along(task, &phi, controller.trajectory.clone(), feedforward, feedback).unwrap_err();
    assert!(error.to_string().contains("the feedforward of a controller of task `press`"), "{error}");
}
