use supple::plan::PlanStatus;
use supple::simulate::{MonteCarlo, Rollouts};
use supple::{Channels, Controller, Evaluation, Matrices, Named, Task, Trajectory, TrajectoryReport, Trust};

use super::names;
use crate::{Folder, LoadedTask, OWN_MODEL, StudyError, StudyResult};

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
    LoadedTask::restore(sources)
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
