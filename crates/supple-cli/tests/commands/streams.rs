use crate::common::{Folder, Run, TWO_MASS, edited};

/// A run whose reader has hung up.
fn unread(arguments: &[&str], folder: &Folder) -> Run {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(arguments).current_dir(folder.path(""));
    let pipe = std::process::Stdio::piped;
    let mut child = command.stdout(pipe()).stderr(pipe()).spawn().unwrap();
    drop(child.stdout.take());
    Run::of(&child.wait_with_output().unwrap())
}

#[test]
fn a_reader_that_hangs_up_is_no_failure() {
    let folder = Folder::with_task(TWO_MASS);
    for arguments in [
        &["evaluate", "task.toml"][..],
        &["evaluate", "task.toml", "--json", "--gradient", "both"],
        &["design", "task.toml", "--starts", "1", "--json"],
        &["schema"],
        &["completions", "bash"],
    ] {
        assert_eq!(unread(arguments, &folder).quiet(), (Some(0), ""), "{arguments:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure() {
    let folder = Folder::with_task(TWO_MASS);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(["evaluate", "task.toml", "--json"]).current_dir(folder.path(""));
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let run = Run::of(&command.stdout(full).output().unwrap());
    assert!(run.error().contains("standard output: "), "{run:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn an_error_that_cannot_be_told_is_still_one() {
    let folder = Folder::with_task(TWO_MASS.replace("steps = ", "stesp = "));
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(["evaluate", "task.toml"]).current_dir(folder.path(""));
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    assert_eq!(command.stderr(full).output().unwrap().status.code(), Some(2));
}

#[cfg(unix)]
#[test]
fn an_interrupted_design_prints_the_best_until_then() {
    let folder = Folder::with_task(TWO_MASS);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    // Enough starts to last for a while.
    let starts = (200 * std::thread::available_parallelism().unwrap().get()).to_string();
    command.args(["design", "task.toml", "--starts", &starts, "--json", "--out", "out"]).current_dir(folder.path(""));
    let pipe = std::process::Stdio::piped;
    let child = command.stdout(pipe()).stderr(pipe()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(700));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let mut run = Run::of(&child.wait_with_output().unwrap());
    let said = std::mem::take(&mut run.stderr);
    assert!(
        said.starts_with("warning: stopped: ") && said.ends_with(" starts had finished; the same command resumes\n"),
        "{said}"
    );
    let found = run.json(1);
    assert_eq!(found["status"], "stopped");
    assert_eq!(found["optimum"]["feasible"], true);
    let file: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path("out/result.json")).unwrap()).unwrap();
    assert_eq!(file["result"], found);
}

/// A start that is interrupted has not finished, even if it does not meet its cost limit yet and so has another status.
#[cfg(unix)]
#[test]
fn starts_that_did_not_finish_are_not_counted() {
    let long = edited(TWO_MASS, "steps = 125", "steps = 20000");
    let folder = Folder::with_task(edited(&long, "bound = 25.0", "bound = 1.0"));
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(["design", "task.toml", "--starts", "1", "--json", "--out", "out"]).current_dir(folder.path(""));
    let pipe = std::process::Stdio::piped;
    let child = command.stdout(pipe()).stderr(pipe()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let said = Run::of(&child.wait_with_output().unwrap()).stderr;
    // A slow machine may not even have the first plan by then.
    let first = said.contains("none of 1 starts had finished; the same command begins again");
    assert!(first || said.contains("stopped"), "{said}");
    assert!(!said.contains("1 of 1"), "{said}");
}
