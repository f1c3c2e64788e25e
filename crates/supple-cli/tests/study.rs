//! `supple study` and `supple show`: several commands in one, not made again where nothing changed.

#![allow(clippy::unwrap_used)]

mod common;

use common::{Folder, TWO_MASS, edited, repository};

const STUDY: &str = r#"title = "A small study"

[[steps]]
name = "best"
run = "design"
task = "task.toml"
starts = 1

[[steps]]
name = "line"
run = "sweep"
task = "task.toml"
grid = "k1=log:20:120:5"

[[steps]]
name = "start"
run = "evaluate"
task = "task.toml"
rollouts = 2

[[figures]]
name = "line"
figure = "landscape"
from = ["line", "best"]
"#;

fn with_study(text: &str) -> Folder {
    let folder = Folder::with_task(TWO_MASS);
    std::fs::write(folder.path("study.toml"), text).unwrap();
    folder
}

#[test]
fn a_study_makes_its_steps_figures_and_a_report() {
    let folder = with_study(STUDY);
    let run = folder.run(&["study", "study.toml"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.stderr.contains("step 2 of 3, line: supple sweep task.toml --grid k1=log:20:120:5 --out study/line"));
    assert!(run.stdout.contains("A small study\n\n3 steps in "), "{}", run.stdout);
    for file in ["best/result.json", "line/table.csv", "start/result.json", "figures/line.svg", "report.html"] {
        assert!(folder.path("study").join(file).exists(), "{file}");
    }
    let page = std::fs::read_to_string(folder.path("study/report.html")).unwrap();
    assert!(page.contains("<title>A small study</title>"));

    let shown = folder.run(&["show", "study"]);
    let (code, shown) = shown.quiet();
    assert_eq!(code, Some(0));
    let found = folder.run(&["show", "study/best"]);
    assert!(shown.contains(found.quiet().1.trim_end()) && shown.contains("5 points, all evaluated"), "{shown}");
    assert!(shown.contains("study/figures/line.svg: a figure"), "{shown}");

    let again = folder.run(&["study", "study.toml"]);
    assert_eq!(again.stderr.matches(": reused from an earlier run").count(), 3, "{}", again.stderr);
    // Another option of one step, and all steps of another task.
    std::fs::write(folder.path("study.toml"), edited(STUDY, "rollouts = 2", "rollouts = 3")).unwrap();
    assert_eq!(folder.run(&["study", "study.toml"]).stderr.matches(": reused from an earlier run").count(), 2);
    let finer = edited(STUDY, "k1=log:20:120:5", "k1=log:20:120:6");
    std::fs::write(folder.path("study.toml"), &finer).unwrap();
    let run = folder.run(&["study", "study.toml"]);
    assert_eq!((run.code, run.stderr.matches(": reused from an earlier run").count()), (Some(0), 1), "{run:?}");
    assert!(folder.run(&["show", "study"]).stdout.contains("6 points, all evaluated"));
    std::fs::write(folder.path("task.toml"), edited(TWO_MASS, "bound = ", "bound = 1")).unwrap();
    let run = folder.run(&["study", "study.toml"]);
    assert_eq!((run.code, run.stderr.matches(": reused from an earlier run").count()), (Some(0), 0), "{run:?}");
}

/// Robustness over a parameter that is designed: known before the first step, not after all others.
#[test]
fn options_that_do_not_fit_the_task_are_told_before_the_first_step() {
    let after = "
[[steps]]
name = \"noise\"
run = \"robustness\"
task = \"task.toml\"
vary = \"k1=30,60\"

[[figures]]";
    let folder = with_study(&edited(STUDY, "\n[[figures]]", after));
    let run = folder.run(&["study", "study.toml"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.stderr.contains("study.toml:") && run.stderr.contains("`k1` is a design parameter"), "{}", run.stderr);
    assert!(!run.stderr.contains("step 1 of 4") && !folder.path("study").exists(), "{}", run.stderr);
}

/// Stiffness as a design finds it, from which two later steps start, and another when the design changes.
#[test]
fn steps_start_from_the_design_of_an_earlier_one() {
    let after = "
[[steps]]
name = \"after\"
run = \"evaluate\"
task = \"task.toml\"
rollouts = 0
from = \"best\"

[[steps]]
name = \"set\"
run = \"evaluate\"
task = \"task.toml\"
rollouts = 0
from = \"after\"
set = \"k1=100\"

[[figures]]";
    let text = edited(STUDY, "\n[[figures]]", after);
    let folder = with_study(&text);
    let run = folder.run(&["study", "study.toml"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let parameters = |step: &str, key: &str| {
        let text = std::fs::read_to_string(folder.path(&format!("study/{step}/result.json"))).unwrap();
        let found: serde_json::Value = serde_json::from_str(&text).unwrap();
        found["result"][key]["parameters"].clone()
    };
    let best = parameters("best", "optimum");
    assert_ne!(best, parameters("best", "start"));
    let evaluation = |step: &str| {
        let text = std::fs::read_to_string(folder.path(&format!("study/{step}/result.json"))).unwrap();
        let found: serde_json::Value = serde_json::from_str(&text).unwrap();
        found["result"]["evaluation"]["parameters"].clone()
    };
    assert_eq!(best, evaluation("after"));
    let set = evaluation("set");
    assert_eq!((&set["k2"], set["k1"].as_f64()), (&best["k2"], Some(100.0)));
    assert!(run.stderr.contains(&format!("supple evaluate task.toml --set k1={}", best["k1"])), "{}", run.stderr);

    // The same on the command line, and what is wrong there.
    let alone = folder.run(&["evaluate", "task.toml", "--rollouts", "0", "--from", "study/best", "--json"]);
    let found: serde_json::Value = serde_json::from_str(&alone.stdout).unwrap();
    assert_eq!(found["parameters"], best, "{}", alone.stderr);
    let wrong = folder.run(&["evaluate", "task.toml", "--from", "study/line"]);
    assert_eq!(wrong.code, Some(2));
    assert!(wrong.stderr.contains("--from study/line: is a result of `supple sweep`"), "{}", wrong.stderr);

    let again = folder.run(&["study", "study.toml"]);
    assert_eq!(again.stderr.matches(": reused from an earlier run").count(), 5, "{}", again.stderr);
    // A search that is repeated and finds the same design changes nothing after it; another one does.
    std::fs::write(folder.path("study.toml"), edited(&text, "starts = 1", "starts = 1\nseed = 3")).unwrap();
    let repeated = folder.run(&["study", "study.toml"]);
    assert_eq!(repeated.stderr.matches(": reused from an earlier run").count(), 4, "{}", repeated.stderr);
    std::fs::write(folder.path("task.toml"), edited(TWO_MASS, "bound = 25.0", "bound = 24.0")).unwrap();
    let changed = folder.run(&["study", "study.toml"]);
    assert_eq!(changed.stderr.matches(": reused from an earlier run").count(), 0, "{}", changed.stderr);
    assert_eq!(parameters("best", "optimum"), evaluation("after"));
    assert_ne!(parameters("best", "optimum"), best);
}

#[test]
fn a_step_that_fell_short_counts_whenever_the_study_is_run() {
    let folder = with_study(STUDY);
    std::fs::write(folder.path("task.toml"), edited(TWO_MASS, "bound = ", "bound = 0.1 # ")).unwrap();
    let first = folder.run(&["study", "study.toml"]);
    assert_eq!(first.code, Some(1), "{first:?}");
    let again = folder.run(&["study", "study.toml"]);
    assert_eq!(again.code, Some(1), "{again:?}");
    assert!(again.stderr.contains("best: reused from an earlier run, which fell short"), "{}", again.stderr);

    // A design that was stopped is made again.
    let result = folder.path("study/best/result.json");
    let text = std::fs::read_to_string(&result).unwrap();
    let (before, after) = text.split_once("\"starts\"").unwrap();
    let status = after.find("\"status\": \"").unwrap() + "\"status\": \"".len();
    let end = status + after[status..].find('"').unwrap();
    std::fs::write(&result, format!("{before}\"starts\"{}stopped{}", &after[..status], &after[end..])).unwrap();
    let resumed = folder.run(&["study", "study.toml"]);
    assert!(!resumed.stderr.contains("best: reused from an earlier run"), "{}", resumed.stderr);
    assert_eq!(resumed.stderr.matches(": reused from an earlier run").count(), 2, "{}", resumed.stderr);
}

#[test]
fn what_is_shown_is_what_was_printed() {
    let folder = Folder::with_task(TWO_MASS);
    for arguments in [&["design", "task.toml", "--starts", "1"][..], &["trace", "task.toml", "--starts", "1"]] {
        let kept = arguments[0];
        let printed = folder.run(&[arguments, &["--out", kept]].concat());
        assert_eq!(folder.run(&["show", kept]).quiet().1, printed.stdout);
    }
}

#[test]
fn an_option_that_a_command_has_not_is_found_before_anything_runs() {
    let folder = with_study(&edited(STUDY, "rollouts = 2", "rolouts = 2"));
    let error = folder.run(&["study", "study.toml"]);
    let error = error.error();
    assert!(
        error.starts_with("error: study.toml:19:")
            && error.contains("steps[2].rolouts: unknown key `rolouts`; valid: `gradient`, `rollouts`"),
        "{error}"
    );
    assert_eq!(folder.names(), ["study.toml", "task.toml"], "nothing was made");
}

#[test]
fn options_that_do_not_fit_the_task_are_found_before_anything_runs() {
    for (from, to, said) in [
        (
            "k1=log:20:120:5",
            "k1=log:20:1200:5",
            "steps[1].grid: k1=log:20:1200:5: 154.91933384829667 is outside the bounds",
        ),
        ("rollouts = 2", "set = \"k3=1\"", "steps[2].set: k3=1: "),
        ("rollouts = 2", "threads = 1", "is an option of `supple study`, not of a step"),
        ("task = \"task.toml\"\ngrid", "task = \"tusk.toml\"\ngrid", "tusk.toml: "),
    ] {
        let folder = with_study(&edited(STUDY, from, to));
        let error = folder.run(&["study", "study.toml"]);
        assert!(error.error().contains(said), "{to}: {}", error.error());
        assert_eq!(folder.names(), ["study.toml", "task.toml"], "{to}: nothing was made");
    }
}

#[test]
fn a_step_that_cannot_be_made_ends_the_study_and_keeps_the_others() {
    let folder = with_study(&edited(
        STUDY,
        "run = \"sweep\"\ntask = \"task.toml\"\ngrid = \"k1=log:20:120:5\"",
        "run = \"bound\"\ntask = \"task.toml\"\nstationary = true",
    ));
    std::fs::write(
        folder.path("study.toml"),
        edited(
            &std::fs::read_to_string(folder.path("study.toml")).unwrap(),
            "from = [\"line\", \"best\"]",
            "from = [\"best\"]",
        ),
    )
    .unwrap();
    let run = folder.run(&["study", "study.toml"]);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.stderr.contains("error: step 2 of 3, line failed"), "{}", run.stderr);
    assert!(folder.path("study/best/result.json").exists() && !folder.path("study/report.html").exists());
}

/// Every study, asked for in the program's words: it is kept as a value, whose words ask for the same.
#[test]
fn the_words_of_every_study_ask_for_the_same() {
    let folder = Folder::with_task(std::fs::read(repository("tasks/two_mass.toml")).unwrap());
    let vary = "drive_variance=log:1e-3:1e-2:3";
    let asked: [&[&str]; 10] = [
        &["design", "--starts", "2", "--set", "k1=150", "--rollouts", "4"],
        &["design", "--method", "cobyla", "--information", "used", "--starts", "1", "--rollouts", "0"],
        &["evaluate", "--gradient", "both", "--rollouts", "3", "--seed", "5"],
        &["sweep", "--grid", "k1=log:60:500:4", "--grid", "k2=130,131.5,400", "--rollouts", "2"],
        &["robustness", "--designs", "start,soft=k1:60.5", "--vary", vary, "--rollouts", "2"],
        &["pareto", "--points", "3", "--starts", "1"],
        &["trace", "--starts", "1", "--method", "barrier", "--gradient", "total,frozen"],
        &["sensors", "--count", "1", "--for", "information", "--method", "greedy"],
        &["bound", "--cost", "250"],
        &["bound", "--curve=3", "--task", "press"],
    ];
    for (number, asked) in asked.iter().enumerate() {
        let made = |words: &[&str], out: &str| {
            let run = folder.run(&[words, &["--out", out]].concat());
            assert!(matches!(run.code, Some(0 | 1)), "{words:?}: {run:?}");
            supple_study::Folder::load(&folder.path(out)).unwrap()
        };
        let first = made(&[&asked[..1], &["task.toml"], &asked[1..]].concat(), &format!("{number}a"));
        let study = first.made.study.clone().unwrap();
        let words = study.words();
        let again = made(&words.iter().map(String::as_str).collect::<Vec<_>>(), &format!("{number}b"));
        assert_eq!(again.made, first.made, "{study}");
        let text = |folder: &supple_study::Folder| {
            let mut result =
                serde_json::from_str::<serde_json::Value>(&folder.result.json().unwrap()).unwrap_or_default();
            ["seconds", "report_seconds"]
                .iter()
                .for_each(|&key| drop(result.as_object_mut().map(|result| result.remove(key))));
            result
        };
        assert_eq!(text(&again), text(&first), "{study}");
    }
}
