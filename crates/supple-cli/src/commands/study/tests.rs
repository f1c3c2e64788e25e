//! Study files: what steps become, and what is said where a file is wrong.

use std::path::{Path, PathBuf};

use clap::Parser;

use super::file::StudyFile;
use crate::arguments::{Arguments, Command, Count, StudyCommand};

const STUDY: &str = r#"title = "A study"

[[steps]]
name = "landscape"
run = "sweep"
task = "../tasks/two_mass.toml"
grid = ["k1=50:600:3", "k2=log:100:600:3"]
rollouts = 20
set = ["wall_variance=1e-5"]

[[steps]]
name = "best"
run = "design"
task = "./own.toml"
starts = 2
verbose = true
seed = 3

[[figures]]
name = "first"
figure = "landscape"
from = ["landscape", "best"]
format = "pdf"
"#;

fn load(text: &str) -> Result<StudyFile, supple::FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("study.toml");
    std::fs::write(&path, text).unwrap();
    StudyFile::load(&path, Path::new("out"))
}

#[test]
fn steps_are_commands() {
    let study = load(STUDY).unwrap();
    assert_eq!(study.title, "A study");
    let [landscape, best] = &study.steps[..] else { panic!("{:?}", study.steps) };
    let StudyCommand::Sweep(sweep) = &landscape.command else { panic!("{landscape:?}") };
    assert_eq!(sweep.ask.grid, ["k1=50:600:3", "k2=log:100:600:3"]);
    assert_eq!(
        (sweep.ask.rollouts, sweep.ask.starts, &sweep.task.set[..]),
        (Count(20), Count(0), &["wall_variance=1e-5".to_owned()][..])
    );
    assert_eq!(sweep.output.out, Some(PathBuf::from("out/landscape")));
    // Paths as from the folder of the study.
    assert!(sweep.task.task.ends_with("tasks/two_mass.toml"), "{:?}", sweep.task);
    let StudyCommand::Design(design) = &best.command else { panic!("{best:?}") };
    assert_eq!((design.ask.starts, design.task.verbose, design.output.json), (Some(Count(2)), true, false));
    assert!(design.task.task.ends_with("own.toml") && design.task.task.is_absolute(), "{:?}", design.task);
    let [figure] = &study.figures[..] else { panic!("{:?}", study.figures) };
    assert_eq!(figure.command.folders, [PathBuf::from("out/landscape"), PathBuf::from("out/best")]);
    assert_eq!(figure.command.out, Some(PathBuf::from("out/figures/first.pdf")));
}

#[test]
fn wrong_files_are_errors_with_their_line() {
    let cases = [
        ("run = \"sweep\"", "run = \"swepe\"", 5, "steps[0].run: must be one of", Some("did you mean `sweep`?")),
        ("run = \"sweep\"\n", "", 4, "steps[0].run: is missing", None),
        ("task = \"./own.toml\"\n", "", 12, "steps[1].task: is missing", None),
        (
            "task = \"./own.toml\"",
            "task = [\"a\", \"b\"]",
            14,
            "steps[1].task: must be text in quotes; found a list",
            None,
        ),
        (
            "name = \"best\"",
            "name = \"landscape\"",
            12,
            "steps[1].name: the name `landscape` occurs twice; names must be unique",
            None,
        ),
        ("name = \"best\"", "name = \"../best\"", 12, "steps[1].name: must be of letters from a to z", None),
        (
            "name = \"best\"",
            "name = \"figures\"",
            12,
            "steps[1].name: `figures` is reserved for the figures folder",
            None,
        ),
        ("from = [\"landscape\"", "from = [\"landscpe\"", 22, "there is no step `landscpe`", Some("did you mean")),
        ("from = [\"landscape\", \"best\"]\n", "", 20, "figures[0].from: must name at least one step", None),
        (
            "rollouts = 20",
            "out = \"elsewhere\"",
            8,
            "steps[0].out: is an option of `supple study`, not of a step",
            None,
        ),
        (
            "rollouts = 20",
            "rollouts = -1",
            8,
            "steps[0].rollouts: must be a whole number from 0 to 1000000; found -1",
            None,
        ),
        (
            "rollouts = 20",
            "rolouts = 20",
            8,
            "steps[0].rolouts: unknown key `rolouts`; valid: `grid`, `rollouts`",
            Some("did you mean `rollouts`?"),
        ),
        ("grid = [\"k1=50:600:3\", \"k2=log:100:600:3\"]\n", "", 3, "steps[0].grid: is missing", None),
        ("starts = 2", "method = \"newton\"", 15, "steps[1].method: must be one of", None),
        ("figure = \"landscape\"", "figure = \"landscpe\"", 21, "figures[0].figure: must be one of", None),
        (
            "seed = 3",
            "from = \"landscape\"",
            18,
            "steps[1].from: no step before this one is a `design` or `evaluate`",
            None,
        ),
        ("seed = 3", "from = [\"a\", \"b\"]", 18, "steps[1].from: must be text in quotes; found a list", None),
        (
            "rollouts = 20",
            "rollouts = true",
            8,
            "steps[0].rollouts: must be a whole number from 0 to 1000000; found",
            None,
        ),
        ("rollouts = 20", "rollouts = [1, 2]", 8, "steps[0].rollouts: ", None),
        (
            "rollouts = 20",
            "rollouts = { a = 1 }",
            8,
            "steps[0].rollouts: must be a whole number from 0 to 1000000; found",
            None,
        ),
        ("title = \"A study\"", "titel = \"A study\"", 1, "titel", Some("did you mean `title`?")),
        ("[[figures]]", "[[figures", 20, "", None),
    ];
    for (from, to, line, message, help) in cases {
        assert!(STUDY.contains(from), "{from}");
        let error = load(&STUDY.replacen(from, to, 1)).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(message), "{from} -> {to}: {text}");
        if let Some(help) = help {
            assert!(text.contains(help), "{text}");
        }
        assert!(error.line.abs_diff(line) <= 1, "{from} -> {to}: line {} of {text}", error.line);
    }
    let none = load("title = \"Nothing\"\n").unwrap_err().to_string();
    assert!(none.contains("at least one table [[steps]]"), "{none}");
}

#[test]
fn steps_start_from_designs_of_earlier_ones() {
    let after =
        format!("{STUDY}\n[[steps]]\nname = \"after\"\nrun = \"bound\"\ntask = \"own.toml\"\nfrom = \"best\"\n");
    let study = load(&after).unwrap();
    assert_eq!(study.steps[2].command.asks().task().from, Some(PathBuf::from("out/best")));
    let error = load(&after.replace("from = \"best\"", "from = \"bets\"")).unwrap_err().to_string();
    assert!(
        error.contains("must be an earlier step that is a `design` or `evaluate`, `best`; found `bets`"),
        "{error}"
    );
    assert!(error.contains("did you mean `best`?"), "{error}");
}

#[test]
fn options_are_what_they_are_on_a_command_line() {
    let step = |run: &str, options: &str| {
        let text =
            format!("title = \"One\"\n[[steps]]\nname = \"one\"\nrun = \"{run}\"\ntask = \"a.toml\"\n{options}\n");
        load(&text).map(|mut study| study.steps.remove(0).command)
    };
    let same = |run: &str, options: &str, words: &[&str]| {
        let line = ["supple", run, "a.toml"].into_iter().chain(words.iter().copied());
        let Command::Study(typed) = Arguments::try_parse_from(line).unwrap().command else { panic!("{run}") };
        let plain = |command: &StudyCommand| {
            let text = format!("{command:?}");
            let (start, end) = (text.find(", ask: ").unwrap(), text.find(", output: ").unwrap());
            text[start..end].to_owned()
        };
        assert_eq!(plain(&step(run, options).unwrap()), plain(&typed), "{options}");
    };
    for run in ["design", "evaluate", "pareto", "sensors", "bound", "trace"] {
        same(run, "", &[]);
    }
    same("robustness", "vary = \"v=1,2\"", &["--vary", "v=1,2"]);
    same("sweep", "grid = \"k=1,2\"\njobs = 2", &["--grid", "k=1,2", "--jobs", "2"]);
    same("bound", "curve = true\ncost = 5", &["--curve", "--cost", "5"]);
    same("bound", "curve = 7\nstationary = true", &["--curve=7", "--stationary"]);
    same("sensors", "for = \"information\"\nbudget = 2.5", &["--for", "information", "--budget", "2.5"]);
    same("trace", "gradient = [\"frozen\", \"total\"]", &["--gradient", "frozen,total"]);
    same("trace", "method = \"sqp, barrier\"\nstarts = 3", &["--method", "sqp,barrier", "--starts", "3"]);
    same("evaluate", "gradient = \"both\"\nbranches = 4", &["--gradient", "both", "--branches", "4"]);
    same(
        "design",
        "information = \"needed=1,measured=0.01\"\nseed = 3",
        &["--information", "needed=1,measured=0.01", "--seed", "3"],
    );
    for (run, options, says) in [
        ("bound", "curve = 1", "steps[0].curve: must be a whole number from 2 to 10000; found 1"),
        ("trace", "method = \"sqp,newton\"", "steps[0].method: must be one of"),
        ("sweep", "grid = [1, 2]", "steps[0].grid[0]: must be text in quotes"),
        ("sensors", "goal = \"cost\"", "unknown key `goal`"),
        ("pareto", "seed = -1", "steps[0].seed: must not be negative"),
    ] {
        let error = step(run, options).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn the_shipped_study_reads() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/paper.toml");
    let study = StudyFile::load(&path, Path::new("paper")).unwrap();
    assert!(study.steps.len() >= 9 && study.figures.len() >= 8);
}
