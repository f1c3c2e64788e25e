//! One file per command.

mod bound;
mod check;
mod conduct;
mod design;
mod evaluate;
mod explore;
mod export;
mod new;
mod pareto;
#[cfg(feature = "figures")]
mod plot;
#[cfg(not(feature = "figures"))]
#[path = "plot_absent.rs"]
mod plot;
mod report;
pub mod robot;
mod robustness;
mod sensors;
mod show;
mod study;
mod sweep;
mod trace;
mod validate;

pub use check::check;
pub use conduct::conduct;
pub use explore::explore;
pub use export::export;
pub use new::new;
pub use plot::plot;
pub use report::report;
pub use robot::robot;
pub use show::show;
pub use study::study;
pub use validate::validate;

use clap::CommandFactory;

use crate::arguments::Arguments;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_json, print_text};

/// `supple schema`
pub fn schema() -> Result<Outcome, Failure> {
    print_json(&supple_file::json_schema())?;
    Ok(Outcome::Success)
}

/// `supple completions SHELL`
pub fn completions(shell: clap_complete::Shell) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "supple", &mut script);
    print_text(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Success)
}
