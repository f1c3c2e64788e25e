//! Sub-steps of integration against whole steps, where accelerations are solved for in another way.

use crate::robot::arm::{Description, arm, steps};
use crate::robot::assert_close;
use crate::robot::examples;

/// Its task with sub-steps in each step of `time_step`.
fn with(mut description: Description, substeps: usize, time_step: f64) -> Description {
    description.model.insert_str(0, &format!("substeps = {substeps}\n"));
    description.time_step = format!("{time_step:?}");
    description
}

/// The first state and some control of a problem.
fn start(description: &Description) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let problem = description.problem();
    let phi = problem.parameters.initial();
    let x = problem.tasks[0].initial_state.iter().map(|value| value.resolve(&phi)).collect();
    let u = [3.0, -1.0, 4.0][..problem.tasks[0].system.dimensions().controls].to_vec();
    (x, u, phi)
}

#[test]
fn one_substep_is_a_step() {
    for description in [arm(), examples::of_compliance().remove(1)] {
        let (x, u, phi) = start(&description);
        let [plain, one] = [description.problem(), with(description.clone(), 1, 0.02).problem()];
        assert_eq!(steps(&plain, &x, &u, &phi, 3), steps(&one, &x, &u, &phi, 3));
    }
}

#[test]
fn substeps_are_shorter_steps_with_one_control() {
    for description in examples::of_compliance() {
        let (x, u, phi) = start(&description);
        for count in [2, 4] {
            let whole = with(description.clone(), count, 0.02).problem();
            let parts = with(description.clone(), 1, 0.02 / count as f64).problem();
            let [found, expected] = [steps(&whole, &x, &u, &phi, 1), steps(&parts, &x, &u, &phi, count)];
            assert_close("state", &found, &expected, 1e-12);
        }
    }
}

#[test]
fn substeps_come_closer_to_continuous_time() {
    let description = examples::of_compliance().remove(0);
    let (x, u, phi) = start(&description);
    let end = |substeps| steps(&with(description.clone(), substeps, 0.02).problem(), &x, &u, &phi, 2);
    let exact = end(512);
    let error = |substeps| crate::common::reference::relative_error(&end(substeps), &exact);
    assert!(error(8) < 0.2 * error(1), "{} and {}", error(8), error(1));
}

/// Large robots may have as many as small ones.
#[test]
fn a_large_robot_has_many() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/iiwa_door.toml");
    let text = std::fs::read_to_string(&path).unwrap().replacen("gravity =", "substeps = 1000\ngravity =", 1);
    let problem = supple_file::parse(&text, &path.display().to_string()).unwrap();
    let (phi, task) = (problem.parameters.initial(), &problem.tasks[0]);
    assert_eq!(task.system.substeps(), Some(1000));
    let x: Vec<f64> = task.initial_state.iter().map(|value| value.resolve(&phi)).collect();
    let u = vec![0.0; task.system.dimensions().controls];
    assert!(steps(&problem, &x, &u, &phi, 1).iter().all(|entry| entry.is_finite()));
}
