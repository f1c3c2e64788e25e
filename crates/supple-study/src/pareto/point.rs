//! Points of Pareto fronts.

use serde::{Deserialize, Serialize};
use supple::design::DesignStatus;
use supple::{Named, Trust};

use crate::lenient;

/// A point of a front.
///
/// Example: the [module](crate::pareto).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParetoPoint {
    /// All bounds are this times those of the task.
    pub factor: f64,
    /// The tasks' bounds here; infinite where a task has none.
    #[serde(deserialize_with = "lenient::list")]
    pub bounds: Vec<f64>,
    /// How the search ended.
    pub status: DesignStatus,
    /// The design.
    pub parameters: Named,
    /// The information that is minimised, by the weights of the task file, nats.
    pub information_nats: f64,
    /// Measured information of each task, nats.
    pub task_nats: Vec<f64>,
    /// Expected cost of each task.
    pub costs: Vec<f64>,
    /// Nats that a unit more of each task's bound would save; 0 where a bound is not active. NaN for those that are
    /// active at a tight end whose design is the only one: there it is infinite.
    #[serde(deserialize_with = "lenient::list")]
    pub prices: Vec<f64>,
    /// The sum of the prices of its parameters, where any has one; those of catalogues' entries do not count, as no
    /// value is taken from these.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub price: Option<f64>,
    /// Parameters at a bound of their range.
    pub at_ends: Vec<String>,
    /// Why its numbers cannot be trusted, for people: a cost wants a force from a contact that a plan never touches.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// What roll-outs say of each task; empty where there are none.
    #[serde(default)]
    pub trust: Vec<Trust>,
}

impl ParetoPoint {
    /// Whether roll-outs contradict a task, so that its numbers must not be used.
    #[must_use]
    pub fn is_broken(&self) -> bool {
        self.trust.iter().any(Trust::is_broken)
    }
}
