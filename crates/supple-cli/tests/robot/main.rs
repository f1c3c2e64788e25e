//! `supple robot`: the tree of a robot file, and its dynamics beside those of another program.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "../common/mod.rs"]
mod common;
mod dynamics;
mod planning;
mod refused;
mod tree;
mod written;

use common::{Folder, Run, repository};
use serde_json::Value;

/// A link with a mass of 1 kg.
pub const INERTIAL: &str =
    "<inertial><mass value='1'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.2' iyz='0' izz='0.15'/></inertial>";

/// A hand of two fingers on an arm of one joint; the right finger follows the left one.
#[must_use]
pub fn gripper() -> String {
    let link = |name: &str| format!("<link name='{name}'>{INERTIAL}</link>\n");
    let finger = |name: &str, inside: &str| {
        format!(
            "<joint name='{name}' type='prismatic'><parent link='hand'/><child link='{name}_finger'/>\
            <origin xyz='0.1 0.2 0'/><axis xyz='0 1 0'/><limit lower='0' upper='0.04' effort='10' velocity='1'/>\
            <dynamics damping='3' friction='0.5'/>{inside}</joint>\n"
        )
    };
    format!(
        "<robot name='gripper'>\n<link name='base'/>\n{}{}{}\
        <joint name='swing' type='continuous'><parent link='base'/><child link='hand'/><axis xyz='1 0 0'/></joint>\n\
        {}{}</robot>\n",
        link("hand"),
        link("left_finger"),
        link("right_finger"),
        finger("left", ""),
        finger("right", "<mimic joint='left' multiplier='-2' offset='0.01'/>"),
    )
}

/// A folder with the file `robot.urdf`.
pub fn folder(text: impl AsRef<[u8]>) -> Folder {
    let folder = Folder::new();
    std::fs::write(folder.path("robot.urdf"), text).unwrap();
    folder
}

/// What `supple robot robot.urdf` does of a text, with further arguments.
pub fn robot(text: impl AsRef<[u8]>, arguments: &[&str]) -> Run {
    folder(text).run(&[&["robot", "robot.urdf"], arguments].concat())
}

/// What it does of a file of the repository.
#[must_use]
pub fn shipped(path: &str, arguments: &[&str]) -> Run {
    let path = repository(path);
    Folder::new().run(&[&["robot", path.to_str().unwrap()], arguments].concat())
}

/// All numbers within a value, in order.
pub fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().expect("a number")],
    }
}

/// Asserts that all numbers are equal to 1e-10, relative to the largest of them or 1e-3.
pub fn assert_close(what: &str, found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let largest = expected.iter().fold(1e-3, |largest: f64, entry| largest.max(entry.abs()));
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= 1e-10 * largest, "{what}: {found:?} instead of {expected:?}");
    }
}
