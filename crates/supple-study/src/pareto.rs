//! Pareto fronts: the least information over the bound on cost.

use serde::{Deserialize, Serialize};
use supple::Named;
use supple::design::DesignStatus;

use crate::{LoadedTask, StudyError, Watch};

/// What a Pareto study does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParetoOptions {
    /// Points of the front.
    pub points: usize,
    /// Starts at its loose end.
    pub starts: usize,
    /// Seed of starts.
    pub seed: u64,
}

/// A front of information against cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pareto {
    /// What was asked for.
    pub options: ParetoOptions,
    /// The tasks' bounds at factor 1.
    pub bounds: Vec<f64>,
    /// Points by increasing factor: the tightest first.
    pub points: Vec<ParetoPoint>,
    /// Where bounds become active along the front, in words.
    pub remarks: Vec<String>,
}

/// A point of a front.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParetoPoint {
    /// All bounds are this times those of the task.
    pub factor: f64,
    /// The tasks' bounds here.
    pub bounds: Vec<f64>,
    /// How the search ended.
    pub status: DesignStatus,
    /// The design.
    pub parameters: Named,
    /// Its information, nats.
    pub information_nats: f64,
    /// Information of each task, nats.
    pub task_nats: Vec<f64>,
    /// Expected cost of each task.
    pub costs: Vec<f64>,
    /// Nats that a unit more of each task's bound would save; 0 where a bound is not active.
    pub prices: Vec<f64>,
    /// Parameters at an end of their range.
    pub at_ends: Vec<String>,
}

/// Follows the front by continuation.
///
/// # Errors
/// Where there is nothing to design, or no task has a bound.
pub fn run(_task: &LoadedTask, _options: &ParetoOptions, _watch: Watch) -> Result<Pareto, StudyError> {
    Err(StudyError::usage("not built yet"))
}
