//! Compares every derivative of a problem with finite differences and reports properties of its knots.

mod compare;
mod differences;
mod facts;
mod gradients;
mod parameters;
mod system;

use serde::Serialize;

pub use compare::{Row, VISIBLE};
pub use differences::Difference;
pub use facts::Fact;
pub use gradients::{ComparedGradient, ComparedGradients, compare_gradients};

use crate::Error;
use crate::candidates::best_of_guesses;
use crate::pipeline::TaskState;
use crate::plan::PlanStatus;
use crate::problem::{Problem, Task};

/// Results of a check.
///
/// Example: [`check`].
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct CheckReport {
    /// Whether every derivative agrees.
    pub passed: bool,
    /// Each task.
    pub tasks: Vec<TaskCheck>,
}

/// Results of the check of one task.
///
/// Example: [`check`].
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct TaskCheck {
    /// Its name.
    pub name: String,
    /// How its plan ended.
    pub status: PlanStatus,
    /// The largest gradient of the Hamiltonian by a control.
    pub stationarity: f64,
    /// One row per derivative, with its worst entry.
    pub rows: Vec<Row>,
    /// Nearby designs that could not be used for differences by parameters, and why.
    pub left_out: Vec<String>,
    /// Conditioning and observability of its knots.
    pub facts: Vec<Fact>,
}

/// Checks all tasks of a problem at a design: every derivative along the plan against finite differences.
///
/// # Errors
/// Where the design cannot be evaluated.
///
/// ```
/// use supple::check::check;
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// let report = check(&problem, &problem.parameters.initial())?;
/// let task = &report.tasks[0];
/// assert!(report.passed && task.rows.iter().all(|row| row.error <= row.tolerance));
/// assert_eq!(task.facts[0].name, "largest spectral radius of A");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn check(problem: &Problem, phi: &[f64]) -> Result<CheckReport, Error> {
    problem.check_design(phi)?;
    let tasks = problem.tasks.iter().map(|task| check_task(problem, task, phi)).collect::<Result<Vec<_>, _>>()?;
    Ok(CheckReport { passed: tasks.iter().all(|task| task.rows.iter().all(|row| row.passed)), tasks })
}

fn check_task(problem: &Problem, task: &Task, phi: &[f64]) -> Result<TaskCheck, Error> {
    let mut state = TaskState::new(task);
    plan_for_check(problem, task, phi, &mut state)?;
    Error::check_stop()?;
    let mut rows = system::rows(problem, task, phi, &state.plan);
    Error::check_stop()?;
    let ComparedGradients { gradients, left_out } = compare_gradients(problem, task, phi, &mut state)?;
    // After a stop request some differences are missing.
    Error::check_stop()?;
    rows.extend(gradients.iter().map(|gradient| gradient.row(&problem.parameters)));
    Ok(TaskCheck {
        name: task.name.clone(),
        status: state.plan.status,
        stationarity: state.plan.stationarity,
        rows,
        left_out,
        facts: facts::facts(task, &state.plan, &state.noise),
    })
}

/// The plan of a task from its first guesses, converged precisely enough for finite differences.
///
/// # Errors
/// Where the design cannot be evaluated.
///
/// Example: [`compare_gradients`].
pub fn plan_for_check(problem: &Problem, task: &Task, phi: &[f64], state: &mut TaskState) -> Result<(), Error> {
    best_of_guesses(problem, task, phi, state)?;
    let tight = gradients::tight(&problem.planning);
    if tight == problem.planning {
        return Ok(());
    }
    let controls = state.plan.trajectory.controls.clone();
    state.evaluate(task, phi, &tight, Some(&controls))
}
