//! Task files of others.

use crate::common::{Folder, TWO_MASS, edited};

const ROBOT: &str =
    "[model]\nkind = \"robot\"\nfile = \"FILE\"\n[[tasks]]\nname = \"t\"\nsteps = 5\ntime_step = 0.01\n";

#[test]
fn escape_sequences_reached_the_terminal() {
    let title = "title = \"red \\u001b[31m, a bell \\u0007, backwards \\u202e, \\u009b2J\"\n\n[model]";
    let text = edited(TWO_MASS, "title = \"Two small masses meet a wall of uncertain position\"\n\n[model]", title);
    let folder = Folder::with_task(text);
    let is_command = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
    for words in [vec!["evaluate"], vec!["evaluate", "--out", "out"], vec!["check"]] {
        let run = folder.run(&[&words[..], &["task.toml"]].concat());
        assert!(run.code.is_some_and(|code| code < 2) && run.stdout.contains("red \u{fffd}[31m"), "{run:?}");
        assert!(!run.stdout.contains(is_command) && !run.stderr.contains(is_command), "{run:?}");
    }
    // In messages too, of files and of folders.
    let shown = folder.run(&["show", "out"]);
    assert!(shown.stdout.contains("red \u{fffd}[31m") && !shown.stdout.contains(is_command), "{shown:?}");
    let wrong = Folder::with_task("\"\\u001b[2Jkey\" = 1\n");
    let run = wrong.run(&["evaluate", "task.toml"]);
    assert!(run.code == Some(2) && !run.stderr.contains(is_command), "{run:?}");
}

#[cfg(unix)]
#[test]
fn a_pipe_in_place_of_a_robot_file_was_waited_for() {
    let folder = Folder::with_task(ROBOT.replace("FILE", "pipe.urdf"));
    let made = std::process::Command::new("mkfifo").arg(folder.path("pipe.urdf")).status().unwrap();
    assert!(made.success());
    let run = folder.run(&["evaluate", "task.toml"]);
    assert!(run.error().contains("it is not a regular file but a pipe, socket or device"), "{run:?}");
}

#[test]
fn lines_of_any_file_were_shown() {
    let folder = Folder::with_task(ROBOT.replace("FILE", "../secrets/passwd"));
    std::fs::create_dir(folder.path("secrets")).unwrap();
    std::fs::create_dir(folder.path("tasks")).unwrap();
    std::fs::rename(folder.path("task.toml"), folder.path("tasks/task.toml")).unwrap();
    std::fs::write(folder.path("secrets/passwd"), "root:very secret:0\n<robot").unwrap();
    let run = folder.run(&["evaluate", "tasks/task.toml"]);
    assert!(run.code == Some(2) && !run.stderr.contains("very secret"), "{run:?}");
}

#[cfg(unix)]
#[test]
fn the_whole_file_system_was_a_package_root() {
    let folder =
        Folder::with_task(ROBOT.replace("FILE", "arm.urdf\"\npackage_roots = [\"../../../../../../..\"]\n#\""));
    std::fs::write(folder.path("arm.urdf"), "<robot name=\"r\"><link name=\"l\"/></robot>").unwrap();
    let run = folder.run(&["evaluate", "task.toml"]);
    assert!(run.error().contains("is the whole file system"), "{run:?}");
}

#[test]
fn a_task_of_the_name_of_a_formula_was_computed_by_spreadsheets() {
    let folder = Folder::with_task(edited(TWO_MASS, "name = \"press\"", "name = \"=1+1\""));
    let run = folder.run(&["sweep", "task.toml", "--grid", "k1=60,70", "--out", "out"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let table = std::fs::read_to_string(folder.path("out/table.csv")).unwrap();
    let starts = |cell: &str| cell.trim_matches('"').starts_with(['=', '+', '@']);
    assert!(table.contains("'=1+1") && !table.lines().flat_map(|line| line.split(',')).any(starts), "{table}");
}
