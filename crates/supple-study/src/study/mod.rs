//! Studies as values: what to do, to which task, with which options.
//!
//! The program, its study files and Python make [`Study`] values, and only [`Work::run`] executes them: [`Study::run`] with
//! the task file that it names. A result keeps the value that it was made from.

mod units;
mod words;

use std::path::Path;

use serde::{Deserialize, Serialize};
use supple::Named;
use supple::design::DesignSettings;

use crate::bound::BoundOptions;
use crate::design::check_designable;
use crate::evaluate::EvaluateOptions;
use crate::pareto::{ParetoOptions, check_bounds};
use crate::robustness::RobustnessOptions;
use crate::sensors::SensorsOptions;
use crate::sweep::SweepOptions;
use crate::trace::TraceOptions;
use crate::{
    LoadedTask, OWN_MODEL, StudyError, StudyResult, Watch, bound, design, evaluate, pareto, robustness, sensors, sweep,
    trace,
};
pub use units::{Found, Unit, Units};

/// What to do, to which task.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Path of the task file, as it was given; [`OWN_MODEL`] where there is none.
    pub task: String,
    /// Parameters that differ from the task's initial values.
    #[serde(default, skip_serializing_if = "is_empty")]
    pub set: Named,
    /// What to do.
    #[serde(flatten)]
    pub work: Work,
}

/// What to do to a task, with all options.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "run", content = "options", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Work {
    /// Search for the best design.
    Design(Box<DesignSettings>),
    /// Evaluate one design.
    Evaluate(EvaluateOptions),
    /// Evaluate every design of a grid.
    Sweep(SweepOptions),
    /// Compare designs as a noise grows.
    Robustness(RobustnessOptions),
    /// Trace the front of information against cost.
    Pareto(ParetoOptions),
    /// Record the paths of searches.
    Trace(TraceOptions),
    /// Choose sensors.
    Sensors(SensorsOptions),
    /// Bound the information from below.
    Bound(BoundOptions),
}

impl Study {
    /// This work on a task, as its parameters are.
    #[must_use]
    pub fn of(task: &LoadedTask, work: Work) -> Self {
        let path = task.sources.first().map_or(OWN_MODEL, |source| &source.path).to_owned();
        let parameters = &task.problem.parameters;
        let values = Named::new(parameters, &task.phi).0.into_iter().zip(parameters.initial());
        let set = values.filter(|((_, value), initial)| value != initial).map(|(named, _)| named).collect();
        Self { task: path, set: Named(set), work }
    }

    /// Does it: reads the task file, from the working folder if its path is relative, and does the work with the
    /// parameters as set.
    ///
    /// # Errors
    /// As of [`LoadedTask::load`] and [`Work::run`].
    ///
    /// ```
    /// use supple_study::Watch;
    /// use supple_study::study::Study;
    /// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
    ///
    /// // As it stands in a result folder, or came from another machine.
    /// let text = r#"{ "task": "two_mass.toml", "set": { "k1": 300.0 }, "run": "evaluate", "options": { "rollouts": 0 } }"#;
    /// # let text = &text.replace("two_mass.toml", file);
    /// let study: Study = serde_json::from_str(text)?;
    /// let result = study.run(None, Watch::default())?;
    /// assert!(serde_json::to_string(&result)?.contains("\"k1\":300.0"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run(&self, folder: Option<&Path>, watch: Watch) -> Result<StudyResult, StudyError> {
        let task = LoadedTask::load(Path::new(&self.task))?.setting(&self.set)?;
        self.work.run(&task, folder, watch)
    }
}

impl Work {
    /// The command that does it: `design`, `evaluate`...
    #[must_use]
    pub fn command(&self) -> &'static str {
        match self {
            Self::Design(_) => "design",
            Self::Evaluate(_) => "evaluate",
            Self::Sweep(_) => "sweep",
            Self::Robustness(_) => "robustness",
            Self::Pareto(_) => "pareto",
            Self::Trace(_) => "trace",
            Self::Sensors(_) => "sensors",
            Self::Bound(_) => "bound",
        }
    }

    /// Seed of everything random; 0 where nothing is.
    #[must_use]
    pub fn seed(&self) -> u64 {
        match self {
            Self::Design(settings) => settings.seed,
            Self::Evaluate(options) => options.seed,
            Self::Sweep(options) => options.seed,
            Self::Robustness(options) => options.seed,
            Self::Pareto(options) => options.seed,
            Self::Trace(options) => options.seed,
            Self::Sensors(_) | Self::Bound(_) => 0,
        }
    }

    /// Checks what can be known of the work before it is begun.
    ///
    /// # Errors
    /// Where an option does not fit the task.
    pub fn check(&self, task: &LoadedTask) -> Result<(), StudyError> {
        match self {
            Self::Design(_) | Self::Trace(_) => check_designable(task),
            Self::Pareto(_) => check_designable(task).and_then(|()| check_bounds(task).map(drop)),
            Self::Robustness(options) => robustness::check(task, options).map(drop),
            Self::Evaluate(_) | Self::Sweep(_) | Self::Sensors(_) | Self::Bound(_) => Ok(()),
        }
    }

    /// Does the work. Where a folder is given, a journal in it keeps the finished parts of long work, and the same work
    /// resumes from it; the result itself is for `Folder::conclude` to keep.
    ///
    /// # Errors
    /// Where an option is wrong or does not fit the task, nothing can be computed, the journal is of another study or
    /// cannot be written, or the work was stopped before there was a result.
    pub fn run(&self, task: &LoadedTask, folder: Option<&Path>, watch: Watch) -> Result<StudyResult, StudyError> {
        self.make(task, folder, watch).map_err(|error| task.blame(error))
    }

    fn make(&self, task: &LoadedTask, folder: Option<&Path>, watch: Watch) -> Result<StudyResult, StudyError> {
        Ok(match self {
            Self::Design(settings) => StudyResult::Design(Box::new(design::run(task, settings, folder, watch)?)),
            Self::Evaluate(options) => StudyResult::Evaluate(Box::new(evaluate::run(task, options, watch)?)),
            Self::Sweep(options) => StudyResult::Sweep(Box::new(sweep::run(task, options, folder, watch)?)),
            Self::Robustness(options) => {
                StudyResult::Robustness(Box::new(robustness::run(task, options, folder, watch)?))
            }
            Self::Pareto(options) => StudyResult::Pareto(Box::new(pareto::run(task, options, folder, watch)?)),
            Self::Trace(options) => StudyResult::Trace(Box::new(trace::run(task, options, folder, watch)?)),
            Self::Sensors(options) => StudyResult::Sensors(Box::new(sensors::run(task, options, watch)?)),
            Self::Bound(options) => StudyResult::Bound(Box::new(bound::run(task, options, watch)?)),
        })
    }
}

fn is_empty(set: &Named) -> bool {
    set.0.is_empty()
}

/// Does work on threads of its own where their number is given, or else on those of the caller.
///
/// # Errors
/// Where there cannot be so many threads, or of the work.
///
/// ```
/// use supple_study::study::on_threads;
///
/// let threads = on_threads(Some(2), || Ok(rayon::current_num_threads()))?;
/// assert_eq!(threads, 2);
/// # Ok::<(), supple_study::StudyError>(())
/// ```
pub fn on_threads<T: Send>(
    jobs: Option<usize>,
    work: impl FnOnce() -> Result<T, StudyError> + Send,
) -> Result<T, StudyError> {
    let Some(jobs) = jobs else { return work() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build();
    pool.map_err(|error| StudyError::usage(format!("jobs = {jobs}: {error}")))?.install(work)
}
