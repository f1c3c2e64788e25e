//! First states of robots: at rest, at a keyframe, at a pose; and what is wrong with them.

use supple::Problem;
use supple_robot::{Kinematics, LoadOptions, Numbers, Pose, Robot, Tree, load};

use crate::robot::arm::{Description, arm, compliance, cost, sensor};
use crate::robot::bad_tasks::{assert_errors, elastic, error_of};

fn start(description: Description, start: &str) -> Description {
    Description { start: start.into(), ..description }
}

/// The arm with another file.
fn with_file(file: &str) -> Description {
    let mut description = arm();
    description.model = format!("file = \"{file}\"\n");
    description
}

/// A robot of two joints, with the keyframes `home` and `bent`.
fn keyed(text: &str) -> Description {
    let sensors = sensor("joint_position", "select = [\"shoulder\", \"elbow\"]\nvariance = 1e-3");
    start(with_file("keyed.xml"), text).sensing(&sensors).costing(&cost("control", "weight = 0.01"))
}

/// The first state of the first task, by name.
fn first(problem: &Problem) -> Vec<f64> {
    let phi = problem.parameters.initial();
    problem.tasks[0].initial_state.iter().map(|value| value.resolve(&phi)).collect()
}

fn left_out(description: &Description) -> Problem {
    let text = description.text();
    let at = text.find("[tasks.initial_state]").unwrap();
    let end = text.find("[tasks.noise]").unwrap();
    supple_file::parse(&[&text[..at], &text[end..]].concat(), "tests/data/task.toml").unwrap()
}

#[test]
fn what_is_left_out_is_at_rest_within_limits() {
    let problem = left_out(&arm());
    assert_eq!(first(&problem), [0.0; 6]);
    // The elbow can be from 0.5 to 2.5 rad, the slide from 0.1 to 0.3 m.
    let problem = left_out(&with_file("stops.urdf"));
    assert_eq!(first(&problem), [0.0, 1.5, 0.2, 0.0, 0.0, 0.0]);
    assert!(problem.warnings.iter().all(|warning| !warning.contains("starts")), "{:?}", problem.warnings);
    let problem = start(with_file("stops.urdf"), "\"q.elbow\" = 1.0\n\"v.slide\" = 0.3\n").problem();
    assert_eq!(first(&problem), [0.0, 1.0, 0.2, 0.0, 0.0, 0.3]);
}

#[test]
fn motors_start_where_their_joints_are_unless_it_is_said_otherwise() {
    let problem = start(elastic(), "\"q.shoulder\" = 0.3\n\"v.shoulder\" = 0.1\n").problem();
    // q, motor, v, velocity of the motor
    assert_eq!(first(&problem), [0.3, 0.0, 0.0, 0.3, 0.1, 0.0, 0.0, 0.1]);
    let problem = start(elastic(), "\"q.shoulder\" = 0.3\n\"q.flexible\" = 0.0\n").problem();
    assert_eq!(first(&problem)[3], 0.0);
    // A parameter in the joint's position moves the motor too.
    let problem = start(elastic(), "\"q.shoulder\" = \"lean\"\n").where_(&[("lean", 0.2)]).problem();
    assert_eq!(problem.tasks[0].initial_state[3].resolve(&[0.7]), 0.7);
}

#[test]
fn keyframes_give_positions_and_velocities() {
    assert_eq!(first(&keyed("key = \"home\"\n").problem()), [0.4, -1.2, 0.1, 0.2]);
    assert_eq!(first(&keyed("key = \"home\"\n\"q.elbow\" = 0.5\n").problem()), [0.4, 0.5, 0.1, 0.2]);
    let flexible = compliance("elastic_joint", "motor", "joint = \"elbow\"\nstiffness = 30.0\nmotor_inertia = 0.05");
    assert_eq!(first(&keyed("key = \"home\"\n").with(&flexible).problem()), [0.4, -1.2, -1.2, 0.1, 0.2, 0.2]);
    let outside = keyed("key = \"bent\"\n").problem();
    assert_eq!(first(&outside), [0.4, 2.6, 0.0, 0.0]);
    let said = "task `task`: the initial value of position of joint `elbow`, 2.6, is outside its range [-2.5, 2.5]";
    assert!(outside.warnings.contains(&said.to_owned()), "{:?}", outside.warnings);
    assert!(outside.every_warning.contains(&said.to_owned()), "{:?}", outside.every_warning);
}

#[test]
fn keyframes_that_do_not_exist() {
    assert_errors(vec![
        (
            keyed("key = \"hom\"\n"),
            "task.toml:13:7: tasks[0].initial_state.key: the robot's file has no keyframe `hom`: it has `home`, \
             `bent` (did you mean `home`?)",
        ),
        (
            keyed("key = \"zzz\"\n"),
            "task.toml:13:7: tasks[0].initial_state.key: the robot's file has no keyframe `zzz`: it has `home`, \
             `bent` (write key = \"home\")",
        ),
        (
            start(arm(), "key = \"home\"\n"),
            "task.toml:13:7: tasks[0].initial_state.key: the robot's file has no keyframe `home`: none are defined (name \
             positions of joints instead, or give a `pose`)",
        ),
        (start(arm(), "key = 3\n"), "task.toml:13:7: tasks[0].initial_state.key: must be text in quotes; found 3"),
    ]);
}

/// Where `tool` of the arm is.
struct Tool {
    robot: Robot,
    tree: Tree,
}

impl Tool {
    fn new() -> Self {
        let robot = load("tests/data/arm.urdf", &LoadOptions::default()).unwrap();
        Self { tree: Tree::new(&robot), robot }
    }

    /// At positions of the joints.
    fn at(&self, q: &[f64]) -> Pose {
        let numbers = Numbers::of(&self.robot, [0.0; 3]);
        Kinematics::at_rest(&self.tree, &numbers, q).poses()[self.robot.link("tool").unwrap()]
    }
}

fn tool_at(q: &[f64]) -> Pose {
    Tool::new().at(q)
}

fn pose(keys: &str) -> String {
    format!("pose = {{ frame = \"tool\", {keys} }}\n")
}

#[test]
fn poses_are_reached_by_inverse_kinematics() {
    let there = tool_at(&[0.3, -0.4, 0.1]);
    let problem = start(arm(), &pose(&format!("position = {:?}", there.position))).problem();
    let found = first(&problem);
    let at = tool_at(&found[..3]).position;
    assert!((0..3).all(|i| (at[i] - there.position[i]).abs() < 2e-6), "{at:?}, {:?}", there.position);
    assert_eq!(found[3..], [0.0; 3]);

    let [[r00, ..], [r10, ..], [r20, r21, r22]] = there.rotation;
    let rpy = [r21.atan2(r22), (-r20).asin(), r10.atan2(r00)];
    let whole = pose(&format!("position = {:?}, rpy = {rpy:?}", there.position));
    let found = first(&start(arm(), &whole).problem());
    for (found, expected) in found.iter().zip([0.3, -0.4, 0.1]) {
        assert!((found - expected).abs() < 1e-5, "{found} and {expected}");
    }
    // What the task says of a joint holds, and the others reach the pose.
    let held = start(arm(), &format!("{}\"q.slide\" = 0.1\n", pose(&format!("position = {:?}", there.position))));
    let found = first(&held.problem());
    assert_eq!(found[2], 0.1);
    let at = tool_at(&found[..3]).position;
    assert!((0..3).all(|i| (at[i] - there.position[i]).abs() < 2e-6), "{at:?}, {:?}", there.position);
}

#[test]
fn poses_that_cannot_be() {
    let tool = Tool::new();
    let far = error_of(&start(arm(), &pose("position = [0.0, 0.0, 5.0]")).text());
    let said = "task.toml:13:8: tasks[0].initial_state.pose: frame `tool` cannot reach this pose; the closest pose found is 3.6543 m away, with joints `elbow`, `slide` at their limits: ";
    assert!(far.starts_with(said) && far.ends_with("` (move the position nearer to the robot)"), "{far}");
    // The pose that was found can be typed, and is reached.
    let typed = &far[said.len() + 1..far.rfind('`').unwrap()];
    let reached = first(&start(arm(), &pose(typed)).problem());
    let [x, y, z] = tool.at(&reached[..3]).position;
    assert!(((x * x + y * y + (5.0 - z).powi(2)).sqrt() - 3.6543).abs() < 2e-4, "{reached:?}, {typed}");
    // The nearest of a grid of positions within the limits.
    let steps = |from: f64, to: f64| (0..=40).map(move |i| from + (to - from) * f64::from(i) / 40.0);
    let places =
        steps(-2.0, 2.0).flat_map(|a| steps(-2.5, 2.5).flat_map(move |b| [-0.2, 0.05, 0.3].map(|c| [a, b, c])));
    let distance = |q: [f64; 3]| {
        let [x, y, z] = tool.at(&q).position;
        (x * x + y * y + (5.0 - z).powi(2)).sqrt()
    };
    let nearest = places.map(distance).fold(f64::INFINITY, f64::min);
    assert!((nearest - 3.6543).abs() < 5e-3 && nearest > 3.6542, "{nearest}");
    // Too far for decimals, and for any robot.
    let farther = error_of(&start(arm(), &pose("position = [0.0, 0.0, 1e20]")).text());
    assert!(farther.contains("the closest pose found is 1e20 m away, with "), "{farther}");
    let nowhere = error_of(&start(arm(), &pose("position = [0.0, 0.0, 1e200]")).text());
    assert!(nowhere.ends_with("initial_state.pose.position: must be below 1e30 m; found 1e200"), "{nowhere}");
    let turned = error_of(&start(arm(), &pose("position = [0.0, 0.0, 5.0], rpy = [1.0, 0.0, 0.0]")).text());
    assert!(turned.contains(" rad away, with ") && turned.contains("or omit `rpy`"), "{turned}");
    assert_errors(vec![
        (
            start(arm(), "pose = { frame = \"tol\", position = [0.0, 0.0, 0.0] }\n"),
            "task.toml:13:18: tasks[0].initial_state.pose.frame: the robot has no link or frame `tol`: it has `base`, \
             `upper`, `fore`, `tip`, `tool` (did you mean `tool`?)",
        ),
        (
            start(arm(), "pose = { frame = \"base\", position = [0.0, 0.0, 0.0] }\n"),
            "task.toml:13:18: tasks[0].initial_state.pose.frame: frame `base` cannot move: it is fixed to the world \
             (name a frame that a joint moves)",
        ),
        (
            start(arm(), "pose = { frame = \"tool\" }\n"),
            "task.toml:13:8: tasks[0].initial_state.pose.position: is missing",
        ),
        (
            start(arm(), &pose("position = [0.0, 0.0, \"far\"]")),
            "task.toml:13:48: tasks[0].initial_state.pose.position[2]: must be a number; found \"far\"",
        ),
        (
            start(arm(), &pose("position = [0.0, 0.0, nan]")),
            "task.toml:13:37: tasks[0].initial_state.pose.position: must be finite numbers",
        ),
        (
            start(arm(), &pose("position = [0.0, 0.0, 0.0], ypr = [0.0, 0.0, 0.0]")),
            "task.toml:13:54: tasks[0].initial_state.pose.ypr: unknown key `ypr`; valid: `frame`, `position`, `rpy`",
        ),
    ]);
}

#[test]
fn starts_outside_limits_are_warned_of() {
    let problem = start(arm(), "\"q.slide\" = 0.5\n\"v.elbow\" = -11.0\n").problem();
    let said = |warning: &&String| warning.contains("the initial value");
    let found: Vec<_> = problem.warnings.iter().filter(said).map(String::as_str).collect();
    assert_eq!(
        found,
        [
            "task `task`: the initial value of velocity of joint `elbow`, -11, is outside its range [-10, 10]",
            "task `task`: the initial value of position of joint `slide`, 0.5, is outside its range [-0.2, 0.3]",
        ]
    );
}

#[test]
fn targets_and_limits_that_cannot_be_are_warned_of() {
    let said = |costs: &str| {
        let warnings = arm().costing(costs).problem().warnings;
        warnings
            .into_iter()
            .filter(|warning| warning.contains("(joint_position)") || warning.contains("(frame_point)"))
            .collect::<Vec<_>>()
    };
    let position = |keys: &str| cost("joint_position", &format!("select = [\"elbow\", \"slide\"]\n{keys}"));
    let point = |target: &str| cost("frame_point", &format!("frame = \"tool\"\ntarget = {target}\nweight = 1.0"));
    let limit = |keys: &str| position(keys).replace("tasks.costs", "tasks.limits");
    assert_eq!(
        said(&(position("target = [30.0, 0.1]\nweight = 1.0") + &point("[0.5, 120.0, 0.0]"))),
        [
            "task `task`: cost 1 (joint_position): the target of position of joint `elbow`, 30, is outside its range \
             [-2.5, 2.5] (angles are in rad: 30 degrees are 0.5236 rad)",
            "task `task`: cost 2 (frame_point): its target is 120 m from where the frame starts, at 0.439, 0.029, 0.75 m (lengths are in m)",
        ]
    );
    let control = cost("control", "weight = 1.0");
    assert_eq!(
        said(&(control.clone() + &position("target = [0.0, 3.0]\nweight = 0.0") + &limit("upper = [90.0, 300.0]"))),
        [
            "task `task`: limit 1 (joint_position): the limit of position of joint `elbow`, 90, is outside its range \
             [-2.5, 2.5] (angles are in rad: 90 degrees are 1.5708 rad)",
            "task `task`: limit 1 (joint_position): the limit of position of joint `slide`, 300, is outside its range \
             [-0.2, 0.3] (lengths are in m)",
        ]
    );
    let fine = position("target = [2.5, 0.3]\nweight = 1.0") + &point("[0.5, 20.0, 0.0]");
    assert_eq!(said(&(fine + &limit("lower = [-3.2, -1.0]\nupper = [3.2, 1.0]"))), [""; 0]);
}

#[test]
fn angles_in_degrees_are_warned_of() {
    let problem =
        start(arm(), "\"q.elbow\" = -90\n").with("[model.frames.probe]\non = \"tool\"\nrpy = [0, 0.0, 180.0]\n");
    let warnings = problem.problem().warnings;
    for said in [
        "model.frames.probe.rpy: an angle is more than a full turn (angles are in rad: 180 degrees are 3.1416 rad)",
        "-90, is outside its range [-2.5, 2.5] (angles are in rad: -90 degrees are -1.5708 rad)",
    ] {
        assert!(warnings.iter().any(|warning| warning.contains(said)), "{warnings:?}");
    }
    let error = error_of(&start(arm(), &pose("position = [0.0, 0.0, 0.5], rpy = [0.0, 90.0, 0.0]")).text());
    assert!(error.ends_with("(angles are in rad: 90 degrees are 1.5708 rad)"), "{error}");
}

#[test]
fn time_steps_in_milliseconds_are_warned_of() {
    let text = arm().text();
    let said = |text: &str| supple_file::parse(text, "tests/data/task.toml").map(|problem| problem.warnings.join("\n"));
    let step = text.lines().find(|line| line.starts_with("time_step")).unwrap().to_owned();
    let slow = said(&text.replace(&step, "time_step = 10.0")).unwrap_or_else(|error| error.to_string());
    let warning = "task `task`: `time_step` is 10 s, which is long for a robot (times are in s: 10 ms are 0.01)";
    assert!(slow.contains(warning), "{slow}");
    assert!(!said(&text).unwrap_or_default().contains("long for a robot"));
}

#[test]
fn other_models_have_neither_keys_nor_poses() {
    let text = |start: &str| {
        format!(
            "[model]\nkind = \"linear\"\nA = [[1.0]]\nB = [[1.0]]\nC = [[1.0]]\n[[tasks]]\nname = \"t\"\nsteps = 1\n\
             time_step = 1.0\n{start}noise = {{ initial = [1.0], process = [1.0], measurement = [1.0] }}\n\
             [[tasks.costs]]\nkind = \"control\"\nweight = 1.0\n"
        )
    };
    assert_eq!(
        error_of(&text("initial_state = { key = \"home\" }\n")),
        "task.toml:10:25: tasks[0].initial_state.key: this model does not support `key`; valid names are its states: `x1`"
    );
    assert_eq!(error_of(&text("")), "task.toml:6:1: tasks[0].initial_state: is missing");
}
