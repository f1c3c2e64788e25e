//! What the commands print and write, and the exit codes they end with.
#![allow(clippy::unwrap_used)]

mod bounds;
#[path = "../common/mod.rs"]
mod common;
mod design;
mod doubts;
mod evaluate;
mod schema;
mod streams;

use common::{Folder, LINEAR, TWO_MASS, edited};
use serde_json::{Value, json};

/// Checks that `found` has the form of `form`: every key of its tables, and values of the same type as its own; the one
/// entry of a list or of a table with the key `*` stands for every entry.
fn assert_form(found: &Value, form: &Value, path: &str) {
    match (found, form) {
        (Value::Object(found), Value::Object(form)) => match form.get("*") {
            Some(entry) => found.iter().for_each(|(key, value)| assert_form(value, entry, &format!("{path}.{key}"))),
            None => {
                for (key, entry) in form {
                    let value = found.get(key).unwrap_or_else(|| panic!("{path}.{key} is missing"));
                    assert_form(value, entry, &format!("{path}.{key}"));
                }
            }
        },
        (Value::Array(found), Value::Array(form)) => {
            assert!(!found.is_empty(), "{path} is empty");
            found.iter().enumerate().for_each(|(i, value)| assert_form(value, &form[0], &format!("{path}[{i}]")));
        }
        (Value::Number(found), Value::Number(form)) => {
            assert!(!form.is_u64() || found.is_u64(), "{path} = {found} is not an integer");
        }
        (Value::String(_), Value::String(_)) | (Value::Bool(_), Value::Bool(_)) => {}
        _ => panic!("{path} = {found} has not the form of {form}"),
    }
}

/// What `supple evaluate` prints of a problem whose tasks have bounds.
fn evaluation_form() -> Value {
    json!({
        "parameters": { "*": 0.5 },
        "objective": { "information_nats": 0.5, "information_bits": 0.5 },
        "feasible": true,
        "feasibility": 0.5,
        "tasks": [{
            "name": "",
            "status": "",
            "iterations": 1,
            "stationarity": 0.5,
            "cost": {
                "expected": 0.5, "nominal": 0.5, "belief": 0.5, "process": 0.5, "initial": 0.5, "bound": 0.5
            },
            "information": {
                "total_nats": 0.5, "total_bits": 0.5, "bits_per_step": 0.5, "bits_per_second": 0.5,
                "paper_form_nats": 0.5, "per_step_nats": [0.5]
            }
        }]
    })
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn assert_close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-12 * (1.0 + a.abs()), "{a} and {b}");
}

/// A shipped task, edited.
fn two_mass(from: &str, to: &str) -> Folder {
    Folder::with_task(edited(TWO_MASS, from, to))
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let folder = Folder::with_task(TWO_MASS);
    let evaluate = |threads: &str, seed: &str| {
        let arguments =
            ["evaluate", "task.toml", "--json", "--gradient", "both", "--rollouts", "300", "--branches", "8"];
        folder.run(&[&arguments[..], &["--threads", threads, "--seed", seed]].concat()).json(0)
    };
    assert_eq!(evaluate("1", "1"), evaluate("8", "1"));
    assert_eq!(evaluate("8", "1"), evaluate("8", "1"));
    assert_ne!(evaluate("8", "1"), evaluate("8", "2"));
    let design = |threads: &str, seed: &str| {
        let arguments = ["design", "task.toml", "--json", "--starts", "3", "--threads", threads, "--seed", seed];
        let mut found = folder.run(&arguments).json(0);
        ["seconds", "report_seconds"].iter().for_each(|&key| drop(found.as_object_mut().unwrap().remove(key)));
        found
    };
    assert_eq!(design("1", "1"), design("8", "1"));
    assert_ne!(design("8", "1")["starts"][1]["from"], design("8", "2")["starts"][1]["from"]);
}

#[test]
fn check_compares_derivatives() {
    let folder = Folder::with_task(LINEAR);
    let found = folder.run(&["check", "task.toml", "--json"]).json(0);
    assert_eq!(found["passed"], true);
    assert_eq!(found["tasks"].as_array().unwrap().len(), 2);
    let run = folder.run(&["check", "task.toml", "--set", "gain=0.5"]);
    assert_eq!(run.quiet().0, Some(0));
    assert!(run.stdout.contains("All derivatives agree."));
}

#[test]
fn new_writes_a_file_that_runs_and_is_never_written_over() {
    let folder = Folder::new();
    let run = folder.run(&["new", "grasp \"1\" \\ \u{1f600}\n"]);
    assert_eq!(run.quiet().0, Some(0));
    assert_eq!(folder.run(&["new", "press.toml"]).quiet().0, Some(0));
    assert_eq!(folder.names(), ["grasp \"1\" \\ \u{1f600}\n.toml", "press.toml"]);
    let text = std::fs::read_to_string(folder.path("press.toml")).unwrap();
    assert!(text.contains("title = \"press\""));
    for name in folder.names() {
        assert_eq!(folder.run(&["evaluate", &name]).quiet().0, Some(0));
    }
    std::fs::write(folder.path("press.toml"), "mine").unwrap();
    assert!(folder.run(&["new", "press"]).error().contains("press.toml already exists"));
    assert_eq!(std::fs::read_to_string(folder.path("press.toml")).unwrap(), "mine");
    assert_eq!(folder.names().len(), 2);
}

#[test]
fn the_new_file_can_be_designed() {
    let folder = Folder::new();
    folder.run(&["new", "press"]);
    assert_eq!(folder.run(&["design", "press.toml", "--starts", "1", "--json"]).json(0)["status"], "converged");
}

#[test]
fn completions_know_every_command() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let run = Folder::new().run(&["completions", shell]);
        let (code, script) = run.quiet();
        assert_eq!(code, Some(0));
        for command in ["design", "evaluate", "check", "schema", "new", "completions"] {
            assert!(script.contains(command), "{shell} does not know {command}");
        }
    }
}

#[test]
fn version_and_help() {
    let folder = Folder::new();
    assert_eq!(folder.run(&["--version"]).quiet(), (Some(0), concat!("supple ", env!("CARGO_PKG_VERSION"), "\n")));
    for arguments in [&["--help"][..], &["design", "--help"], &["help", "evaluate"]] {
        let run = folder.run(arguments);
        assert_eq!(run.quiet().0, Some(0));
        assert!(run.stdout.contains("Usage: supple"));
    }
    let run = folder.run(&[]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(2), ""));
    assert!(run.stderr.contains("Usage: supple"));
}
