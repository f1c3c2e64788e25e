use std::path::PathBuf;

use supple_explore::Explorer;
use supple_study::{Folder, LoadedTask, StudyResult};

use crate::arguments::{ExploreOptions, set};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output::{note, print_text, warn};
use crate::progress::end_when_asked;

/// `supple explore TASK|DIR`
pub fn explore(options: &ExploreOptions) -> Result<Outcome, Failure> {
    let (mut loaded, file) = load(options)?;
    set(&mut loaded, &options.set)?;
    loaded.problem.warnings.iter().for_each(|warning| warn(warning));
    let explorer = Explorer::open(loaded, file, options.port)?;
    let address = explorer.address();
    print_text(&format!("{address}\n"))?;
    if !options.no_browser
        && let Err(error) = open::that_detached(&address)
    {
        warn(&format!("no browser could be started ({error}): open the address above in one"));
    }
    end_when_asked();
    note("Ctrl-C ends the explorer.");
    explorer.serve();
    Ok(Outcome::Success)
}

/// Loads a task file, which is then watched for changes; or the task of a stored result, at its design.
fn load(options: &ExploreOptions) -> Result<(LoadedTask, Option<PathBuf>), Failure> {
    let path = &options.task;
    if !path.is_dir() {
        return Ok((LoadedTask::load(path)?, Some(path.clone())));
    }
    let folder = Folder::load(path)?;
    let at = match &folder.result {
        StudyResult::Design(report) => Some(&report.optimum),
        StudyResult::Evaluate(report) => Some(&report.evaluation),
        _ => None,
    };
    let sources = &folder.made.sources;
    let loaded = match at {
        Some(at) => LoadedTask::restore(sources)?.setting(&at.parameters)?.knowing(at),
        None => LoadedTask::restore(sources)?,
    };
    Ok((loaded, None))
}
