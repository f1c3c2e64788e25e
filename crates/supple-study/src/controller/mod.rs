//! The controller of a design, taken from its result to run elsewhere: as C, JSON or arrays of NumPy.
//!
//! # The controller of an evaluation
//!
//! ```
//! use supple_study::controller::{At, CONTROLLER_FORMAT, CSource, ControllerFile, ControllerFormat};
//! use supple_study::controller::ExportedController;
//! use supple_study::evaluate::EvaluateOptions;
//! use supple_study::study::Work;
//! use supple_study::{Folder, LoadedTask, Made, Source, Watch};
//! # let text = r#"
//! #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
//! #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
//! #     [[tasks]]
//! #     name = "hold"
//! #     steps = 20
//! #     time_step = 0.1
//! #     initial_state = [1.0]
//! #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
//! #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
//! # "#;
//! # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
//!
//! // The task of the front page.
//! let task = LoadedTask::restore(&[source], &[])?;
//! let work = Work::Evaluate(EvaluateOptions { trajectories: true, ..Default::default() });
//! let result = work.run(&task, None, Watch::default())?;
//! let folder = Folder { path: "hold".into(), made: Made::of(&task, work), result };
//! let exported = ExportedController::of(&folder, Some(&task), None, None)?;
//! let at_start = ExportedController::of(&folder, Some(&task), None, Some(At::Start));
//! assert!(at_start.is_err(), "only results of design searches hold several designs");
//!
//! let texts = CSource::of(&exported, "hold.h")?;
//! assert!(texts.source.contains(r#"#include "hold.h""#));
//! let file = ControllerFile::of(&exported);
//! assert_eq!((file.format, file.task.as_str()), (CONTROLLER_FORMAT, "hold"));
//! let out = tempfile::tempdir()?;
//! let written = exported.write(ControllerFormat::Json, &out.path().join("hold.json"))?;
//! assert_eq!(written.len(), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::path::{Path, PathBuf};

use supple::plan::PlanStatus;
use supple::simulate::{MonteCarlo, Rollouts};
use supple::{Channels, Controller, Evaluation, Matrices, Named, Task, Trajectory, TrajectoryReport, Trust};

use crate::{Folder, LoadedTask, OWN_MODEL, StudyError, StudyResult, check_writable, write_text};

mod c;
mod file;
mod names;
mod npz;

pub use c::CSource;
pub use file::{CONTROLLER_FORMAT, CONTROLLER_VERSION, ControllerFile};

/// Which design of a result.
///
/// Example: the [module](crate::controller).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum At {
    /// The one that a search started from.
    Start,
    /// The best one.
    Optimum,
}

/// How a controller is written.
///
/// Example: the [module](crate::controller).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ControllerFormat {
    /// A header and a source of C99.
    C,
    /// One JSON object.
    Json,
    /// Arrays that `numpy.load` reads.
    Npz,
}

impl ControllerFormat {
    /// The ending of its files' names.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::C => "c",
            Self::Json => "json",
            Self::Npz => "npz",
        }
    }
}

/// A controller with what it is of.
///
/// Example: the [module](crate::controller).
#[derive(Clone)]
#[non_exhaustive]
pub struct ExportedController {
    /// The controller.
    pub controller: Controller,
    /// The task.
    pub task: Task,
    /// All parameters of the design, in the order of the task.
    pub phi: Vec<f64>,
    /// The expected cost, with the extended filter that results are about.
    pub expected_cost: f64,
    /// How its plan ended.
    pub status: PlanStatus,
    /// What roll-outs of the result say of the plan; `None` if there were none.
    pub trust: Option<Trust>,
    /// The parameters by name.
    pub parameters: Named,
    /// Time step, s.
    pub time_step: f64,
    /// Names and units of states, controls and measurements.
    pub channels: Channels,
}

impl ExportedController {
    /// That of a task of a result: of the named one, which may be left out where there is one only; at the best design
    /// of a search, where nothing else is said. Its plan and control law are those that the result holds. `loaded` is
    /// the task that the result was made of; the texts that the result keeps are read where it is left out.
    ///
    /// # Errors
    /// Where the result is not of a design or evaluation or has no such task, holds no trajectories, or was made of a
    /// model that is not in its texts and not given.
    pub fn of(
        folder: &Folder,
        loaded: Option<&LoadedTask>,
        task: Option<&str>,
        at: Option<At>,
    ) -> Result<Self, StudyError> {
        let evaluation = evaluation(folder, at)?;
        let valid = || evaluation.tasks.iter().map(|task| task.name.as_str()).collect::<Vec<_>>().join(", ");
        let index = match (task, evaluation.tasks.len()) {
            (None, 1) => 0,
            (None, _) => {
                return Err(StudyError::usage(format!("there are several tasks; choose one with --task: {}", valid())));
            }
            (Some(name), _) => evaluation
                .tasks
                .iter()
                .position(|task| task.name == name)
                .ok_or_else(|| StudyError::usage(format!("no task is named `{name}`; valid names: {}", valid())))?,
        };
        let report = &evaluation.tasks[index];
        let trajectory = report
            .trajectory
            .as_ref()
            .ok_or_else(|| wrong(folder, "has no trajectories; recompute the result with them"))?;
        let restored;
        let loaded = match loaded {
            Some(loaded) => loaded,
            None => {
                restored = restore(folder)?;
                &restored
            }
        };
        let problem = &loaded.problem;
        let mut phi = problem.parameters.initial();
        for (name, value) in &evaluation.parameters.0 {
            problem.parameters.set(&mut phi, name, *value)?;
        }
        let task = problem.tasks.iter().find(|task| task.name == report.name);
        let task = task.ok_or_else(|| wrong(folder, "is not of this task"))?;
        let Law { trajectory, feedforward, feedback } = Law::read(folder, trajectory)?;
        Ok(Self {
            controller: Controller::along(task, &phi, trajectory, feedforward, feedback)?,
            task: task.clone(),
            expected_cost: report.cost.expected,
            status: report.status,
            trust: report.trust.clone(),
            parameters: evaluation.parameters.clone(),
            time_step: task.time_step.resolve(&phi),
            channels: task.system.channels(),
            phi,
        })
    }

    /// Its cost in closed loop with the model, over runs of its own filter.
    ///
    /// # Errors
    /// Where a covariance is indefinite.
    pub fn monte_carlo(&self, rollouts: Rollouts) -> Result<MonteCarlo, StudyError> {
        Ok(self.controller.monte_carlo(&self.task, &self.phi, self.expected_cost, rollouts)?)
    }

    /// The name that its files have where none is given: the task's, of letters, digits and `_`.
    #[must_use]
    pub fn name(&self) -> String {
        names::identifier(&self.task.name)
    }

    /// The controller as one JSON object.
    ///
    /// # Errors
    /// Where it cannot be told in JSON.
    pub fn to_json(&self) -> Result<String, StudyError> {
        let text = serde_json::to_string(&ControllerFile::of(self));
        text.map(|text| text + "\n").map_err(|error| StudyError::Usage(error.to_string()))
    }

    /// Writes it to a file; to two, `NAME.c` and `NAME.h`, where it is C. What was written.
    ///
    /// # Errors
    /// Where the path names no file, ends otherwise than the C source, or cannot be written.
    pub fn write(&self, format: ControllerFormat, path: &Path) -> Result<Vec<PathBuf>, StudyError> {
        check_out(format, path)?;
        match format {
            ControllerFormat::Json => write_text(path, self.to_json()?.as_bytes())?,
            ControllerFormat::Npz => write_text(path, &npz::bytes(&ControllerFile::of(self), path)?)?,
            ControllerFormat::C => {
                let header = path.with_extension("h");
                let name = header.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let CSource { header: declared, source } = CSource::of(self, &name)?;
                write_text(&header, declared.as_bytes())?;
                write_text(path, source.as_bytes())?;
                return Ok(vec![path.to_owned(), header]);
            }
        }
        Ok(vec![path.to_owned()])
    }
}

/// Checks that a controller can be written to a path.
///
/// # Errors
/// Where the path names no file, ends otherwise than the C source, or cannot be written.
///
/// Example: [`ExportedController::write`] checks its path by it, in the example of the [module](crate::controller).
pub fn check_out(format: ControllerFormat, path: &Path) -> Result<(), StudyError> {
    let Some(name) = path.file_name().map(|name| name.to_string_lossy()) else {
        return Err(StudyError::usage(format!("{} is not a file name", path.display())));
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    if format == ControllerFormat::C {
        let stem = name.strip_suffix(".c").unwrap_or_default();
        if stem.is_empty() || stem.contains(['"', '\\', '\n']) {
            let message = "the source of C must be a file NAME.c; NAME.h is written beside it";
            return Err(StudyError::usage(format!("{}: {message}", path.display())));
        }
        check_writable(folder, &format!("{stem}.h"))?;
    }
    check_writable(folder, &name)
}

/// The evaluation of a result that the controller is of.
fn evaluation(folder: &Folder, at: Option<At>) -> Result<&Evaluation, StudyError> {
    match (&folder.result, at) {
        (StudyResult::Design(report), Some(At::Start)) => Ok(&report.start),
        (StudyResult::Design(report), Some(At::Optimum) | None) => Ok(&report.optimum),
        (StudyResult::Evaluate(report), None) => Ok(&report.evaluation),
        (StudyResult::Evaluate(_), Some(_)) => Err(wrong(
            folder,
            "is from `supple evaluate` and holds one design; only results of `supple design` hold two",
        )),
        (other, _) => {
            let kind = other.kind();
            let needs = "a controller is taken from one of `supple design` or `supple evaluate`";
            Err(wrong(folder, &format!("is of `supple {kind}`: {needs}")))
        }
    }
}

/// The task that a result was made of, from the texts that it keeps.
fn restore(folder: &Folder) -> Result<LoadedTask, StudyError> {
    let sources = &folder.made.sources;
    if sources.iter().any(|source| source.path == OWN_MODEL) {
        let message = "was made of a model in Python, which it does not keep: export the controller there, by \
                       `result.controller()` of the result of `task.design()` or `task.evaluate()`";
        return Err(wrong(folder, message));
    }
    LoadedTask::restore(sources, &[])
}

/// That a result is not one that a controller can be taken from.
fn wrong(folder: &Folder, message: &str) -> StudyError {
    if folder.path.as_os_str().is_empty() {
        return StudyError::usage(format!("the result {message}"));
    }
    StudyError::kept(&folder.path, message)
}

/// Plan and control law as a result holds them.
struct Law {
    trajectory: Trajectory,
    feedforward: Matrices,
    feedback: Matrices,
}

impl Law {
    fn read(folder: &Folder, report: &TrajectoryReport) -> Result<Self, StudyError> {
        if report.feedforward.is_empty() {
            return Err(wrong(folder, "has no feedforward; recompute the result with this version of supple"));
        }
        let vectors = |rows: &[Vec<f64>]| {
            let matrices: Vec<&[Vec<f64>]> = rows.iter().map(std::slice::from_ref).collect();
            stacked(&matrices).ok_or_else(|| damaged(folder))
        };
        let feedback: Vec<&[Vec<f64>]> = report.feedback.iter().map(Vec::as_slice).collect();
        Ok(Self {
            trajectory: Trajectory { states: vectors(&report.states)?, controls: vectors(&report.controls)? },
            feedforward: vectors(&report.feedforward)?,
            feedback: stacked(&feedback).ok_or_else(|| damaged(folder))?,
        })
    }
}

fn damaged(folder: &Folder) -> StudyError {
    wrong(folder, "is damaged: rows of one matrix have different lengths; recompute the result")
}

/// Matrices of rows in one sequence; `None` where they differ in shape.
fn stacked(matrices: &[&[Vec<f64>]]) -> Option<Matrices> {
    let rows = matrices.first().map_or(0, |matrix| matrix.len());
    let cols = matrices.first().and_then(|matrix| matrix.first()).map_or(0, Vec::len);
    let mut found = Matrices::zeros(matrices.len(), rows, cols);
    for (t, matrix) in matrices.iter().enumerate() {
        if matrix.len() != rows || matrix.iter().any(|row| row.len() != cols) {
            return None;
        }
        for (i, row) in matrix.iter().enumerate() {
            row.iter().enumerate().for_each(|(j, &value)| found.set(t, i, j, value));
        }
    }
    Some(found)
}
