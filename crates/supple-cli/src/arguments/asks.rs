use supple_study::LoadedTask;
use supple_study::study::Work;

use super::{Output, TaskArguments};
use crate::failure::Failure;

/// The arguments of a command that does a study.
pub trait Asks {
    /// The task.
    fn task(&self) -> &TaskArguments;

    /// Where the result goes.
    fn output(&self) -> &Output;

    /// What to do to the task.
    fn work(&self, task: &LoadedTask) -> Result<Work, Failure>;

    /// How many threads work, where that is not left to the program.
    fn jobs(&self) -> Option<usize> {
        None
    }
}
