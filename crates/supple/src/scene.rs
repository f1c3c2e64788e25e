//! What a model looks like over time: bodies, and forces between them.

use serde::{Deserialize, Serialize};

/// A moving picture of a plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {}
