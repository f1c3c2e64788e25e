//! How a minimum is searched for, and how a search ends.

use crate::Error;

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

impl BoundSettings {
    /// # Errors
    /// If no search can end with these.
    pub(super) fn check(&self) -> Result<(), Error> {
        let Self { gap, max_iterations } = *self;
        if !(0.0..f64::INFINITY).contains(&gap) {
            let what = format!("the requested gap is {gap:?}");
            return Err(Error::NoBound { what, advice: "give a finite number, at least 0" });
        }
        if max_iterations == 0 {
            return Err(Error::NoBound { what: "no Newton step is allowed".into(), advice: "allow more" });
        }
        Ok(())
    }
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
