//! Signals: answered soon, and what is done is kept.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Folder, Run, TWO_MASS, repository};

/// Far more than is needed on an idle machine, and far less than the work would take.
const SOON: Duration = Duration::from_secs(15);

fn start(folder: &Folder, words: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(words).current_dir(folder.path("")).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

fn send(signal: &str, child: &Child) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
}

/// How it ended after a signal, and how long that took.
fn ended(signal: &str, child: Child) -> (Run, Duration) {
    let clock = Instant::now();
    send(signal, &child);
    let run = Run::of(&child.wait_with_output().unwrap());
    (run, clock.elapsed())
}

/// A study of a long search, and the same search alone.
fn with_long_search() -> Folder {
    let folder = Folder::with_task(TWO_MASS);
    let text = "title = \"Long\"\n[[steps]]\nname = \"best\"\nrun = \"design\"\ntask = \"task.toml\"\nstarts = 5000\n";
    std::fs::write(folder.path("study.toml"), text).unwrap();
    folder
}

#[test]
fn sigterm_ended_a_design_without_a_result() {
    let folder = with_long_search();
    let child = start(&folder, &["design", "task.toml", "--starts", "5000", "--out", "out"]);
    std::thread::sleep(Duration::from_secs(2));
    let (run, took) = ended("-TERM", child);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(folder.path("out/result.json").exists() && took < SOON, "{took:?} {run:?}");
}

#[test]
fn killing_a_study_left_its_step_behind() {
    let folder = with_long_search();
    for signal in ["-TERM", "-INT"] {
        let child = start(&folder, &["study", "study.toml"]);
        std::thread::sleep(Duration::from_secs(2));
        let (run, took) = ended(signal, child);
        assert_eq!(run.code, Some(1), "{run:?}");
        assert!(run.stderr.contains("stopped; repeat the command to resume"), "{run:?}");
        assert!(folder.path("study/best/result.json").exists() && took < SOON, "{took:?}");
    }
}

#[test]
fn sigterm_ended_long_studies_and_nothing_was_kept() {
    let folder = Folder::new();
    std::fs::copy(repository("tasks/two_mass.toml"), folder.path("task.toml")).unwrap();
    let vary = ["--designs", "start", "--vary", "drive_variance=log:1e-3:1e-2:40", "--rollouts", "5000"];
    for (words, left, key) in [
        (&["pareto", "task.toml", "--points", "3000", "--starts", "1"][..], "points of the front are stored", "points"),
        (&["trace", "task.toml", "--starts", "3000"], "searches had finished", "runs"),
        (&[&["robustness", "task.toml"], &vary[..]].concat(), "costs were computed and stored", "cells"),
    ] {
        let out = format!("out_{}", words[0]);
        // On a busy machine it may take a while until there is something to keep.
        let stopped = |seconds: u64| {
            let child = start(&folder, &[words, &["--out", &out]].concat());
            std::thread::sleep(Duration::from_secs(seconds));
            Some(ended("-TERM", child)).filter(|_| folder.path(&out).join("result.json").exists())
        };
        let (run, took) = [3, 10, 40].into_iter().find_map(stopped).expect("nothing was kept");
        assert_eq!(run.code, Some(1), "{run:?}");
        assert!(run.stderr.contains("warning: stopped: ") && run.stderr.contains(left), "{run:?}");
        assert!(run.stdout.contains("Warning: stopped: ") && took < SOON, "{took:?} {run:?}");
        let kept = std::fs::read_to_string(folder.path(&out).join("result.json")).unwrap();
        let kept: serde_json::Value = serde_json::from_str(&kept).unwrap();
        let text = kept.to_string();
        assert!(text.contains("\"stopped\":true"), "{}", &text[..text.len().min(2000)]);
        // The other commands read it, and say that it is not whole.
        let shown = folder.run(&["show", &out]);
        assert!(shown.code == Some(0) && shown.stdout.contains("Warning: stopped: "), "{shown:?}");
        let json = folder.run(&["show", &out, "--json"]);
        let json: serde_json::Value = serde_json::from_str(&json.stdout).unwrap();
        assert!(json[key].as_array().is_some_and(|list| !list.is_empty()), "{key}");
        let report = folder.run(&["report", &out, "--out", &format!("{out}.html")]);
        assert_eq!(report.code, Some(0), "{report:?}");
    }
}

#[test]
fn a_study_stopped_before_it_found_anything_keeps_nothing() {
    let folder = Folder::new();
    let task = repository("tasks/wiping_arm.toml").display().to_string();
    let child = start(&folder, &["pareto", &task, "--points", "200", "--out", "out"]);
    // It has begun, and the first point takes longer than this.
    let clock = Instant::now();
    while !folder.path("out/journal.redb").exists() {
        assert!(clock.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(5));
    }
    let (run, took) = ended("-TERM", child);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stderr.contains("stopped; no result was stored") && took < SOON, "{took:?} {run:?}");
    assert!(!folder.path("out/result.json").exists());
}

#[test]
fn what_keeps_no_parts_says_so_when_it_is_stopped() {
    let folder = Folder::new();
    let task = repository("tasks/two_mass.toml").display().to_string();
    for words in [&["bound", &task, "--curve=10000"][..], &["evaluate", &task, "--rollouts", "10000000"]] {
        let child = start(&folder, &[words, &["--out", "out"]].concat());
        std::thread::sleep(Duration::from_secs(1));
        let (run, took) = ended("-INT", child);
        assert_eq!((run.code, run.stderr.as_str()), (Some(1), "error: stopped; no result was stored\n"), "{run:?}");
        assert!(!folder.path("out/result.json").exists() && took < SOON, "{took:?}");
    }
}

#[test]
fn an_explorer_ends_when_it_is_asked_to() {
    let folder = Folder::with_task(TWO_MASS);
    for signal in ["-INT", "-TERM"] {
        let child = start(&folder, &["explore", "task.toml", "--no-browser"]);
        std::thread::sleep(Duration::from_secs(2));
        let (run, took) = ended(signal, child);
        assert!(run.code == Some(0) && took < SOON, "{took:?} {run:?}");
    }
}

#[test]
fn a_stopped_step_of_a_study_resumes() {
    let folder = Folder::with_task(TWO_MASS);
    let text = "title = \"Long\"\n[[steps]]\nname = \"paths\"\nrun = \"trace\"\ntask = \"task.toml\"\nstarts = 3000\n";
    std::fs::write(folder.path("study.toml"), text).unwrap();
    let mut kept = 0;
    for _ in 0..2 {
        let child = start(&folder, &["study", "study.toml"]);
        std::thread::sleep(Duration::from_secs(4));
        let (run, _) = ended("-TERM", child);
        assert!(run.code == Some(1) && run.stderr.contains("step 1 of 1, paths: supple trace"), "{run:?}");
        assert!(folder.path("study/paths/result.json").exists(), "{run:?}");
        // It resumes: what was done is not done again.
        let now = supple_study::kept_parts(&folder.path("study/paths")).unwrap();
        assert!(now > kept, "{now} after {kept}");
        kept = now;
    }
}

/// A chain of states that only the last of them is driven through, with a cost on all of them.
fn chain(states: usize) -> String {
    let matrix = |rows: usize, cols: usize, entry: &dyn Fn(usize, usize) -> f64| {
        let row = |i: usize| (0..cols).map(|j| format!("{:?}", entry(i, j))).collect::<Vec<_>>().join(", ");
        (0..rows).map(|i| format!("[{}]", row(i))).collect::<Vec<_>>().join(", ")
    };
    let one = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    let moves = |i: usize, j: usize| if i == j { 0.9 } else { 0.2 * one(i + 1, j) };
    let list = |number: &str| vec![number; states].join(", ");
    format!(
        "title = \"Chain\"\n[model]\nkind = \"linear\"\nA = [{}]\nB = [{}]\nC = [{}]\n\
         [[tasks]]\nname = \"hold\"\nsteps = 2\ntime_step = 0.1\ninitial_state = [{}]\n\
         [tasks.noise]\ninitial = [{noise}]\nprocess = [{noise}]\nmeasurement = [0.01]\n\
         [[tasks.costs]]\nkind = \"quadratic\"\nQ = [{}]\nR = [[1.0]]\n",
        matrix(states, states, &moves),
        matrix(states, 1, &|i, _| one(i + 1, states)),
        matrix(1, states, &|_, j| one(0, j)),
        list("0.0"),
        matrix(states, states, &one),
        noise = list("0.01"),
    )
}

/// The regulator of a large system, and the proof that its price is paid, take a minute: neither was ever asked to stop.
#[test]
fn a_stationary_bound_of_a_large_system_went_on_for_a_minute() {
    let folder = Folder::with_task(chain(150));
    for after in [3, 8] {
        let child = start(&folder, &["bound", "task.toml", "--stationary", "--cost", "1e9", "--out", "out"]);
        std::thread::sleep(Duration::from_secs(after));
        let (run, took) = ended("-INT", child);
        assert_eq!((run.code, run.stderr.as_str()), (Some(1), "error: stopped; no result was stored\n"), "{run:?}");
        assert!(!folder.path("out/result.json").exists() && took < Duration::from_secs(5), "{after}: {took:?}");
    }
}
