//! One design, evaluated and kept.

use serde::{Deserialize, Serialize};
use supple::Evaluation;

use crate::{LoadedTask, StudyError, Watch};

/// What is computed of a design.
///
/// Example: the [front page](crate).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvaluateOptions {
    /// Gradients with plan, feedback and filter moving with the design.
    pub total_gradient: bool,
    /// Gradients with trajectory and gains held fixed.
    pub frozen_gradient: bool,
    /// The minimum information that any sensors and any controller need.
    pub needed: bool,
    /// Closed-loop roll-outs.
    pub rollouts: usize,
    /// Attempts to find a cheaper plan at another local minimum.
    pub branches: usize,
    /// Seed of roll-outs and branch searches.
    pub seed: u64,
    /// Whether the trajectories are kept.
    pub trajectories: bool,
}

/// What `supple evaluate --out` keeps.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EvaluateReport {
    /// The design, with trajectories.
    pub evaluation: Evaluation,
}

/// Evaluates the design that the task's parameters are.
///
/// # Errors
/// Where more is asked for than there is room for, something is not finite, a covariance is indefinite, or it was stopped.
///
/// Example: the [front page](crate), where [`Work::run`](crate::study::Work::run) calls it.
pub fn run(task: &LoadedTask, options: &EvaluateOptions, watch: Watch) -> Result<EvaluateReport, StudyError> {
    let LoadedTask { problem, phi, .. } = task;
    let &EvaluateOptions { total_gradient, frozen_gradient, needed, rollouts, branches, seed, trajectories } = options;
    let wanted = supple::EvaluateOptions {
        total_gradient,
        frozen_gradient,
        needed,
        rollouts,
        branches,
        probe: true,
        seed,
        trajectories,
        ..Default::default()
    };
    let evaluation = problem.evaluate(phi, &wanted);
    // A plan that was cut short is none.
    if watch.is_stopped() { Err(StudyError::Stopped) } else { Ok(EvaluateReport { evaluation: evaluation? }) }
}
