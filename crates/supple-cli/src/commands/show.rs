use supple_study::{Folder, StudyResult};

use crate::Outcome;
use crate::arguments::ShowOptions;
use crate::failure::Failure;
use crate::output::{print_json, print_text};
use crate::pages::result_page;

/// `supple show DIR`
pub fn show(options: &ShowOptions) -> Result<Outcome, Failure> {
    let folder = Folder::load(&options.folder)?;
    if options.json {
        match &folder.result {
            StudyResult::Sweep(sweep) => print_text(&sweep.table.to_jsonl())?,
            StudyResult::Design(result) => print_json(result)?,
            StudyResult::Evaluate(result) => print_json(&result.evaluation)?,
            StudyResult::Robustness(result) => print_json(result)?,
            StudyResult::Pareto(result) => print_json(result)?,
            StudyResult::Trace(result) => print_json(result)?,
            StudyResult::Study(result) => print_json(result)?,
        }
        return Ok(Outcome::Success);
    }
    if let StudyResult::Study(study) = &folder.result {
        for step in &study.steps {
            let step = Folder::load(&options.folder.join(step))?;
            print_text(&format!("{}\n", result_page(&step.made.about, &step.result, Some(&step.path))))?;
        }
    }
    print_text(&result_page(&folder.made.about, &folder.result, Some(&folder.path)))?;
    Ok(Outcome::Success)
}
