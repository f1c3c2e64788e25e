use std::path::PathBuf;

use clap::Args;
use serde::de::DeserializeOwned;
use supple_study::LoadedTask;
use supple_study::study::Work;

use super::task::TaskArguments;
use crate::failure::Failure;

/// Where a result goes.
#[derive(Args, Debug)]
pub struct Output {
    /// Folder for the result, its trajectories, and everything needed to reproduce it
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the result as one JSON object and nothing else
    #[arg(long)]
    pub json: bool,
}

/// What a command that runs a study asks for beside its task: long options on the command line, keys in a study file.
pub trait Ask: Args + DeserializeOwned + std::fmt::Debug {
    /// The work to do on the task.
    fn work(&self, on: &Subject) -> Result<Work, Failure>;

    /// Number of threads; `None` lets the program choose.
    fn jobs(&self) -> Option<usize> {
        None
    }
}

/// What a study is made of.
pub struct Subject<'a> {
    /// The task, with its parameters set.
    pub task: &'a LoadedTask,
    /// The parameters that were set, as `NAME=VALUE`.
    pub set: &'a [String],
    /// Whether the result is kept in a folder.
    pub is_kept: bool,
}

/// Arguments of a command that runs a study.
#[derive(Args, Debug)]
pub struct Asked<A: Args> {
    #[command(flatten)]
    pub task: TaskArguments,
    #[command(flatten)]
    pub ask: A,
    #[command(flatten)]
    pub output: Output,
}

/// Arguments of any command that runs a study.
pub trait Asks {
    /// The task.
    fn task(&self) -> &TaskArguments;

    /// Where the result goes.
    fn output(&self) -> &Output;

    /// The work to do on the task.
    fn work(&self, task: &LoadedTask) -> Result<Work, Failure>;

    /// Number of threads; `None` lets the program choose.
    fn jobs(&self) -> Option<usize>;
}

impl<A: Ask> Asks for Asked<A> {
    fn task(&self) -> &TaskArguments {
        &self.task
    }

    fn output(&self) -> &Output {
        &self.output
    }

    fn work(&self, task: &LoadedTask) -> Result<Work, Failure> {
        self.ask.work(&Subject { task, set: &self.task.set, is_kept: self.output.out.is_some() })
    }

    fn jobs(&self) -> Option<usize> {
        self.ask.jobs()
    }
}
