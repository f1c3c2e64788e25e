//! How a minimum is searched for, and how a search ends.

/// How the minimum is searched for.
///
/// Example: the [front page](crate).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundSettings {
    /// The duality gap at which the search ends, nats per step.
    pub gap: f64,
    /// Maximum number of Newton steps.
    pub max_iterations: usize,
}

impl Default for BoundSettings {
    fn default() -> Self {
        Self { gap: 1e-7, max_iterations: 200 }
    }
}

/// How a search for the minimum ended.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoundStatus {
    /// The requested gap was reached.
    Converged,
    /// The Newton steps allowed were too few; the bounds hold, with a larger gap than requested.
    MaxIterations,
    /// Rounding ended the search; the bounds hold, with a larger gap than requested.
    Stalled,
}
