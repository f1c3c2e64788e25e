use crate::common::{Folder, repository};
use crate::{sweep, two_mass};

fn text() -> String {
    std::fs::read_to_string(repository("tasks/two_mass.toml")).unwrap()
}

#[test]
fn axes_that_cannot_be_are_refused_before_anything_is_written() {
    let folder = two_mass();
    for (grid, said) in [
        (vec!["k1"], "error: --grid k1: write NAME=FROM:TO:COUNT"),
        (vec!["k3=1:2:3"], "error: --grid k3=1:2:3: no parameter `k3`; valid: `k1`, `k2`"),
        (vec!["k1=10:600:3"], "error: --grid k1=10:600:3: 10 is outside the bounds of `k1`, [50, 600]"),
        (vec!["k1=50:600:0"], "error: --grid k1=50:600:0: COUNT = 0: the axis would be empty; COUNT is at least 1"),
        (
            vec!["k1=log:0:600:3"],
            "error: --grid k1=log:0:600:3: a logarithmic axis needs positive ends; found 0 and 600",
        ),
        (vec!["k1=50,60", "k1=70,80"], "error: parameter `k1` is on two axes; it may be on one"),
        (vec!["k1=50:600:9999", "k2=100:600:9999"], "error: 99980001 points are too many; a grid has at most 10000000"),
    ] {
        let mut arguments = sweep(&["--out", "out"]);
        grid.iter().for_each(|axis| arguments.extend(["--grid", axis]));
        let run = folder.run(&arguments);
        assert!(run.error().starts_with(said), "{}", run.error());
        assert_eq!(folder.names(), ["task.toml"]);
    }
    let nothing = folder.run(&sweep(&["--grid", "k1=50,60", "--grid", "k2=100,200", "--starts", "1"]));
    assert!(nothing.error().contains("there is nothing to design"), "{}", nothing.error());
}

#[test]
fn what_changed_under_a_journal_is_shown_and_nothing_is_lost() {
    let folder = two_mass();
    let grid = ["--grid", "k1=300:600:4", "--out", "out"];
    assert_eq!(folder.run(&sweep(&grid)).code, Some(0));
    let journal = std::fs::read(folder.path("out/journal.redb")).unwrap();
    let refused = |arguments: &[&str], lines: &[&str]| {
        let run = folder.run(arguments);
        assert_eq!(
            run.error(),
            "error: out/journal.redb: belongs to another sweep; give another --out, or remove the file to start anew"
        );
        lines.iter().for_each(|line| assert!(run.stderr.lines().any(|l| l == *line), "no `{line}` in\n{}", run.stderr));
        assert!(std::fs::read(folder.path("out/journal.redb")).unwrap() == journal);
    };
    let with = |more: &[&'static str]| sweep(&[&grid, more].concat());
    refused(&with(&["--seed", "7"]), &["-seed 0", "+seed 7"]);
    refused(&with(&["--rollouts", "7"]), &["-rollouts 0", "+rollouts 7"]);
    refused(&with(&["--starts", "1"]), &["-starts 0", "+starts 1"]);
    refused(&with(&["--set", "k2=300"]), &["-parameter k2 = 500.0", "+parameter k2 = 300.0"]);
    refused(&sweep(&["--grid", "k1=300,600", "--out", "out"]), &["+grid k1 (logarithmic): [300.0, 600.0]"]);
    std::fs::write(folder.path("task.toml"), text().replace("bound = 250.0 ", "bound = 260.0 ")).unwrap();
    refused(
        &sweep(&grid),
        &[
            "-bound = 250.0                    # the expected cost may be at most this",
            "+bound = 260.0                    # the expected cost may be at most this",
        ],
    );
    // What is on an axis has no other value, and where the file lies says nothing.
    std::fs::write(folder.path("other.toml"), text()).unwrap();
    let moved = [&["sweep", "other.toml"], &grid[..], &["--set", "k1=99", "--threads", "1"]].concat();
    let moved = folder.run(&moved);
    assert_eq!(moved.code, Some(0));
    let said = "warning: --set k1=99 changes nothing: --grid gives this parameter its values";
    assert!(moved.stderr.lines().any(|line| line == said), "{}", moved.stderr);
}

#[test]
fn a_changed_robot_is_shown_too() {
    let folder = Folder::new();
    for path in ["tasks/iiwa_door.toml", "models/iiwa14_door.urdf"] {
        let to = folder.path(path);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::copy(repository(path), to).unwrap();
    }
    let task = folder.path("tasks/iiwa_door.toml");
    let text = std::fs::read_to_string(&task).unwrap();
    let parameter = text.lines().find_map(|line| line.strip_prefix("[parameters.")?.strip_suffix(']')).unwrap();
    let value = text.split(&format!("[parameters.{parameter}]")).nth(1).unwrap();
    let value = value.lines().find_map(|line| line.strip_prefix("initial = ")).unwrap();
    let axis = format!("{parameter}={}", value.split_whitespace().next().unwrap());
    let arguments = ["sweep", "tasks/iiwa_door.toml", "--grid", &axis, "--out", "out"];
    assert!(matches!(folder.run(&arguments).code, Some(0)));
    let robot = folder.path("models/iiwa14_door.urdf");
    let urdf = std::fs::read_to_string(&robot).unwrap();
    let edited = urdf.replacen("</robot>", "<!-- lighter -->\n</robot>", 1);
    std::fs::write(&robot, edited).unwrap();
    let run = folder.run(&arguments);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("\n+<!-- lighter -->\n"), "{}", run.stderr);
}

#[test]
fn journals_that_are_none_are_named_and_left_alone() {
    for bytes in [&b""[..], b"no journal", &[7; 50_000]] {
        let folder = two_mass();
        std::fs::create_dir(folder.path("out")).unwrap();
        std::fs::write(folder.path("out/journal.redb"), bytes).unwrap();
        let run = folder.run(&sweep(&["--grid", "k1=300,600", "--out", "out"]));
        let error = run.error();
        assert!(error.starts_with("error: out/journal.redb: is damaged or not a supple journal: "), "{error}");
        assert!(error.ends_with("; give another --out, or remove the file to start anew"), "{error}");
        assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
        assert_eq!(std::fs::read(folder.path("out/journal.redb")).unwrap(), bytes);
    }
}

/// The journal was removed, as the error about another sweep says; the table of the other sweep went without a word.
#[test]
fn a_sweep_of_other_points_is_not_replaced_without_a_word() {
    let folder = two_mass();
    assert_eq!(folder.run(&sweep(&["--grid", "k1=300,600", "--out", "out"])).code, Some(0));
    std::fs::remove_file(folder.path("out/journal.redb")).unwrap();
    let same = folder.run(&sweep(&["--grid", "k1=300,600", "--out", "out"]));
    assert_eq!((same.code, same.stderr.contains("replaces")), (Some(0), false), "{}", same.stderr);
    std::fs::remove_file(folder.path("out/journal.redb")).unwrap();
    let other = folder.run(&sweep(&["--grid", "k1=300,400,600", "--out", "out"]));
    let said = "warning: out contains a sweep of other points (`k1`: 2 values), which this one replaces\n";
    assert!(other.code == Some(0) && other.stderr.contains(said), "{}", other.stderr);
}
