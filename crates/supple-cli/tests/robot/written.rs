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

/// Position and velocity drives of a task become actuators of the MJCF file: a task with that file has the same costs.
#[test]
fn drives_of_a_task_are_actuators_of_the_file() {
    let folder = Folder::new();
    std::fs::write(folder.path("arm.urdf"), include_str!("../../templates/arm.urdf")).unwrap();
    let task = |model: &str| {
        format!(
            "[model]\nkind = \"robot\"\ngravity = [0.0, 0.0, -9.81]\n{model}\n[[model.sensors]]\n\
             kind = \"joint_position\"\ndeviation = 1e-3\n[[tasks]]\nname = \"move\"\nsteps = 10\n\
             time_step = 0.01\n[tasks.initial_state]\n\"q.*\" = 0.3\n[tasks.noise]\ninitial_deviation = {{ \"*\" = 1e-3 }}\n\
             process_deviation = {{ \"v.*\" = 1e-3 }}\n[[tasks.costs]]\nkind = \"joint_position\"\ntarget = [0.4, 0.4, 0.4, 0.4, 0.4, 0.4]\n\
             weight = 1.0\n[[tasks.costs]]\nkind = \"control\"\nweight = 0.01\n"
        )
    };
    let drives = "[model.drives]\nturn = { kp = 4000.0, kv = 60.0, gear = 2.0 }\nshoulder = { kp = 9000.0, kv = 90.0 }\n\
                  elbow = { kp = 8000.0, kv = 80.0 }\nroll = { kp = 200.0, kv = 2.0 }\nbend = { kp = 200.0 }\n\
                  twist = { kv = 0.1, rotor_inertia = 0.01 }\n";
    std::fs::write(folder.path("drives.toml"), task(&format!("file = \"arm.urdf\"\n{drives}"))).unwrap();
    std::fs::write(folder.path("file.toml"), task("file = \"robot.xml\"\n")).unwrap();
    let written = folder.run(&["robot", "drives.toml", "--to", "mjcf", "--out", "robot.xml"]);
    assert_eq!(written.code, Some(0), "{}", written.stderr);
    let text = std::fs::read_to_string(folder.path("robot.xml")).unwrap();
    for element in [
        "<position name=\"turn\" joint=\"turn\" gear=\"2\" kp=\"4000\" kv=\"60\"/>",
        "<position name=\"bend\" joint=\"bend\" kp=\"200\"/>",
        "<velocity name=\"twist\" joint=\"twist\" kv=\"0.1\"/>",
    ] {
        assert!(text.contains(element), "{element} is missing in\n{text}");
    }
    let [cost, expected] = ["file.toml", "drives.toml"].map(|task| {
        let found = folder.run(&["evaluate", task, "--json", "--rollouts", "0"]).json(0);
        found["tasks"][0]["cost"]["expected"].as_f64().unwrap()
    });
    assert_close("cost", &[cost], &[expected]);
}

#[test]
fn what_mjcf_does_not_hold_is_a_warning() {
    let found = robot(gripper(), &["--to", "mjcf"]);
    assert_eq!(found.code, Some(0));
    // The follower is twice as fast as the joint that it follows, and has the same limit.
    assert!(
        found.stderr.contains("warning: joint `left`: MJCF has no speed limit; 0.5 is left out"),
        "{}",
        found.stderr
    );
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
