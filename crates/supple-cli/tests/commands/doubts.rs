//! What is said of designs of another robot, of tasks that are given up, and of files that are none of tasks.

use crate::common::{Folder, edited};

const TASKS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/");

#[test]
fn designs_of_another_robot_are_doubted_and_other_units_refused() {
    let task = |name: &str| format!("{TASKS}{name}.toml");
    let folder = Folder::new();
    let made = folder.run(&["evaluate", &task("peg_on_wall"), "--set", "k=1500", "--rollouts", "0", "--out", "peg"]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    let from = |name: &str| folder.run(&["evaluate", &task(name), "--rollouts", "0", "--from", "peg"]);
    let own = from("peg_on_wall");
    assert!(own.code == Some(0) && !own.stderr.contains("another robot"), "{}", own.stderr);
    let other = from("soft_gripper");
    assert!(other.stderr.contains("the design in peg: it is of another robot"), "{}", other.stderr);
    assert!(other.stdout.contains("k = 1500 N/m"), "{}", other.stdout);
    let units = from("elastic_elbow");
    let says = "--from peg: its parameter `k` is in N/m, that of the task in N m/rad";
    assert!(units.code == Some(2) && units.stderr.contains(says), "{}", units.stderr);
}

#[test]
fn a_task_without_a_limit_that_is_given_up_is_told() {
    let text = std::fs::read_to_string(format!("{TASKS}two_mass.toml")).unwrap();
    let limit = text.lines().find(|line| line.starts_with("bound = ")).unwrap();
    let folder = Folder::with_task(edited(&text, limit, ""));
    let run = folder.run(&["design", "task.toml", "--starts", "1", "--rollouts", "0"]);
    assert!(run.stdout.contains("Next: set a cost limit, such as `bound = "), "{}", run.stdout);
    assert!(run.stdout.contains("without one, the search gave up the task to save information: its cost rose from"));
}

#[test]
fn a_robot_file_in_the_place_of_a_task_is_told() {
    let folder = Folder::with_task("<?xml version=\"1.0\"?>\n<robot name=\"one\"/>\n");
    let run = folder.run(&["evaluate", "task.toml"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("task.toml:1:1: is XML, and no TOML file of a task"), "{}", run.stderr);
    assert!(
        run.stderr.contains("`supple new NAME --robot FILE` writes a task file for a robot file"),
        "{}",
        run.stderr
    );
}
