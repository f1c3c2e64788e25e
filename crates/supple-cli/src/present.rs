use std::path::Path;

use supple_study::{Folder, JOURNAL, Made, StudyError, StudyResult, forget, kept_parts};

use crate::Outcome;
use crate::arguments::Output;
use crate::failure::Failure;
use crate::output::{print_text, warn};
use crate::pages::result_page;

/// Numbers that are not finite of which a warning names so many.
const NAMED: usize = 3;

/// Keeps a result in a folder, where one is given, and prints its page or its JSON. The outcome is that of its numbers: success
/// only where all of them are finite.
pub fn present(result: &StudyResult, made: &Made, output: &Output) -> Result<Outcome, Failure> {
    let folder = output.out.as_deref();
    if let Some(folder) = folder {
        Folder::save(folder, made, result)?;
    }
    print(result, made, folder, output.json)
}

/// Presents what a study found whose journal keeps its finished parts; `stopped` says how far it is where it was stopped. The
/// journal of a complete one is removed: its result says it all.
pub fn present_resumable(
    result: &StudyResult,
    made: &Made,
    output: &Output,
    stopped: Option<String>,
) -> Result<Outcome, Failure> {
    let outcome = match stopped {
        Some(text) => {
            let resumes = if output.out.is_some() { "resumes" } else { "resumes where it has --out" };
            warn(&format!("{text}; the same command {resumes}"));
            Outcome::Shortfall
        }
        None => Outcome::Success,
    };
    let folder = output.out.as_deref();
    if let Some(folder) = folder {
        Folder::conclude(folder, made, result)?;
    }
    Ok(outcome.and(print(result, made, folder, output.json)?))
}

/// What a study found; none where it was stopped before there was a result, but its journal keeps parts to resume from.
pub fn found_or_kept<T>(found: Result<T, StudyError>, output: &Output) -> Result<Option<T>, Failure> {
    match (found, &output.out) {
        (Err(StudyError::Stopped), Some(folder)) => {
            let parts = kept_parts(folder)?;
            if parts == 0 {
                forget(folder)?;
                return Err(StudyError::Stopped.into());
            }
            let (journal, s) = (folder.join(JOURNAL), if parts == 1 { "" } else { "s" });
            warn(&format!(
                "stopped before there was a result; {parts} finished part{s} of the study: stored in {}; the same command \
                 resumes",
                journal.display()
            ));
            Ok(None)
        }
        (found, _) => Ok(Some(found?)),
    }
}

/// Prints the page of a result, which may be kept in a folder, or its JSON; the outcome is that of its numbers.
pub fn print(result: &StudyResult, made: &Made, folder: Option<&Path>, json: bool) -> Result<Outcome, Failure> {
    if json {
        let text = result.json()?;
        // The lines of a table end themselves.
        let end = if matches!(result, StudyResult::Sweep(_)) { "" } else { "\n" };
        print_text(&(text + end))?;
    } else {
        print_text(&result_page(&made.about, result, folder))?;
    }
    Ok(judge(result))
}

/// Whether all numbers of a result are finite; a warning names the first that are not.
fn judge(result: &StudyResult) -> Outcome {
    let broken = result.not_finite();
    if broken.is_empty() {
        return Outcome::Success;
    }
    let named: Vec<String> = broken.iter().take(NAMED).map(ToString::to_string).collect();
    let more = match broken.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(", and so are {more} more of its numbers"),
    };
    warn(&format!("the result is broken: {}{more}", named.join(", ")));
    Outcome::Shortfall
}
