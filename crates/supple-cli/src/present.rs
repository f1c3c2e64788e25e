use std::path::Path;

use supple_study::{Folder, Made, StudyResult};

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

/// Warns of a study that was stopped; how its command ends then.
pub fn tell(stopped: Option<String>) -> Outcome {
    match stopped {
        Some(text) => {
            warn(&text);
            Outcome::Shortfall
        }
        None => Outcome::Success,
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
