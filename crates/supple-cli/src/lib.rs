//! The program `supple`, which designs compliant robots that need little information to be controlled. The binary calls
//! [`run`]; for a library, see the crate `supple`.

mod arguments;
mod catalogue;
mod commands;
mod contacts;
mod failure;
mod informations;
mod outcome;
mod output;
mod pages;
mod present;
mod progress;
mod split;
mod tables;
mod template;
mod terms;
mod trust;

use std::process::ExitCode;

use arguments::{Arguments, Command};
use failure::Failure;
use outcome::Outcome;

/// Runs the program with the arguments of the process.
#[must_use]
pub fn run() -> ExitCode {
    match conduct(Arguments::of_process()) {
        Ok(Outcome::Success) => ExitCode::SUCCESS,
        Ok(Outcome::Shortfall) => ExitCode::from(1),
        Err(failure) => {
            failure.report();
            ExitCode::from(failure.exit_code())
        }
    }
}

fn conduct(arguments: Arguments) -> Result<Outcome, Failure> {
    arguments.common.apply()?;
    match arguments.command {
        Command::Study(study) => commands::conduct(study.asks()),
        Command::Check(options) => commands::check(&options),
        Command::Explore(options) => commands::explore(&options),
        Command::StudyFile(options) => commands::study(&options),
        Command::Report(options) => commands::report(&options),
        Command::Plot(options) => commands::plot(&options),
        Command::Show(options) => commands::show(&options),
        Command::Export(options) => commands::export(&options),
        Command::Validate(options) => commands::validate(&options),
        Command::Robot(options) => commands::robot(&options),
        Command::Schema => commands::schema(),
        Command::New(options) => commands::new(&options),
        Command::Completions { shell } => commands::completions(shell),
    }
}
