//! What the tests of the program share.
#![allow(dead_code, clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::Duration;

use serde_json::Value;
use tempfile::TempDir;

/// The small shipped task: one task, two parameters.
pub const TWO_MASS: &str = include_str!("../../../../tasks/two_mass_small.toml");

/// Two linear tasks that use what the small one does not.
pub const LINEAR: &str = include_str!("linear.toml");

/// A file of the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// A text with its one or first `from` replaced.
pub fn edited(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "the file to edit has no `{from}`");
    text.replacen(from, to, 1)
}

/// The costs between which `supple new` sets the limit, with the precise sensor and with the coarsest, in the text of a
/// task.
pub fn costs(text: &str) -> [f64; 2] {
    let line = text.lines().find(|line| line.starts_with("# The least expected cost is ")).unwrap();
    let costs: Vec<f64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
    [costs[0], costs[1]]
}

/// An empty folder to run the program in.
pub struct Folder(TempDir);

impl Folder {
    /// An empty folder.
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A folder with the file `task.toml`.
    pub fn with_task(text: impl AsRef<[u8]>) -> Self {
        let folder = Self::new();
        std::fs::write(folder.path("task.toml"), text).unwrap();
        folder
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The names of what is in the folder, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Runs the program in the folder.
    pub fn run(&self, arguments: &[&str]) -> Run {
        let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_supple"));
        command.args(arguments).current_dir(self.0.path()).timeout(Duration::from_secs(300));
        Run::of(&command.output().unwrap())
    }
}

/// Whether a line says what is being done, and since when: `starts, 1 of 4, 20 s (best 13.45 bits)`.
fn is_progress(line: &str) -> bool {
    let line = line.trim_end();
    let counted = line.split_once(" s (").map_or(line.strip_suffix(" s"), |(counted, _)| Some(counted));
    let seconds = counted.and_then(|counted| counted.rsplit_once(", "));
    seconds.is_some_and(|(what, seconds)| seconds.parse::<u64>().is_ok() && !what.contains(": "))
}

/// How the program ended, and what it said.
#[derive(Debug)]
pub struct Run {
    /// Exit code; none where a signal ended it.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Run {
    /// Of what a process left, without lines of progress, which appear where the machine is busy.
    pub fn of(output: &Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        let told = text(&output.stderr);
        let stderr = told.split_inclusive('\n').filter(|line| !is_progress(line)).collect();
        Self { code: output.status.code(), stdout: text(&output.stdout), stderr }
    }

    /// Exit code and standard output of a run that said nothing on standard error.
    pub fn quiet(&self) -> (Option<i32>, &str) {
        assert_eq!(self.stderr, "");
        (self.code, &self.stdout)
    }

    /// The one JSON object on standard output of a run with an exit code.
    pub fn json(&self, code: i32) -> Value {
        assert_eq!((self.code, self.stderr.as_str()), (Some(code), ""));
        let value: Value = serde_json::from_str(&self.stdout).unwrap();
        assert!(value.is_object());
        value
    }

    /// The error of a run that computed nothing and printed nothing: the first line of standard error.
    pub fn error(&self) -> &str {
        let line = self.stderr.lines().next().unwrap_or_default();
        assert_eq!((self.code, self.stdout.as_str()), (Some(2), ""), "{}", self.stderr);
        assert!(line.starts_with("error: ") && !self.stderr.contains("panicked"), "{}", self.stderr);
        line
    }
}
