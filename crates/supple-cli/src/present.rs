use std::path::Path;

use supple_study::{Folder, Made, StudyResult};

use crate::arguments::Output;
use crate::failure::Failure;
use crate::output::print_text;
use crate::pages::result_page;

/// Keeps a result in a folder, where one is given, and prints its page or its JSON.
pub fn present(result: &StudyResult, made: &Made, output: &Output) -> Result<(), Failure> {
    let folder = output.out.as_deref();
    if let Some(folder) = folder {
        Folder::save(folder, made, result)?;
    }
    print(result, made, folder, output.json)
}

/// Prints the page of a result, which may be kept in a folder, or its JSON.
pub fn print(result: &StudyResult, made: &Made, folder: Option<&Path>, json: bool) -> Result<(), Failure> {
    if !json {
        return print_text(&result_page(&made.about, result, folder));
    }
    let text = result.json()?;
    // The lines of a table end themselves.
    let end = if matches!(result, StudyResult::Sweep(_)) { "" } else { "\n" };
    print_text(&(text + end))
}
