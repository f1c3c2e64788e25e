//! Broken and hostile SDF and MJCF files: each has its error, and none makes the reader panic or hang.
#![allow(clippy::unwrap_used, clippy::expect_used)]

#[path = "data_sdf_mjcf/broken_mjcf.rs"]
mod broken_mjcf;
#[path = "data_sdf_mjcf/broken_sdf.rs"]
mod broken_sdf;

use std::fmt::Write;
use std::time::{Duration, Instant};

use proptest::prelude::*;
use supple_robot::{LoadOptions, Robot, parse};

/// The robot, or the error as one line.
fn read(text: &str) -> Result<Robot, String> {
    parse(text, "robot.xml", &LoadOptions::default()).map_err(|error| error.to_string())
}

/// The robot or the error, within far more time than is needed, and far less than what grows with the square of the
/// size.
fn soon(text: &str) -> Result<Robot, String> {
    let start = Instant::now();
    let read = read(text);
    let took = start.elapsed();
    assert!(took < Duration::from_secs(5), "took {took:?}");
    read
}

fn check(cases: &[(&str, &str, &str)]) {
    let mut wrong = String::new();
    for (what, text, expected) in cases {
        let found = match read(text) {
            Ok(_) => "it loads".to_owned(),
            Err(error) => error,
        };
        if found != *expected {
            writeln!(wrong, "@{what}@{found}@{expected}").unwrap();
        }
    }
    assert!(wrong.is_empty(), "case, error and what it should be:\n{wrong}");
}

#[test]
fn every_broken_sdf_file_has_its_error() {
    check(broken_sdf::SDF);
}

#[test]
fn every_broken_mjcf_file_has_its_error() {
    check(broken_mjcf::MJCF);
}
