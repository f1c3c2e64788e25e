//! Robots in another format.

use crate::common::Folder;
use crate::{INERTIAL, assert_close, folder, gripper, numbers, robot, shipped};

#[test]
fn a_robot_as_mjcf_has_the_same_dynamics() {
    for path in ["models/iiwa14_door.urdf", "models/wiping_arm.sdf", "models/soft_gripper.xml"] {
        let written = shipped(path, &["--to", "mjcf", "--out", "robot.xml"]);
        assert_eq!((written.code, written.stdout.as_str()), (Some(0), "wrote robot.xml\n"), "{}", written.stderr);
        let text = shipped(path, &["--to", "mjcf"]).stdout;
        let folder = Folder::new();
        std::fs::write(folder.path("robot.xml"), text).unwrap();
        // Gravity is said, as some files ask for another one.
        let state = ["--q", "0.1,-0.2,0.3", "--v", "0.5,0.4", "--gravity", "0,0,-9.81", "--json"];
        let found = folder.run(&[&["robot", "robot.xml"][..], &state].concat()).json(0);
        let expected = shipped(path, &state).json(0);
        assert_eq!(found["joints"], expected["joints"]);
        for key in ["mass_matrix", "bias", "acceleration"] {
            assert_close(key, &numbers(&found[key]), &numbers(&expected[key]));
        }
    }
}

#[test]
fn what_mjcf_does_not_hold_is_a_warning() {
    let found = robot(gripper(), &["--to", "mjcf"]);
    assert_eq!(found.code, Some(0));
    assert!(found.stderr.contains("warning: joint `left`: MJCF has no limit of speed, 1"), "{}", found.stderr);
    assert!(found.stdout.starts_with("<mujoco model=\"gripper\">") && !found.stdout.contains("gravity"));
    let with_gravity = robot(gripper(), &["--to", "mjcf", "--gravity", "0,0,-1.62"]);
    assert!(with_gravity.stdout.contains("<option gravity=\"0 0 -1.62\"/>"), "{}", with_gravity.stdout);
}

#[test]
fn wrong_requests_are_errors() {
    let text = format!("<robot name='r'><link name='base'>{INERTIAL}</link></robot>");
    assert!(robot(&text, &["--to", "sdf"]).stderr.contains("mjcf"));
    assert_eq!(robot(&text, &["--out", "x.xml"]).code, Some(2));
    let blocked = folder(&text).run(&["robot", "robot.urdf", "--to", "mjcf", "--out", "robot.urdf/x.xml"]);
    assert!(blocked.error().contains("robot.urdf"), "{}", blocked.stderr);
}
