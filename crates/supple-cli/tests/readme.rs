//! The first command of README.md prints what is shown there.

use std::error::Error;
use std::process::Command;

#[path = "../../supple/tests/common/same_text.rs"]
mod same_text;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");

#[test]
fn the_first_command_prints_what_is_shown() -> Result<(), Box<dyn Error>> {
    let readme = std::fs::read_to_string(format!("{ROOT}README.md"))?;
    let command = readme.split("```sh\ncargo run --release -- ").nth(1).and_then(|rest| rest.lines().next());
    let arguments: Vec<&str> = command.ok_or("README.md has no first command")?.split_whitespace().collect();
    let shown = readme.split("```text\n").nth(1).and_then(|rest| rest.split("```").next());
    let shown = shown.ok_or("README.md does not show what it prints")?;

    let output = Command::new(env!("CARGO_BIN_EXE_supple")).args(arguments).current_dir(ROOT).output()?;
    assert!(output.status.success());
    same_text::assert_same_text(&without_effort(shown), &without_effort(std::str::from_utf8(&output.stdout)?));
    Ok(())
}

/// Without how many designs were evaluated, and how fast: that depends on the machine.
fn without_effort(page: &str) -> String {
    page.lines()
        .map(|line| line.split_once("designs evaluated in ").map_or(line, |_| ""))
        .collect::<Vec<_>>()
        .join("\n")
}
