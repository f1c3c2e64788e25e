//! `supple sweep`: tables, journals, and what interrupts them.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../common/mod.rs"]
mod common;
#[cfg(unix)]
mod disk;
#[cfg(unix)]
mod interrupted;
mod refused;
mod table;

use std::path::Path;
use std::process::{Child, Command, Stdio};

use common::{Folder, repository};

/// A grid of 200 points of `two_mass.toml`.
const GRID: [&str; 4] = ["--grid", "k1=300:600:5", "--grid", "k2=log:100:600:40"];

/// A shipped task as `task.toml`.
fn two_mass() -> Folder {
    Folder::with_task(std::fs::read(repository("tasks/two_mass.toml")).unwrap())
}

/// Arguments of a sweep of `task.toml`.
fn sweep<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["sweep", "task.toml"], more].concat()
}

/// Starts the program in a folder, its output thrown away but for standard error.
fn start(folder: &Folder, arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple"));
    command.args(arguments).current_dir(folder.path("")).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Waits until a file is there.
fn wait_for(path: &Path) {
    for _ in 0..2000 {
        if path.exists() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("{} does not exist after 10 s", path.display());
}

/// The tables of a folder.
fn tables(folder: &Folder, out: &str) -> [Vec<u8>; 2] {
    ["table.csv", "table.jsonl"].map(|name| std::fs::read(folder.path(out).join(name)).unwrap())
}
