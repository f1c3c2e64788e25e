//! Sensors of what depends on the control measure the last step (theory, equation R.28).

use nalgebra::DMatrix;
use supple::pipeline::TaskState;
use supple::{EvaluateOptions, Problem};

use crate::robot::arm::{Description, arm, observe, sensor};

fn evaluated(problem: &Problem) -> TaskState {
    let mut state = TaskState::new(&problem.tasks[0]);
    state.evaluate(&problem.tasks[0], &problem.parameters.initial(), &problem.planning, None).unwrap();
    state
}

fn measured(sensors: &str) -> f64 {
    evaluated(&arm().sensing(sensors).problem()).information.total
}

const ENCODERS: &str = "select = [\"shoulder\", \"elbow\", \"slide\"]\nvariance = 1e-3";

/// The filter written once more: an acceleration of the last step is the difference of velocities, process noise included.
#[test]
fn an_accelerometer_measures_the_change_of_velocity_with_its_noise() {
    let accelerometer = sensor("joint_acceleration", "variance = 0.04");
    let problem = arm().sensing(&(sensor("joint_position", ENCODERS) + &accelerometer)).problem();
    let state = evaluated(&problem);
    let (n, dt, steps) = (6, 0.02, problem.tasks[0].steps);
    let names = problem.tasks[0].system.state_names();
    assert_eq!(names[n..], ["last.a.shoulder", "last.a.elbow", "last.a.slide"]);
    // With the state [x, x of the last step]: q, v, q-, v-.
    let own = |matrix: &supple::Matrices, t: usize, rows: usize, cols: usize| {
        DMatrix::from_fn(rows, cols, |i, j| matrix.get(t, i, j))
    };
    let (mut c, mut v) = (DMatrix::zeros(6, 2 * n), DMatrix::from_diagonal_element(6, 6, 1e-3));
    for joint in 0..3 {
        c[(joint, joint)] = 1.0;
        c[(3 + joint, 3 + joint)] = 1.0 / dt;
        c[(3 + joint, n + 3 + joint)] = -1.0 / dt;
        v[(3 + joint, 3 + joint)] = 0.04;
    }
    let (x0, w) = (own(&state.noise.initial, 0, n, n), own(&state.noise.process, 0, n, n));
    // The first difference is 0: both velocities are the first.
    let doubled = DMatrix::from_fn(2 * n, n, |i, j| f64::from(u8::from(i % n == j)));
    let mut predicted = &doubled * x0 * doubled.transpose();
    let mut nats = 0.0;
    for t in 0..=steps {
        let s = &c * &predicted * c.transpose() + &v;
        nats += 0.5 * (s.determinant() / v.determinant()).ln();
        let gain = &predicted * c.transpose() * s.try_inverse().unwrap();
        let corrected = &predicted - &gain * &c * &predicted;
        if t < steps {
            let mut a = DMatrix::zeros(2 * n, 2 * n);
            a.view_mut((0, 0), (n, n)).copy_from(&own(&state.plan.knots.dynamics, t, n, n));
            a.view_mut((n, 0), (n, n)).fill_with_identity();
            predicted = &a * corrected * a.transpose();
            let mut noisy = predicted.view_mut((0, 0), (n, n));
            noisy += &w;
        }
    }
    assert!((state.information.total - nats).abs() < 1e-9 * nats, "{} for {nats}", state.information.total);
}

#[test]
fn the_last_control_is_known_already() {
    let encoders = sensor("joint_position", ENCODERS);
    let control = sensor("control", "variance = 1e-6");
    let alone = measured(&encoders);
    assert!((measured(&(encoders.clone() + &control)) - alone).abs() < 1e-12 * alone);
    // The order of sensors does not matter, and a noisy accelerometer tells little.
    let accelerometer = |variance: &str| sensor("joint_acceleration", &format!("variance = {variance}"));
    let (first, last) =
        (measured(&(accelerometer("0.1") + &encoders)), measured(&(encoders.clone() + &accelerometer("0.1"))));
    assert!(first > alone + 0.1 && (first - last).abs() < 1e-12 * first, "{first}, {last}, {alone}");
    assert!(measured(&(encoders + &accelerometer("1e9"))) - alone < 1e-6);
}

#[test]
fn the_plan_is_that_without_such_sensors() {
    let encoders = sensor("joint_position", ENCODERS);
    let all = ["joint_acceleration", "drive_effort", "power", "control", "state_and_control"];
    let sensors = all.map(|kind| sensor(kind, "variance = 0.1")).concat();
    let plain = evaluated(&arm().sensing(&encoders).problem());
    let problem = arm().sensing(&(encoders + &sensors)).problem();
    let found = evaluated(&problem);
    let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let controls = (found.plan.trajectory.controls.as_slice(), plain.plan.trajectory.controls.as_slice());
    assert!(difference(controls.0, controls.1) < 1e-9);
    // What is measured at a step is what was in the one before.
    let channels = problem.tasks[0].system.channels().measurements;
    let control = channels.iter().rposition(|channel| channel.name == "tau.elbow").unwrap();
    let x = found.plan.trajectory.states.vector(3);
    let y = observe(&problem, x, &[]);
    assert!((y[control] - found.plan.trajectory.controls.vector(2)[1]).abs() < 1e-12, "{channels:?}");
    let at = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default()).unwrap();
    assert!(at.feasible && at.warnings().next().is_none(), "{:?}", at.warnings().collect::<Vec<_>>());
}

/// A meter of the torque of a position drive measures what moved the joint: the torque at the end of the last step.
#[test]
fn efforts_of_position_drives_are_measured() {
    let drives = "[model.drives]\nshoulder = { kp = 400.0, kv = 20.0 }\n";
    let sensors =
        sensor("joint_position", ENCODERS) + &sensor("drive_effort", "select = [\"shoulder\"]\nvariance = 0.1");
    let problem = arm().with(drives).sensing(&sensors).problem();
    let found = evaluated(&problem);
    let (x, u) = (&found.plan.trajectory.states, &found.plan.trajectory.controls);
    for t in [1, 3, problem.tasks[0].steps] {
        let (now, before) = (x.vector(t), u.vector(t - 1));
        let torque = 400.0 * (before[0] - now[0]) - 20.0 * now[3];
        let y = observe(&problem, now, &[]);
        assert!((y[3] - torque).abs() < 1e-9 * (1.0 + torque.abs()), "{} for {torque} at {t}", y[3]);
    }
}

#[test]
fn catalogues_offer_them_and_may_leave_them_out() {
    let catalogue = "[catalogue]\nbase = [\"q.elbow\", \"a.slide\"]\nchosen = [\"imu\"]\n\
                     [[catalogue.sensors]]\nname = \"imu\"\nkind = \"joint_acceleration\"\nvariance = 0.1\n\
                     [[catalogue.sensors]]\nname = \"meter\"\nkind = \"power\"\nvariance = 0.1\n";
    let sensors = sensor("joint_acceleration", "select = [\"elbow\", \"slide\"]\nvariance = 0.3")
        + &sensor("joint_position", ENCODERS)
        + catalogue;
    let problem = Description { ..arm().sensing(&sensors) }.problem();
    let channels = problem.tasks[0].system.channels();
    let names = |list: &[supple::Channel]| list.iter().map(|channel| channel.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&channels.measurements), ["q.elbow", "a.slide", "a.shoulder", "a.elbow", "a.slide.2"]);
    assert_eq!(names(&channels.states)[6..], ["last.a.slide", "last.a.shoulder", "last.a.elbow", "last.a.slide.2"]);
    // The slide's acceleration by the base, by the catalogue, and by velocities.
    let state = evaluated(&problem);
    let at = |t: usize| state.plan.trajectory.states.vector(t);
    let y = observe(&problem, at(4), &[]);
    let acceleration = (at(4)[5] - at(3)[5]) / 0.02;
    assert!(acceleration.abs() > 0.01 && [y[1], y[4]].iter().all(|y| (y - acceleration).abs() < 1e-9), "{y:?}");
}
