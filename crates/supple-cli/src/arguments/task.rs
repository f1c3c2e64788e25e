use std::path::{Path, PathBuf};

use clap::Args;
use supple_study::{Folder, LoadedTask, StudyError};

use crate::failure::Failure;
use crate::output::warn;

/// A task file, and parameters to set in it.
#[derive(Args, Debug)]
pub struct TaskArguments {
    /// Task file
    pub task: PathBuf,
    /// Start at the design in the folder of a result of `design` (the optimum) or `evaluate`, instead of initial values
    ///
    /// Parameters of the task that the result does not have keep their initial values; --set overrides them.
    #[arg(long, value_name = "DIR")]
    pub from: Option<PathBuf>,
    /// Set a parameter; may be repeated, and the last value of a parameter holds
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Print every warning instead of one line per kind
    #[arg(long)]
    pub verbose: bool,
}

impl TaskArguments {
    /// Loads the task with its parameters set; prints warnings on standard error.
    pub fn load(&self) -> Result<LoadedTask, Failure> {
        let loaded = self.read()?;
        self.warn(&loaded);
        Ok(loaded)
    }

    /// The same task, whose plans start also from those of the design that it starts at.
    pub fn knowing(&self, loaded: LoadedTask) -> Result<LoadedTask, Failure> {
        let Some(from) = &self.from else { return Ok(loaded) };
        let folder = Folder::load(from)?;
        Ok(loaded.knowing(folder.design()?))
    }

    /// Loads the task with its parameters set.
    pub fn read(&self) -> Result<LoadedTask, Failure> {
        self.read_from(self.from.as_deref())
    }

    /// Loads the task with its parameters set, except for the design of a result that need not be there yet.
    pub fn read_alone(&self) -> Result<LoadedTask, Failure> {
        self.read_from(None)
    }

    fn read_from(&self, from: Option<&Path>) -> Result<LoadedTask, Failure> {
        let mut loaded = LoadedTask::load(&self.task)?;
        if let Some(from) = from {
            let folder = Folder::load(from)?;
            let at = |error: StudyError| Failure::usage(format!("--from {}: {error}", from.display()));
            let stranger = folder.check_kinship(&loaded).map_err(at)?;
            loaded.start_from(&folder.design().map_err(at)?.parameters).map_err(at)?;
            if let Some(stranger) = stranger {
                warn(&format!("the design in {}: {stranger}", from.display()));
            }
            if folder.result.falls_short(&folder.made.about) {
                warn(&format!("the design in {} fell short of what was asked: see `supple show`", from.display()));
            }
        }
        set(&mut loaded, &self.set)?;
        Ok(loaded)
    }

    /// Prints the task's warnings on standard error.
    pub fn warn(&self, loaded: &LoadedTask) {
        let problem = &loaded.problem;
        let warnings = if self.verbose { &problem.every_warning } else { &problem.warnings };
        warnings.iter().for_each(|warning| warn(warning));
    }
}

/// Sets parameters of a task by `NAME=VALUE`.
pub fn set(loaded: &mut LoadedTask, settings: &[String]) -> Result<(), Failure> {
    for setting in settings {
        let wrong = |what: &str| Failure::usage(format!("--set {setting}: {what}"));
        let (name, value) = setting.split_once('=').ok_or_else(|| wrong("write NAME=VALUE"))?;
        let value: f64 = value.trim().parse().map_err(|_| wrong("the value is not a number"))?;
        let set = loaded.problem.parameters.set(&mut loaded.phi, name.trim(), value);
        set.map_err(|error| wrong(&error.to_string()))?;
        if loaded.problem.is_set_by_all_tasks(name.trim()) {
            return Err(wrong("every task sets this parameter for itself, so that it would change nothing"));
        }
    }
    Ok(())
}
