//! `supple validate` up to the point where Python begins; tests/python/test_validate.py has the rest.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, TWO_MASS};

/// A folder with an evaluation in `kept`.
fn evaluated() -> Folder {
    let folder = Folder::with_task(TWO_MASS);
    let run = folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--out", "kept"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    folder
}

#[test]
fn without_python_it_says_what_it_takes() {
    let found = evaluated().run(&["validate", "kept", "--python", "no_such_python"]);
    let message = found.error();
    assert!(message.contains("`no_such_python` cannot be run") && message.contains("--python"), "{message}");
    assert!(message.contains("packages supple and mujoco"), "{message}");
}

#[cfg(unix)]
#[test]
fn without_a_package_it_says_how_to_get_it() {
    use std::os::unix::fs::PermissionsExt;
    let folder = evaluated();
    // Pythons that have no package at all, and only that of supple.
    for (name, has, lacks) in [("neither", "nothing", "supple"), ("half", "'supple'", "mujoco")] {
        let path = folder.path(name);
        std::fs::write(&path, format!("#!/bin/sh\ncase \"$2\" in *\"{has}\"*) exit 0;; esac\nexit 10\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        let found = folder.run(&["validate", "kept", "--python", path.to_str().unwrap()]);
        assert!(found.error().contains(&format!("has no package `{lacks}`: run `pip install ")), "{}", found.stderr);
    }
}

#[test]
fn only_results_about_one_design_are_taken() {
    let folder = evaluated();
    assert!(folder.run(&["validate", "nowhere"]).error().contains("nowhere"));
    let message = folder.run(&["validate", "kept", "--at", "optimum"]).error().to_owned();
    assert!(message.contains("--at optimum: an evaluation has one design"), "{message}");
    let run = folder.run(&["sweep", "task.toml", "--grid", "k1=40,100", "--out", "swept"]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    let message = folder.run(&["validate", "swept"]).error().to_owned();
    assert!(message.contains("a result of `sweep`"), "{message}");
}
