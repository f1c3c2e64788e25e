//! Numbers that the task file says anew against the same numbers in the robot's file.

use std::path::Path;

use supple::Problem;

use crate::robot::arm::{Description, arm, compliance, observe, sensor, step};
use crate::robot::assert_close;

const STATES: [[f64; 6]; 3] =
    [[0.3, -0.4, 0.1, 0.5, -0.3, 0.2], [-1.2, 0.7, -0.15, 2.0, 1.0, -0.5], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]];

/// The arm with where its tool is for a measurement, and a time step of 1 s.
fn seen() -> Description {
    let mut description = arm().sensing(&sensor("frame_pose", "frame = \"tool\"\nvariance = 1.0"));
    description.time_step = "1.0".into();
    description
}

/// The same with other text in the robot's file.
fn rewritten(name: &str, changes: &[(&str, &str)]) -> Problem {
    let mut text = include_str!("../../data/arm.urdf").to_owned();
    for (from, to) in changes {
        assert_eq!(text.matches(from).count(), 1, "`{from}`");
        text = text.replace(from, to);
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.urdf"));
    std::fs::write(&path, text).unwrap();
    let mut description = seen();
    description.model = format!("file = {:?}\n", path.display().to_string());
    description.problem()
}

/// Both move and are seen alike.
fn assert_same(what: &str, found: &Problem, expected: &Problem) {
    let phi = found.parameters.initial();
    for x in STATES {
        let u = [3.0, -1.0, 4.0];
        assert_close(what, &step(found, &x, &u, &phi), &step(expected, &x, &u, &[]), 1e-12);
        assert_close(what, &observe(found, &x, &phi), &observe(expected, &x, &[]), 1e-12);
    }
    assert_ne!(step(found, &STATES[1], &[0.0; 3], &phi), step(&seen().problem(), &STATES[1], &[0.0; 3], &[]), "{what}");
}

#[test]
fn numbers_of_links_are_those_of_the_robots_file() {
    let fore = |keys: &str| format!("[model.links.fore]\n{keys}\n");
    let mass = seen().with(&fore("mass = \"m\"")).where_(&[("m", 0.95)]).problem();
    assert_same("mass", &mass, &rewritten("mass", &[("<mass value=\"0.8\"/>", "<mass value=\"0.95\"/>")]));

    let center = seen().with(&fore("center = [0.12, \"y\", 0.02]")).where_(&[("y", -0.01)]).problem();
    assert_same("center", &center, &rewritten("center", &[("0.1 0 0.03", "0.12 -0.01 0.02")]));

    let scaled = seen().with(&fore("inertia_scale = \"s\"")).where_(&[("s", 1.5)]).problem();
    let inertia = (
        "ixx=\"0.006\" iyy=\"0.012\" izz=\"0.011\" ixy=\"0\" ixz=\"0.001\"",
        "ixx=\"0.009\" iyy=\"0.018\" izz=\"0.0165\" ixy=\"0\" ixz=\"0.0015\"",
    );
    assert_same("inertia", &scaled, &rewritten("inertia", &[inertia]));
}

#[test]
fn numbers_of_joints_are_those_of_the_robots_file() {
    let elbow = |keys: &str| format!("[model.joints.elbow]\n{keys}\n");
    let damped = seen().with(&elbow("damping = \"d\"\nfriction = \"f\"")).where_(&[("d", 0.4), ("f", 0.2)]).problem();
    let dynamics = ("<dynamics damping=\"0.1\"/>", "<dynamics damping=\"0.4\" friction=\"0.2\"/>");
    assert_same("damping", &damped, &rewritten("damping", &[dynamics]));

    let offset = seen().with(&elbow("offset = [0.01, \"y\", 0.03]")).where_(&[("y", -0.02)]).problem();
    assert_same("offset", &offset, &rewritten("offset", &[("0 0.05 0.3", "0.01 0.03 0.33")]));

    let longer = seen().with(&elbow("length_scale = \"l\"")).where_(&[("l", 1.2)]).problem();
    assert_same("length", &longer, &rewritten("length", &[("0 0.05 0.3", "0 0.06 0.36")]));

    // The length is scaled first.
    let both = seen().with(&elbow("length_scale = 1.2\noffset = [0.01, -0.02, 0.03]")).problem();
    assert_same("both", &both, &rewritten("both", &[("0 0.05 0.3", "0.01 0.04 0.39")]));
}

#[test]
fn springs_and_drives_of_joints_are_what_else_does_the_same() {
    let elbow = |keys: &str| format!("[model.joints.elbow]\n{keys}\n");
    let stiff = seen().with(&elbow("stiffness = \"k\"\nrest = -0.2")).where_(&[("k", 4.0)]).problem();
    let spring = compliance("spring", "beside", "joint = \"elbow\"\nstiffness = 4.0\nrest = -0.2");
    assert_same("stiffness", &stiff, &seen().with(&spring).problem());

    let armature = seen().with(&elbow("armature = \"i\"")).where_(&[("i", 0.02)]).problem();
    let rotor = "[model.drives.elbow]\nrotor_inertia = 0.02\n";
    assert_same("armature", &armature, &seen().with(rotor).problem());
    // A gear of 2 gives twice the torque and four times the inertia.
    let geared = seen().with("[model.drives.elbow]\ngear = 2.0\nrotor_inertia = 0.005\n").problem();
    for x in STATES {
        let found = step(&geared, &x, &[3.0, -0.5, 4.0], &[]);
        assert_close("gear", &found, &step(&armature, &x, &[3.0, -1.0, 4.0], &[0.02]), 1e-12);
    }
}

#[test]
fn frames_of_the_task_are_those_of_the_robots_file() {
    let frame = "[model.frames.grip]\non = \"tip\"\nposition = [0.05, 0.01, 0.02]\nrpy = [0.0, \"pitch\", 0.0]\n";
    let own = seen().sensing(&sensor("frame_pose", "frame = \"grip\"\nvariance = 1.0"));
    let problem = own.with(frame).where_(&[("pitch", 0.3)]).problem();
    for x in STATES {
        assert_close("pose", &observe(&problem, &x, &[0.3]), &observe(&seen().problem(), &x, &[]), 1e-14);
    }
}

#[test]
fn gravity_is_that_of_the_earth_unless_said_otherwise() {
    let [plain, earth, none] = ["", "gravity = [0.0, 0.0, -9.81]\n", "gravity = [0.0, 0.0, 0.0]\n"]
        .map(|gravity| seen().with(gravity).problem());
    for x in STATES {
        assert_eq!(step(&plain, &x, &[0.0; 3], &[]), step(&earth, &x, &[0.0; 3], &[]));
    }
    assert_eq!(step(&none, &STATES[2], &[0.0; 3], &[]), [0.0; 6]);
}
