//! Whether a time step is short enough.

use std::fmt;

use serde::{Deserialize, Serialize};
use supple_text::digits;

/// Whether a plan is numerically unstable because the time step is too large.
///
/// At a few steps of the plan, the spectral radius of `A = f_x` is compared with that for shorter time steps (theory,
/// equation R.19): growth at the same rate over shorter steps is physical; other growth comes from the integration.
///
/// Example: [`Evaluation`](crate::Evaluation).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct Stability {
    /// Time step, s.
    pub time_step: f64,
    /// The largest spectral radius of `A` over the steps examined; if any are numerically unstable, over
    /// those.
    pub spectral_radius: f64,
    /// The step where it is.
    pub step: usize,
    /// Whether the time step is too large there, rather than the system itself being unstable.
    pub numerically_unstable: bool,
    /// A time step that is short enough at all steps examined, s; `None` if the present one is.
    pub suggested_time_step: Option<f64>,
    /// How many sub-steps of the present time step are short enough, for models that can be integrated in sub-steps.
    pub suggested_substeps: Option<usize>,
}

impl fmt::Display for Stability {
    /// What is wrong and what to do, for numerically unstable plans.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let radius = self.spectral_radius;
        let radius = if radius < 100.0 { format!("{radius:.3}") } else { format!("{radius:.1e}") };
        write!(
            f,
            "time_step = {} s is too large for the stiff parts of the model: the spectral radius of A is {radius} at \
             step {}",
            digits(self.time_step),
            self.step
        )?;
        if let Some(suggested) = self.suggested_time_step {
            write!(f, "; use at most {} s", digits(suggested))?;
        }
        match self.suggested_substeps {
            Some(substeps) => write!(f, ", or substeps = {substeps}"),
            None => Ok(()),
        }
    }
}
