//! Traces: the designs that searches visit on their way.

use serde::{Deserialize, Serialize};
use supple::Named;
use supple::design::{DesignStatus, GradientKind, Method};

use crate::{LoadedTask, StudyError, Watch};

/// What a study of traces does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceOptions {
    /// Starts: the initial values, then seeded random ones.
    pub starts: usize,
    /// Optimisers to compare.
    pub methods: Vec<Method>,
    /// Gradients to compare.
    pub gradients: Vec<GradientKind>,
    /// Seed of starts.
    pub seed: u64,
}

/// The paths of searches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// What was asked for.
    pub options: TraceOptions,
    /// One run per method, gradient and start, in this order of nesting.
    pub runs: Vec<TraceRun>,
}

/// One search from one start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceRun {
    /// Optimiser.
    pub method: Method,
    /// Gradient.
    pub gradient: GradientKind,
    /// Number of the start.
    pub start: usize,
    /// How it ended.
    pub status: DesignStatus,
    /// Designs in the order in which they were visited.
    pub path: Vec<TracePoint>,
    /// Where it ended: the best design.
    pub end: TracePoint,
    /// Why it ended early, where it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// A visited design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TracePoint {
    /// All parameters.
    pub parameters: Named,
    /// Information, nats.
    #[serde(deserialize_with = "supple::or_nan")]
    pub information_nats: f64,
    /// Expected cost of each task.
    pub costs: Vec<f64>,
}

/// Runs every search and keeps what it visits.
///
/// # Errors
/// Where there is nothing to design, or not even the first start can be evaluated.
pub fn run(_task: &LoadedTask, _options: &TraceOptions, _watch: Watch) -> Result<Trace, StudyError> {
    Err(StudyError::usage("not built yet"))
}
