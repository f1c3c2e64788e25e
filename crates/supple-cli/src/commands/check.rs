use supple::check::check as compare;
use supple_study::{About, LoadedTask, StudyError, not_finite};

use crate::arguments::CheckOptions;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_json, print_text};
use crate::pages::check_page;
use crate::present::judge;
use crate::progress::watched;

/// `supple check TASK`
pub fn check(options: &CheckOptions) -> Result<Outcome, Failure> {
    let task = options.task.load()?;
    let LoadedTask { problem, phi, .. } = &task;
    let report = watched(|_| compare(problem, phi)).map_err(|error| task.blame(StudyError::from(error)))?;
    if options.json {
        print_json(&report)?;
    } else {
        print_text(&check_page(&About::of(problem), &report))?;
    }
    let outcome = if report.passed { Outcome::Success } else { Outcome::Shortfall };
    Ok(outcome.and(judge(&not_finite(&report))))
}
