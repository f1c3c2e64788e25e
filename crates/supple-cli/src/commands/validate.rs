use std::process::{Command, Stdio};

use clap::ValueEnum;
use supple_study::{Folder, StudyResult};

use crate::arguments::{AtArgument, ValidateOptions};
use crate::failure::Failure;
use crate::outcome::Outcome;

/// Python packages that it requires, and how to install each.
const PACKAGES: [(&str, &str); 2] =
    [("supple", "run `pip install .` in a copy of supple's source"), ("mujoco", "run `pip install mujoco`")];

/// `supple validate DIR`: runs `python3 -m supple validate`.
pub fn validate(options: &ValidateOptions) -> Result<Outcome, Failure> {
    let folder = Folder::load(&options.folder)?;
    let found = match &folder.result {
        StudyResult::Design(_) => AtArgument::Optimum,
        StudyResult::Evaluate(_) => AtArgument::Start,
        other => {
            let message = "`supple validate` requires a result of `design` or `evaluate`";
            let (path, kind) = (options.folder.display(), other.kind());
            return Err(Failure::usage(format!("{path} holds a result of `{kind}`; {message}")));
        }
    };
    let at = options.at.unwrap_or(found);
    if at == AtArgument::Optimum && found == AtArgument::Start {
        let message = "an evaluation has one design, its start";
        return Err(Failure::usage(format!("--at optimum: {message}")));
    }
    has_packages(&options.python)?;
    let mut command = Command::new(&options.python);
    command.args(["-m", "supple", "validate"]).arg(&options.folder);
    command.args(["--rollouts", &options.rollouts.to_string(), "--seed", &options.seed.to_string()]);
    command.args(["--contact", &name(options.contact), "--at", &name(at)]);
    options.vary.iter().for_each(|factor| {
        command.args(["--vary", factor]);
    });
    if options.json {
        command.arg("--json");
    }
    let status = command.status().map_err(|error| missing(&options.python, &error))?;
    match status.code() {
        Some(0) => Ok(Outcome::Success),
        Some(1) => Ok(Outcome::Shortfall),
        _ => Err(Failure::usage(format!("{} ended without a result; see its message above", options.python))),
    }
}

/// # Errors
/// If there is no such Python, or it lacks a package.
fn has_packages(python: &str) -> Result<(), Failure> {
    for (package, advice) in PACKAGES {
        let probe = format!("import importlib.util as u, sys; sys.exit(10 * (u.find_spec('{package}') is None))");
        let status = Command::new(python).args(["-c", &probe]).stdout(Stdio::null()).stderr(Stdio::null()).status();
        if !status.map_err(|error| missing(python, &error))?.success() {
            let message = format!("supple validate runs {python}, which has no package `{package}`: {advice}");
            return Err(Failure::usage(format!("{message}, or name another Python with --python")));
        }
    }
    Ok(())
}

fn missing(python: &str, error: &std::io::Error) -> Failure {
    let message = format!("supple validate runs Python, and `{python}` cannot be run: {error}");
    Failure::usage(format!(
        "{message}; install Python 3.10 or later with the packages supple and mujoco, or name it with --python"
    ))
}

fn name(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}
