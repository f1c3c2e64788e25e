use std::path::Path;

use supple_study::{About, NotFinite, StudyResult};

use crate::Outcome;
use crate::failure::Failure;
use crate::output::{print_text, warn};
use crate::pages::result_page;

/// Numbers that are not finite of which a warning names so many.
const NAMED: usize = 3;

/// Prints the page of a result, which may be kept in a folder, or its JSON; the outcome is that of its numbers.
pub fn print(result: &StudyResult, about: &About, folder: Option<&Path>, json: bool) -> Result<Outcome, Failure> {
    if json {
        let text = result.json()?;
        // The lines of a table end themselves.
        let end = if matches!(result, StudyResult::Sweep(_)) { "" } else { "\n" };
        print_text(&(text + end))?;
    } else {
        print_text(&result_page(about, result, folder))?;
    }
    Ok(judge(&result.not_finite()))
}

/// Whether all numbers of a result are finite, given those that are not; a warning names the first of them.
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
