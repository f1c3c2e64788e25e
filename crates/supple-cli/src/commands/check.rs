use supple::check::check as compare;

use crate::Outcome;
use supple_study::{About, LoadedTask};

use crate::arguments::CheckOptions;
use crate::failure::Failure;
use crate::output::{print_json, print_text};
use crate::pages::check_page;
use crate::progress::{Stopping, watched};

/// `supple check TASK`
pub fn check(options: &CheckOptions) -> Result<Outcome, Failure> {
    let LoadedTask { problem, phi, .. } = options.task.load()?;
    let report = watched(Stopping::Now, |_| compare(&problem, &phi))?;
    if options.json {
        print_json(&report)?;
    } else {
        print_text(&check_page(&About::of(&problem), &report))?;
    }
    Ok(if report.passed { Outcome::Success } else { Outcome::Shortfall })
}
