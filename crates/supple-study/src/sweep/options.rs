use serde::{Deserialize, Serialize};

use super::axis::Axis;

/// What a sweep does.
///
/// Example: the [module](crate::sweep).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepOptions {
    /// The axes; the last one changes fastest.
    pub axes: Vec<Axis>,
    /// Closed-loop roll-outs at every point.
    pub rollouts: usize,
    /// Starts of a design search at every point over the design parameters that are on no axis; 0 for none.
    pub starts: usize,
    /// Attempts at every point to find a plan of lower cost at another local minimum; 0 with starts.
    #[serde(default)]
    pub branches: usize,
    /// Seed of roll-outs and searches.
    pub seed: u64,
}

impl SweepOptions {
    /// How many points the grid has.
    #[must_use]
    pub fn points(&self) -> usize {
        self.axes.iter().map(|axis| axis.values.len()).product()
    }
}
