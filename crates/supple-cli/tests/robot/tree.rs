//! The tree of links and joints.

use std::fmt::Write;
use std::io::Read;
use std::process::{Command, Stdio};

use crate::common::Folder;
use crate::{folder, gripper, robot, shipped};

#[test]
fn the_arm_and_the_door_are_shown() {
    let run = shipped("models/iiwa14_door.urdf", &[]);
    assert_eq!(run.quiet(), (Some(0), include_str!("iiwa14_door.txt")));
}

#[test]
fn a_gripper_is_shown_with_what_follows_and_without() {
    let run = robot(gripper(), &["--gravity", "0,0,-1.62"]);
    assert_eq!(run.quiet(), (Some(0), include_str!("gripper.txt")));
    let free = robot(gripper(), &["--independent-mimic"]);
    let page = free.quiet().1;
    assert!(page.starts_with("gripper: 4 links, 3 moving joints, 3 kg\n"), "{page}");
    assert!(page.contains(" 3  right  prismatic") && !page.contains("follows"), "{page}");
}

#[test]
fn frames_springs_gravity_and_warnings_are_shown() {
    let run = shipped("crates/supple-robot/tests/data_sdf_mjcf/arm.xml", &[]);
    assert_eq!(run.quiet(), (Some(0), include_str!("arm.txt")));
}

#[test]
fn actuators_sensors_keyframes_and_walls_are_shown() {
    let run = shipped("crates/supple-robot/tests/data_equipment/arm.xml", &[]);
    assert_eq!(run.quiet(), (Some(0), include_str!("equipment.txt")));
}

#[test]
fn a_fixed_joint_that_follows_is_a_warning() {
    let text = gripper().replacen("type='prismatic'", "type='fixed'", 1);
    let text = text.replacen("<mimic joint='left'", "<mimic joint='swing'", 1);
    let text = text.replacen("friction='0.5'/>", "friction='0.5'/><mimic joint='swing'/>", 1);
    let run = robot(&text, &[]);
    let warning = "\nWarnings\n- joint `left`: it is fixed; its mimic relation to `swing` is ignored (line 7)\n";
    assert!(run.quiet().1.ends_with(warning), "{}", run.stdout);
    assert!(run.stdout.contains("-2 swing + 0.01"), "{}", run.stdout);
}

#[test]
fn packages_are_found_below_declared_folders() {
    let mesh = "<visual><geometry><mesh filename='package://parts/hand.stl'/></geometry></visual></link>";
    let folder = folder(gripper().replacen("</link>", mesh, 1));
    std::fs::create_dir_all(folder.path("packages/parts")).unwrap();
    std::fs::write(folder.path("packages/parts/hand.stl"), "solid").unwrap();
    std::fs::create_dir(folder.path("others")).unwrap();
    let arguments = ["robot", "robot.urdf", "--package-root", "others", "--package-root", "packages"];
    let run = folder.run(&arguments);
    assert_eq!(run.quiet().0, Some(0));
    assert!(!run.stdout.contains("Warnings"), "{}", run.stdout);
}

#[test]
fn names_cannot_break_the_page() {
    let long = "n".repeat(10_000);
    let text = format!("<robot name='a&#10;b'><link name='{long}'/></robot>");
    let run = robot(text, &[]);
    let page = run.quiet().1;
    assert!(page.starts_with("a b: 1 link, 0 moving joints, 0 kg\n"), "{page}");
    assert!(page.lines().all(|line| line.len() < 100), "{page}");
}

/// A chain of links on one another.
fn chain(links: usize, inside: &str) -> String {
    let mut text = "<robot name='chain'>\n".to_owned();
    for i in 0..links {
        writeln!(text, "<link name='l{i}'>{inside}</link>").unwrap();
    }
    for i in 1..links {
        let ends = format!("<parent link='l{}'/><child link='l{i}'/>", i - 1);
        writeln!(text, "<joint name='j{i}' type='continuous'>{ends}<origin xyz='0 0 0.1'/></joint>").unwrap();
    }
    text + "</robot>\n"
}

#[test]
fn ten_thousand_links_are_shown() {
    let run = robot(chain(10_000, ""), &[]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(run.stdout.starts_with("chain: 10000 links, 9999 moving joints, 0 kg\n"));
    assert!(run.stdout.contains(" └─ l9999 on l9998  "));
    assert!(run.stdout.len() < 5_000_000);
}

#[test]
fn many_joints_have_dynamics() {
    let run = robot(chain(301, crate::INERTIAL), &["--q", "0.1,-0.2", "--json"]);
    let found = run.json(0);
    assert_eq!(found["mass_matrix"].as_array().unwrap().len(), 300);
    assert!(crate::numbers(&found["acceleration"]).iter().all(|a| a.is_finite()));
}

#[test]
fn a_reader_that_hangs_up_is_no_failure() {
    let folder: Folder = folder(chain(301, crate::INERTIAL));
    for arguments in [&["robot", "robot.urdf"][..], &["robot", "robot.urdf", "--json"]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_supple"));
        command.args(arguments).current_dir(folder.path(".")).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        child.stdout.take().unwrap().read_exact(&mut [0; 10]).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!((output.status.code(), output.stderr), (Some(0), Vec::new()));
    }
}
