//! One design, evaluated and kept.

use serde::{Deserialize, Serialize};
use supple::Evaluation;

/// What `supple evaluate --out` keeps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EvaluateReport {
    /// The design, with trajectories.
    pub evaluation: Evaluation,
}
