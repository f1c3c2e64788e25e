//! `supple export`: controllers as files, and what is refused.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, LINEAR, TWO_MASS};
use serde_json::Value;

/// A folder with a task and the results of one evaluation in `at`.
fn evaluated(task: &str) -> Folder {
    let folder = Folder::with_task(task);
    let run = folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--out", "at"]);
    assert!(matches!(run.code, Some(0 | 1)), "{run:?}");
    folder
}

#[test]
fn every_format_is_written_by_the_name_of_the_task() {
    let folder = evaluated(TWO_MASS);
    for (format, said) in
        [("c", "wrote press.c\nwrote press.h\n"), ("json", "wrote press.json\n"), ("npz", "wrote press.npz\n")]
    {
        let run = folder.run(&["export", "at", "--to", format, "--rollouts", "0"]);
        assert_eq!(run.quiet(), (Some(0), said));
    }
    assert_eq!(folder.names(), ["at", "press.c", "press.h", "press.json", "press.npz", "task.toml"]);
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    let json: Value = serde_json::from_slice(&read("press.json")).unwrap();
    assert_eq!((&json["format"], &json["steps"]), (&Value::from("supple-controller"), &Value::from(125)));
    assert!(read("press.npz").starts_with(b"PK"));
    assert!(String::from_utf8(read("press.c")).unwrap().contains("#include \"press.h\""));
}

#[test]
fn both_designs_of_a_search_have_a_controller() {
    let folder = Folder::with_task(TWO_MASS);
    let run = folder.run(&["design", "task.toml", "--starts", "1", "--rollouts", "0", "--out", "best"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let result: Value = serde_json::from_slice(&std::fs::read(folder.path("best/result.json")).unwrap()).unwrap();
    for (words, key) in [(&["--at", "start"][..], "start"), (&["--at", "optimum"], "optimum"), (&[], "optimum")] {
        let words = [&["export", "best", "--to", "json", "--rollouts", "0", "--out", "kept/one.json"], words].concat();
        assert_eq!(folder.run(&words).quiet(), (Some(0), "wrote kept/one.json\n"));
        let json: Value = serde_json::from_slice(&std::fs::read(folder.path("kept/one.json")).unwrap()).unwrap();
        assert_eq!(json["parameters"], result["result"][key]["parameters"]);
        assert_eq!(json["states"], result["result"][key]["tasks"][0]["trajectory"]["states"]);
    }
}

/// The exported filter is not the one that results are about: what it costs is measured.
#[test]
fn its_cost_in_closed_loop_is_measured() {
    let folder = evaluated(TWO_MASS);
    let said = |seed: &str| folder.run(&["export", "at", "--to", "json", "--rollouts", "32", "--seed", seed]).stdout;
    let line = said("1").lines().nth(1).unwrap().to_owned();
    assert!(line.starts_with("cost in closed loop ") && line.contains(" over 32 roll-outs; expected "), "{line}");
    assert_eq!(said("1").lines().nth(1), Some(line.as_str()));
    assert_ne!(said("2").lines().nth(1), Some(line.as_str()));
}

/// The task file may be gone or changed: a result is exported from what it keeps.
#[test]
fn no_file_but_the_result_is_read() {
    let folder = evaluated(TWO_MASS);
    std::fs::write(folder.path("task.toml"), "nothing").unwrap();
    assert_eq!(folder.run(&["export", "at", "--to", "json"]).quiet().0, Some(0));
}

#[test]
fn several_tasks_need_a_name() {
    let folder = evaluated(LINEAR);
    let run = folder.run(&["export", "at", "--to", "c"]);
    assert!(run.error().contains("there are several tasks; choose one with --task: "), "{}", run.stderr);
    let run = folder.run(&["export", "at", "--to", "c", "--task", "reech"]);
    assert!(run.error().contains("no task is named `reech`; valid names: "), "{}", run.stderr);
    assert_eq!(folder.names(), ["at", "task.toml"]);
}

#[test]
fn what_cannot_be_exported_is_refused_and_nothing_is_written() {
    let folder = evaluated(TWO_MASS);
    std::fs::create_dir(folder.path("empty")).unwrap();
    std::fs::create_dir(folder.path("there.json")).unwrap();
    std::fs::write(folder.path("file"), "").unwrap();
    let before = folder.names();
    for (words, says) in [
        (&["empty", "--to", "c"][..], "empty: holds no result: it has no file `result.json`"),
        (&["missing", "--to", "c"], "missing: there is no such folder (results are in the folders that `--out` names"),
        (&["at", "--to", "json", "--out", "there.json"], "there.json"),
        (&["at", "--to", "json", "--out", "file/one.json"], "file/one.json"),
        (&["at", "--to", "npz", "--out", ".."], "is not a file name"),
        (&["at", "--to", "c", "--out", "press.txt"], "press.txt: the source of C must be a file NAME.c"),
        (&["at", "--to", "c", "--at", "start"], "holds one design"),
    ] {
        let run = folder.run(&[&["export"], words].concat());
        assert!(run.error().contains(says), "{}", run.stderr);
    }
    let run = folder.run(&["export", "at", "--to", "matlab"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("matlab") && run.stderr.contains("[possible values: c, json, npz]"), "{}", run.stderr);
    assert_eq!(folder.names(), before);
}

#[test]
fn results_of_other_commands_are_refused() {
    let folder = Folder::with_task(TWO_MASS);
    let run = folder.run(&["sweep", "task.toml", "--grid", "k1=40,100", "--out", "grid"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let run = folder.run(&["export", "grid", "--to", "c"]);
    assert!(run.error().contains("grid: is of `supple sweep`: a controller is taken from"), "{}", run.stderr);
}

/// A controller of a plan that did not converge is written, with a warning and the exit code of a shortfall.
#[test]
fn plans_that_did_not_converge_are_told() {
    let text = common::edited(TWO_MASS, "[[tasks]]", "[planning]\nmax_iterations = 1\n[[tasks]]");
    let folder = evaluated(&text);
    let run = folder.run(&["export", "at", "--to", "json"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stdout.starts_with("wrote press.json\n"), "{}", run.stdout);
    assert!(run.stderr.contains("has status max_iterations"), "{}", run.stderr);
}
