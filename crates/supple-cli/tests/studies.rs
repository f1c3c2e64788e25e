//! The commands that compare noises, bounds and searches: what they print and keep, and their errors.
#![allow(clippy::unwrap_used)]

mod common;

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{Folder, Run, TWO_MASS, repository};
use serde_json::Value;

/// The small task with a variance of the wall to vary.
fn noisy() -> String {
    let wall = "[parameters.wall]\ninitial = 1e-4\nbounds = [1e-8, 1.0]\nscale = \"log\"\nunit = \"m^2\"\nrole = \"study\"\n\n[[tasks]]";
    let text = TWO_MASS.replacen("[[tasks]]", wall, 1);
    let (before, after) = text.split_once("initial = [").unwrap();
    // The last entry of the first list of variances: of the wall position.
    let (list, rest) = after.split_once(']').unwrap();
    let (others, _) = list.rsplit_once(',').unwrap();
    format!("{before}initial = [{others}, \"wall\"]{rest}")
}

#[test]
fn robustness_prints_a_page_and_keeps_a_result() {
    let folder = Folder::with_task(noisy());
    let designs = "start,optimum,soft=k1:25";
    let arguments = ["robustness", "task.toml", "--designs", designs, "--vary", "wall=1e-5:1e-3:3", "--rollouts", "10"];
    let page = folder.run(&[&arguments[..], &["--out", "kept"]].concat());
    let (code, text) = page.quiet();
    assert_eq!(code, Some(0));
    for part in [
        "planned for the true wall",
        "planned for the nominal wall = ",
        "the cost of optimum grows by",
        "p = ",
        "10 roll-outs each",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let json = folder.run(&[&arguments[..], &["--json"]].concat()).json(0);
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(folder.path("kept/result.json")).unwrap()).unwrap();
    assert_eq!(kept["result"], json);
    let levels: Vec<f64> =
        json["options"]["vary"]["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!((levels[1] / 1e-4 - 1.0).abs() < 1e-12, "a parameter with the scale `log` is spread by ratios: {levels:?}");
    assert_eq!(json["cells"].as_array().unwrap().len(), 3 * 2 * 3);
    assert_eq!(json["comparisons"].as_array().unwrap().len(), 2 * 2);

    let even = ["robustness", "task.toml", "--designs", "start", "--vary", "wall=lin:1e-5:1e-3:3", "--json"];
    let json = folder.run(&even).json(0);
    assert_eq!(json["options"]["vary"]["values"][1], 5.05e-4);
}

#[test]
fn pareto_prints_a_page_and_keeps_a_result() {
    let folder = Folder::with_task(TWO_MASS);
    let arguments = ["pareto", "task.toml", "--points", "4", "--starts", "2"];
    let page = folder.run(&[&arguments[..], &["--out", "kept"]].concat());
    let (code, text) = page.quiet();
    // At the tight end the contact is so soft that the plan hardly presses.
    assert_eq!(code, Some(1));
    for told in [
        "4 of 4 points are local optima; 2 starts, seed 0.",
        "The cost limit of press is",
        "Warning: at factor 0.386861, task `press`: cost 1 (contact_force) tracks a force of 3 N at `wall`, but the plan presses with at most",
    ] {
        assert!(text.contains(told), "{text}");
    }
    let json = folder.run(&[&arguments[..], &["--json"]].concat()).json(1);
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(folder.path("kept/result.json")).unwrap()).unwrap();
    assert_eq!(kept["result"], json);
    assert_eq!(json["points"].as_array().unwrap().len(), 4);
}

#[test]
fn trace_prints_a_page_and_keeps_a_result() {
    let folder = Folder::with_task(TWO_MASS);
    let arguments = ["trace", "task.toml", "--starts", "2", "--method", "sqp,barrier", "--gradient", "total"];
    let page = folder.run(&[&arguments[..], &["--out", "kept"]].concat());
    let (code, text) = page.quiet();
    assert_eq!(code, Some(0));
    assert!(text.contains("2 of 2") && text.contains("The best design, k1 = 20, "), "{text}");
    let json = folder.run(&[&arguments[..], &["--json"]].concat()).json(0);
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(folder.path("kept/result.json")).unwrap()).unwrap();
    assert_eq!(kept["result"], json);
    assert_eq!(json["runs"].as_array().unwrap().len(), 4);
}

#[cfg(unix)]
#[test]
fn a_stopped_study_resumes_to_the_same_file() {
    let folder = Folder::new();
    std::fs::copy(repository("tasks/two_mass.toml"), folder.path("task.toml")).unwrap();
    let kind = ["--method", "sqp", "--gradient", "total"];
    let words = [&["trace", "task.toml", "--starts", "200", "--seed", "2", "--out", "out"][..], &kind].concat();
    let page = folder.run(&words);
    assert_eq!(page.code, Some(0), "{page:?}");
    assert!(!folder.path("out/journal.redb").exists(), "a complete study has nothing to resume");
    std::fs::rename(folder.path("out"), folder.path("whole")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple"));
    // On one thread, so that it is stopped in the middle on any machine.
    command.args(&words).current_dir(folder.path("")).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.env("RAYON_NUM_THREADS", "1");
    let child = command.spawn().unwrap();
    let (clock, journal) = (Instant::now(), folder.path("out/journal.redb"));
    // A new journal has its tables alone; it grows with the first searches.
    let len = || std::fs::metadata(&journal).map_or(0, |about| about.len());
    while len() == 0 {
        assert!(clock.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(1000));
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    let run = Run::of(&child.wait_with_output().unwrap());
    assert!(run.code == Some(1) && run.stderr.contains("; the same command resumes"), "{run:?}");
    let other = folder.run(&[&words[..5], &["3", "--out", "out"], &kind].concat());
    assert_eq!(
        other.error().lines().next(),
        Some(
            "error: out/journal.redb: belongs to another study of traces; give another --out, or remove the file to start anew"
        )
    );
    let again = folder.run(&words);
    assert_eq!((again.code, &again.stdout), (Some(0), &page.stdout));
    let [whole, resumed] = ["whole", "out"].map(|name| std::fs::read(folder.path(name).join("result.json")).unwrap());
    assert!(whole == resumed, "the files differ");
    assert!(!journal.exists());
}

#[test]
fn bad_requests_are_errors_and_write_nothing() {
    let folder = Folder::with_task(noisy());
    for (arguments, message) in [
        (
            vec!["robustness", "task.toml", "--designs", "best", "--vary", "wall=1e-5,1e-4"],
            "--designs: `best`: it is not a design",
        ),
        (vec!["robustness", "task.toml", "--vary", "wal=1e-5,1e-4"], "no parameter `wal`"),
        (vec!["robustness", "task.toml", "--vary", "wall"], "--vary wall: write NAME="),
        (vec!["robustness", "task.toml", "--vary", "wall=1e-5:9:4"], "outside the bounds of `wall`"),
        (vec!["robustness", "task.toml", "--vary", "k1=20:100:3"], "`k1` is a design parameter"),
        (vec!["trace", "task.toml", "--method", "sqp,sqp"], "the method sqp is named twice"),
    ] {
        let arguments = [&arguments[..], &["--out", "kept"]].concat();
        let run = folder.run(&arguments);
        assert!(run.error().contains(message), "{arguments:?}: {}", run.error());
    }
    let unbound = Folder::with_task(TWO_MASS.replace("bound = 25.0", ""));
    assert!(unbound.run(&["pareto", "task.toml", "--out", "kept"]).error().contains("no task has a cost limit"));
    assert_eq!(folder.names(), ["task.toml"]);
}
