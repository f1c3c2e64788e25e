//! Whether a plan is one that other numbers may build on.

use std::f64::consts::LN_2;

use serde::{Deserialize, Serialize};

use super::trust::{Predicted, Trust};
use super::{EvaluateOptions, sampled, warnings};
use crate::Error;
use crate::pipeline::TaskState;
use crate::plan::PlanStatus;
use crate::problem::{Problem, Task};
use crate::touching::contact_reports;

/// What speaks against the plan of a task, which bounds, choices of sensors and fronts are computed about: how its search ended,
/// warnings, and what roll-outs with all of the task's sensors say of the linearisation.
///
/// ```
/// use supple::pipeline::TaskState;
/// use supple::{PlanCheck, Verdict};
/// # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass.toml");
/// let problem = supple_file::load(file)?;
/// let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
/// let mut state = TaskState::new(task);
/// state.evaluate(task, &phi, &problem.planning, None)?;
/// let check = PlanCheck::of(&problem, task, &phi, &state, 1.0)?;
/// assert!(check.is_passed() && check.trust.is_some_and(|trust| trust.verdict == Verdict::Holds));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PlanCheck {
    /// The task.
    pub task: String,
    /// How the search for its plan ended.
    pub status: PlanStatus,
    /// Why its numbers cannot be trusted.
    pub warnings: Vec<String>,
    /// What roll-outs say; `None` where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trust: Option<Trust>,
}

impl PlanCheck {
    /// Checks the plan in `state`, with as many roll-outs as results of the problem end with; its cost limit is that of the
    /// task times `factor`.
    ///
    /// # Errors
    /// Where a covariance is indefinite.
    pub fn of(problem: &Problem, task: &Task, phi: &[f64], state: &TaskState, factor: f64) -> Result<Self, Error> {
        let options =
            EvaluateOptions { rollouts: problem.rollouts(None), seed: problem.design.seed, ..Default::default() };
        let contacts = contact_reports(task, phi, &state.plan.trajectory);
        let monte_carlo = sampled(task.at(phi), &options, state)?;
        let (status, bits) = (state.plan.status, state.information.total / LN_2);
        let limit = task.bound.as_ref().map(|bound| factor * bound.resolve::<f64>(phi));
        let predicted = Predicted::of(task, state, status, bits, &contacts, limit, problem.design.feasibility);
        let trust = monte_carlo.as_ref().map(|sampled| Trust::of(&predicted, sampled, task.system.substeps()));
        let warnings = warnings(task.at(phi), state, &contacts, monte_carlo.as_ref(), [const { None }; 3]);
        Ok(Self { task: task.name.clone(), status, warnings, trust })
    }

    /// Whether nothing speaks against it but, at most, doubts.
    #[must_use]
    pub fn is_passed(&self) -> bool {
        self.status.is_converged() && self.warnings.is_empty() && !self.trust.as_ref().is_some_and(Trust::is_broken)
    }
}
