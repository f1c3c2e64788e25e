//! Joints that a task inserts into its robot.

use std::path::Path;

use supple::Problem;
use supple_file::robot_of;

use crate::robot::arm::{Description, accelerations, arm, cost, observe, sensor, step};
use crate::robot::bad_tasks::assert_errors;

const PLACE: &str = "tests/data/task.toml";

/// A table of `[[model.insert]]`.
fn insert(keys: &str) -> String {
    format!("[[model.insert]]\nname = \"mount\"\nframe = \"tool\"\n{keys}\n")
}

/// The arm with a mount, without what names single joints.
fn mounted(keys: &str) -> Description {
    let costs = cost("control", "weight = 0.01") + &cost("joint_velocity", "weight = 0.02");
    arm().explicit().with(&insert(keys)).costing(&costs)
}

const SLIDES: &str = "axes = [\"x\", \"z\"]\nmass = 0.4\ninertia = [1e-3, 2e-3, 3e-3]\nstiffness = [300.0, 500.0]\ndamping = 4.0\n\
                      position = [0.02, 0.0, 0.01]\nrpy = [0.1, 0.2, 0.3]";

fn state(problem: &Problem) -> Vec<f64> {
    let count = problem.tasks[0].system.dimensions().states;
    (0..count).map(|i| 0.1 + 0.03 * i as f64 * if i % 2 == 0 { 1.0 } else { -1.0 }).collect()
}

#[test]
fn inserted_joints_are_states_without_drives() {
    let problem = mounted(SLIDES).problem();
    let channels = problem.tasks[0].system.channels();
    let names: Vec<_> = channels.states.iter().map(|channel| channel.name.as_str()).collect();
    let own = ["shoulder", "elbow", "slide", "mount_x", "mount_z"];
    let expected: Vec<_> = ["q", "v"].iter().flat_map(|p| own.iter().map(move |name| format!("{p}.{name}"))).collect();
    assert_eq!(names, expected);
    let controls: Vec<_> = channels.controls.iter().map(|channel| channel.name.as_str()).collect();
    assert_eq!(controls, ["tau.shoulder", "tau.elbow", "tau.slide"]);
}

/// The arm with moments of inertia that bodies can have: MJCF is written with the nearest such ones.
fn possible_arm() -> String {
    let text = std::fs::read_to_string("tests/data/arm.urdf").unwrap();
    let impossible = "ixx=\"0.03\"";
    assert!(text.contains(impossible));
    text.replace(impossible, "ixx=\"0.027\"")
}

/// The path of a file with this text.
fn written(name: &str, text: &str) -> String {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// What the task writes as a robot file moves as the task does.
#[test]
fn a_robot_file_with_the_same_joints_moves_alike() {
    for keys in [
        SLIDES,
        "axes = [\"rx\", \"ry\", \"rz\"]\nmass = 0.2\ninertia = [1e-2, 2e-2, 3e-2]\nstiffness = 2.0\ndamping = [0.1, 0.2, 0.3]",
        "axes = [\"x\", \"y\", \"z\", \"rx\", \"ry\", \"rz\"]\nmass = 0.3\ncenter = [0.01, 0.0, 0.02]\n\
         inertia = [1e-2, 2e-2, 3e-2]\nstiffness = 50.0\ndamping = 1.0",
    ] {
        let mut inserted = mounted(keys);
        inserted.model = inserted.model.replace("arm.urdf", &written("possible.urdf", &possible_arm()));
        let robot = robot_of(&inserted.text(), PLACE).unwrap();
        let mjcf = supple_robot::mjcf(&robot);
        assert!(mjcf.warnings.iter().all(|warning| !warning.contains("mount")), "{:?}", mjcf.warnings);
        let actuated = "actuated = [\"shoulder\", \"elbow\", \"slide\"]\n";
        let mut own = arm().explicit().with(actuated).costing(&inserted.costs);
        own.model = own.model.replace("arm.urdf", &written("written.xml", &mjcf.text));
        let (inserted, own) = (inserted.problem(), own.problem());
        let x = state(&inserted);
        let found = step(&inserted, &x, &[1.0, -0.5, 2.0], &[]);
        for (a, b) in found.iter().zip(step(&own, &x, &[1.0, -0.5, 2.0], &[])) {
            assert!((a - b).abs() < 1e-9 * b.abs().max(1.0), "{a} and {b}");
        }
    }
}

#[test]
fn a_spring_of_a_mount_can_be_measured() {
    let description = mounted(SLIDES).sensing(&sensor("coupling_force", "coupling = \"mount_z\"\nvariance = 1e-3"));
    let problem = description.problem();
    let mut x = vec![0.0; 10];
    (x[4], x[9]) = (0.01, 0.2);
    let found = observe(&problem, &x, &[]);
    assert!((found[0] + 500.0 * 0.01 + 4.0 * 0.2).abs() < 1e-12, "{found:?}");
}

/// A link that the mount carries accelerates with it: a slide against gravity that nothing holds falls freely.
#[test]
fn a_mount_carries_what_it_is_told_to() {
    let text = |carries: &str| {
        let table = format!(
            "gravity = [0.0, 0.0, -10.0]\n[[model.insert]]\nname = \"mount\"\nframe = \"base\"\naxes = [\"z\"]\nmass = 1.0\n{carries}\n"
        );
        Description { time_step: "1.0".into(), ..arm().explicit() }
            .with(&table)
            .costing(&cost("control", "weight = 0.01"))
    };
    let loose = text("").problem();
    let count = loose.tasks[0].system.dimensions().states / 2;
    let free = accelerations(&loose, &vec![0.0; 2 * count], &[0.0; 3], &[], count);
    assert!((free[count - 1] + 10.0).abs() < 1e-9, "{free:?}");
    let children = robot_of(&text("").text(), PLACE).unwrap();
    let first = children.joints.iter().position(|joint| joint.parent == 0 && !joint.name.starts_with("mount")).unwrap();
    let name = &children.links[first + 1].name;
    let carried = text(&format!("carries = [{name:?}]")).problem();
    let names: Vec<_> = carried.tasks[0].system.channels().states.into_iter().map(|channel| channel.name).collect();
    assert_eq!(names[0], "q.mount_z", "what is carried follows after the mount");
    // All falls together: nothing turns against anything else.
    let all = accelerations(&carried, &vec![0.0; 2 * count], &[0.0; 3], &[], count);
    assert!((all[0] + 10.0).abs() < 1e-9 && all[1..].iter().all(|a| a.abs() < 1e-9), "{all:?}");
}

#[test]
fn a_locked_mount_is_rigid() {
    let mut text = mounted(SLIDES);
    text.model.insert_str(0, "locked = [\"mount_x\", \"mount_z\"]\n");
    let problem = text.problem();
    assert_eq!(problem.tasks[0].system.dimensions().states, 6);
}

#[test]
fn inserts_that_cannot_be() {
    let with = |keys: &str| arm().with(&insert(keys));
    let named = |name: &str| {
        let mut description = with("axes = [\"x\"]\nmass = 0.1");
        description.model = description.model.replace("name = \"mount\"", &format!("name = {name:?}"));
        description
    };
    assert_errors(vec![
        (
            with("axes = []"),
            "task.toml:7:8: model.insert[0].axes: name at least one of `x`, `y`, `z`, `rx`, `ry`, `rz`",
        ),
        (with("axes = [\"x\", \"x\"]"), "task.toml:7:14: model.insert[0].axes[1]: `x` occurs twice"),
        (
            with("axes = [\"u\"]"),
            "task.toml:7:9: model.insert[0].axes[0]: must be one of `x`, `y`, `z`, `rx`, `ry`, `rz`; found `u`",
        ),
        (
            with("axes = [\"x\", \"y\"]\nstiffness = [1.0, 2.0, 3.0]"),
            "task.toml:8:13: model.insert[0].stiffness: must be one number, or 2 of them, one per axis; found 3",
        ),
        (with("axes = [\"x\"]\nmass = -1.0"), "task.toml:8:8: model.insert[0].mass: must be at least 0; found -1"),
        (
            with("axes = [\"x\"]\ninertia = [1.0, -1.0, 1.0]"),
            "task.toml:8:17: model.insert[0].inertia[1]: must be at least 0; found -1",
        ),
        (named("fore"), "task.toml:5:8: model.insert[0].name: the robot already has a link or frame `fore`"),
        (named(""), "task.toml:5:8: model.insert[0].name: must not be empty"),
    ]);
    let mut unknown = with("axes = [\"x\"]");
    unknown.model = unknown.model.replace("frame = \"tool\"", "frame = \"tol\"");
    let error = supple_file::parse(&unknown.text(), PLACE).err().unwrap().to_string();
    assert!(error.contains("model.insert[0].frame: the robot has no link or frame `tol`"), "{error}");
    let error =
        supple_file::parse(&with("axes = [\"x\"]\ncarries = [\"fore\"]").text(), PLACE).err().unwrap().to_string();
    assert!(error.contains("model.insert[0].carries[0]: "), "{error}");
    let error = supple_file::parse(&with("axes = [\"x\"]\nspring = 1.0").text(), PLACE).err().unwrap().to_string();
    assert!(error.contains("unknown key `spring`"), "{error}");
}
