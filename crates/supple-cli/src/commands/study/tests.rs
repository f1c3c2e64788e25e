//! Study files: what steps become, and what is said where a file is wrong.

use std::path::{Path, PathBuf};

use super::file::StudyFile;
use crate::arguments::StudyCommand;

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
    assert_eq!(sweep.grid, ["k1=50:600:3", "k2=log:100:600:3"]);
    assert_eq!((sweep.rollouts, sweep.starts, &sweep.task.set[..]), (20, 0, &["wall_variance=1e-5".to_owned()][..]));
    assert_eq!(sweep.output.out, Some(PathBuf::from("out/landscape")));
    // Paths as from the folder of the study.
    assert!(sweep.task.task.ends_with("tasks/two_mass.toml"), "{:?}", sweep.task);
    let StudyCommand::Design(design) = &best.command else { panic!("{best:?}") };
    assert_eq!((design.starts, design.task.verbose, design.output.json), (Some(2), true, false));
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
        ("task = \"./own.toml\"", "task = [\"a\", \"b\"]", 14, "steps[1].task: must be one text", None),
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
            "steps[0].rolouts: `supple sweep` has no such option",
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
        ("seed = 3", "from = [\"a\", \"b\"]", 18, "steps[1].from: must be one text", None),
        (
            "rollouts = 20",
            "rollouts = true",
            8,
            "steps[0].rollouts: takes a value (closed-loop roll-outs at every point); found true",
            None,
        ),
        ("starts = 2", "method = true", 15, "steps[1].method: must be one of", None),
        ("rollouts = 20", "rollouts = [1, 2]", 8, "steps[0].rollouts: ", None),
        ("rollouts = 20", "rollouts = { a = 1 }", 8, "a number, a text, true, false, or a list", None),
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
fn the_shipped_study_reads() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/paper.toml");
    let study = StudyFile::load(&path, Path::new("paper")).unwrap();
    assert!(study.steps.len() >= 9 && study.figures.len() >= 8);
}
