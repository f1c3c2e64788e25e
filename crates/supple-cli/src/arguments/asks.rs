use supple_study::LoadedTask;
use supple_study::study::Work;

use super::{Output, TaskArguments};
use crate::failure::Failure;

/// Arguments of a command that runs a study.
pub trait Asks {
    /// The task.
    fn task(&self) -> &TaskArguments;

    /// Where the result goes.
    fn output(&self) -> &Output;

    /// The work to do on the task.
    fn work(&self, task: &LoadedTask) -> Result<Work, Failure>;

    /// Number of threads; `None` lets the program choose.
    fn jobs(&self) -> Option<usize> {
        None
    }
}
