//! Limits that a plan violates are reported, and what a robot's file has wrong.

use supple::{Channels, Dimensions, EvaluateOptions, Limit, LimitViolation, Problem, Trajectory, limits_violated};

use crate::common::reference::assert_near;
use crate::common::{numbers, repository, shipped};
use crate::robot::arm::arm;

const SIZE: Dimensions = Dimensions { states: 2, controls: 1, measurements: 0 };

fn channels() -> Channels {
    let mut channels = Channels::plain(vec!["first".into(), "second".into()], SIZE);
    channels.controls[0].unit = "N m".into();
    channels
}

/// Two states over five steps and one control over four.
fn trajectory() -> Trajectory {
    let mut trajectory = Trajectory::zeros(SIZE, 4);
    for (t, row) in [[0.0, 1.0], [0.5, 2.0], [-0.5, 3.0], [-0.7, 3.0], [0.6, 0.0]].iter().enumerate() {
        trajectory.states.vector_mut(t)[..2].copy_from_slice(row);
    }
    for (t, u) in [10.0, 10.0 + 1e-9, -12.0, 9.0].into_iter().enumerate() {
        trajectory.controls.vector_mut(t)[0] = u;
    }
    trajectory
}

#[test]
fn worst_value_first_step_and_number_of_steps_of_each_side_are_found() {
    let limits = [
        Limit::state("first".into(), 0, -0.6, 0.4),
        Limit::state("second".into(), 1, f64::NEG_INFINITY, 2.5),
        Limit::state("free".into(), 1, f64::NEG_INFINITY, f64::INFINITY),
        Limit::control("control".into(), 0, -11.0, 10.0),
    ];
    let of = |name: &str, worst, limit, step, steps| {
        let unit = if name == "control" { "N m".to_owned() } else { String::new() };
        LimitViolation { name: name.into(), unit, worst, limit, step, steps, is_of_task: false }
    };
    let expected = [
        of("first", 0.6, 0.4, 4, 2),
        of("first", -0.7, -0.6, 3, 1),
        of("second", 3.0, 2.5, 2, 2),
        // The control is at its upper limit, but for rounding.
        of("control", -12.0, -11.0, 2, 1),
    ];
    assert_eq!(limits_violated(&limits, &channels(), &trajectory()), expected);
}

#[test]
fn plan_within_its_limits_violates_none() {
    let found = limits_violated(&[Limit::state("first".into(), 0, -0.7, 0.6)], &channels(), &trajectory());
    assert_eq!(found, []);
}

/// The torque that the golden file gives as its peak is above what the arm can do.
#[test]
fn opening_the_door_needs_more_than_the_arms_effort() {
    let golden: serde_json::Value = serde_json::from_str(include_str!("../../golden/door_open_1e6.json")).unwrap();
    let problem = shipped("iiwa_door.toml");
    let options = EvaluateOptions { trajectories: true, ..Default::default() };
    let at = problem.evaluate(&numbers(&golden["linear_stiffness"]), &options).unwrap();
    let task = at.tasks.iter().find(|task| task.name == "open").unwrap();
    let efforts: Vec<_> = task.limits_violated.iter().filter(|found| found.name.starts_with("effort")).collect();
    let [effort] = efforts[..] else { panic!("{efforts:?}") };
    assert_eq!((effort.name.as_str(), effort.limit), ("effort of joint `iiwa_joint_6`", 300.0));
    assert_near("peak torque", effort.worst, golden["peak_torque"].as_f64().unwrap(), 1e-6);
    let controls = &task.trajectory.as_ref().unwrap().controls;
    assert_eq!(controls[effort.step][5], effort.worst);
    assert_eq!(effort.steps, controls.iter().filter(|u| u[5] > 300.0).count());
}

#[test]
fn json_names_what_is_violated() {
    let mut description = arm();
    description.start = description.start.replace("\"q.slide\" = 0.1", "\"q.slide\" = 0.31");
    let at = description.problem().evaluate(&[], &EvaluateOptions::default()).unwrap();
    let found = serde_json::to_value(&at.tasks[0].limits_violated).unwrap();
    let entry = found.as_array().unwrap().iter().find(|entry| entry["name"] == "position of joint `slide`").unwrap();
    assert_eq!(entry["limit"], 0.3);
    assert!(entry["worst"].as_f64().unwrap() >= 0.31 && entry["step"].is_u64(), "{entry}");
    assert!(entry["steps"].as_u64().unwrap() >= 1, "{entry}");
}

#[test]
fn gravity_in_millimetres_is_doubted() {
    let path = repository("tasks").join("peg_on_wall.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let with = |gravity: &str| {
        let text = text.replace("gravity = [0.0, 0.0, 0.0]", &format!("gravity = {gravity}"));
        supple_file::parse(&text, path.to_str().unwrap()).unwrap().warnings
    };
    let [warning] = &with("[0.0, 0.0, -9810.0]")[..] else { panic!("one warning") };
    assert!(warning.ends_with("model.gravity: is 9810 m/s^2, more than on any planet; lengths are in m"), "{warning}");
    assert_eq!(with("[0.0, 0.0, -25.0]"), [""; 0]);
}

#[test]
fn warnings_of_the_robots_file_are_those_of_the_problem() {
    let warnings = arm().problem().warnings;
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("link `upper`") && warnings[0].contains("(line 12)"), "{warnings:?}");
    let Problem { warnings, .. } = shipped("two_mass.toml");
    assert_eq!(warnings, Vec::<String>::new());
}

/// The limit of a drive with a gear is on the motor's side, that of the file on the joint's.
#[test]
fn limits_of_drives_with_gears_say_so() {
    let limit = |gear: &str| {
        let problem = arm().with(&format!("[model.drives.elbow]\ngear = {gear}\n")).problem();
        let limits = problem.tasks[0].system.limits().into_iter();
        let efforts = limits.filter(|limit| limit.name.starts_with("effort of") && limit.name.contains("`elbow`"));
        efforts.map(|limit| (limit.name, limit.upper)).collect::<Vec<_>>()
    };
    let [(name, effort)] = &limit("1.0")[..] else { panic!("one limit") };
    assert_eq!(name, "effort of joint `elbow`");
    let of_drive = "effort of the drive of joint `elbow`, before its gear".to_owned();
    assert_eq!(limit("20.0"), [(of_drive, effort / 20.0)]);
}
