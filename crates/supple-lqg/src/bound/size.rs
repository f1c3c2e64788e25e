//! The size of a minimum-information problem, and which sizes are too large.

use super::horizon::Horizon;
use super::newton::packed;
use crate::Error;

/// The largest factorisation of the Newton system, multiply-adds, that an evaluation does without being asked: a few
/// seconds in total.
const UNASKED: f64 = 1.5e8;

/// The memory that the Newton system may take, bytes.
const MOST_BYTES: f64 = 4e9;

/// The size of the problem over a horizon: each decision has a symmetric matrix of unknowns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size {
    states: usize,
    decisions: usize,
}

impl Size {
    pub fn of(horizon: &Horizon) -> Self {
        Self { states: horizon.prices.rows(), decisions: horizon.prices.count() }
    }

    /// Whether it takes too long for an evaluation that did not request it.
    pub fn is_long(self) -> bool {
        (packed(self.states) as f64).powi(3) * self.decisions as f64 > UNASKED
    }

    /// # Errors
    /// If the Newton system needs more memory than usual machines have: a diagonal and an off-diagonal block per
    /// decision.
    pub fn check(self) -> Result<(), Error> {
        let Self { states, decisions } = self;
        let bytes = 2.0 * size_of::<f64>() as f64 * (packed(states) as f64).powi(2) * decisions as f64;
        if bytes <= MOST_BYTES {
            return Ok(());
        }
        Err(Error::NoBound {
            what: format!("{states} states over {decisions} decisions require {:.0} GB of memory", bytes / 1e9),
            advice: "use fewer and longer time steps, or lock the joints that do not matter",
        })
    }
}
