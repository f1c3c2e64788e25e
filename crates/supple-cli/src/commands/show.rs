use supple_study::{Folder, StudyResult};

use crate::arguments::ShowOptions;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{print_text, warn_changed};
use crate::present::print;

/// `supple show DIR`
pub fn show(options: &ShowOptions) -> Result<Outcome, Failure> {
    let folder = Folder::load(&options.folder)?;
    warn_changed(&folder.path);
    let mut outcome = Outcome::Success;
    if let StudyResult::Study(study) = &folder.result
        && !options.json
    {
        for step in &study.steps {
            let step = Folder::load(&options.folder.join(step))?;
            warn_changed(&step.path);
            outcome = outcome.and(print(&step.result, &step.made.about, Some(&step.path), false)?);
            print_text("\n")?;
        }
    }
    Ok(outcome.and(print(&folder.result, &folder.made.about, Some(&folder.path), options.json)?))
}
