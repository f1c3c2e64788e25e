//! Options and results of Pareto fronts.

use serde::{Deserialize, Serialize};
use supple::design::InformationWeights;

use super::point::ParetoPoint;
use super::remarks::Remark;
use crate::lenient;

/// What a Pareto study does.
///
/// Example: the [module](crate::pareto).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParetoOptions {
    /// Points of the front.
    pub points: usize,
    /// Starts at its unconstrained end.
    pub starts: usize,
    /// Seed of starts.
    pub seed: u64,
}

/// A front of information against cost.
///
/// Example: the [module](crate::pareto).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pareto {
    /// What was asked for.
    pub options: ParetoOptions,
    /// Which information is minimised at every point.
    #[serde(default)]
    pub information: InformationWeights,
    /// The tasks' bounds at factor 1; infinite where a task has none.
    #[serde(deserialize_with = "lenient::list")]
    pub bounds: Vec<f64>,
    /// Points by increasing factor: the tightest first.
    pub points: Vec<ParetoPoint>,
    /// Where bounds become active along the front, in words.
    pub remarks: Vec<Remark>,
    /// Whether it was stopped before all points were found: others are missing, and those that are there were not
    /// compared with their neighbours.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stopped: bool,
}
