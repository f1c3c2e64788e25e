use std::path::Path;

use supple_study::{About, NotFinite, StudyResult};

use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_text, warn};
use crate::pages::result_page;

/// How many non-finite numbers a warning lists.
const NAMED: usize = 3;

/// Prints the page of a result, which may be stored in a folder, or its JSON; checks that all numbers are finite.
pub fn print(result: &StudyResult, about: &About, folder: Option<&Path>, json: bool) -> Result<Outcome, Failure> {
    if json {
        let text = result.json()?;
        // A sweep is printed as JSON lines, which already end with a line break.
        let end = if matches!(result, StudyResult::Sweep(_)) { "" } else { "\n" };
        print_text(&(text + end))?;
    } else {
        print_text(&result_page(about, result, folder))?;
    }
    Ok(judge(&result.not_finite()))
}

/// Success if `broken`, the list of non-finite numbers, is empty; otherwise warns and lists the first of them.
pub fn judge(broken: &[NotFinite]) -> Outcome {
    if broken.is_empty() {
        return Outcome::Success;
    }
    let named: Vec<String> = broken.iter().take(NAMED).map(ToString::to_string).collect();
    let more = match broken.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(", and so are {more} more of its numbers"),
    };
    warn(&format!("the result is invalid: {}{more}", named.join(", ")));
    Outcome::Shortfall
}
