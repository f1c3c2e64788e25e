//! A point of the dual, as the proof of the lower bound reads it.

use super::interior::Found;
use super::reduce::Chain;
use crate::dense::Dense;

/// A point of the dual and the covariances beside it: what [`super::verify`] proves a lower bound from.
#[derive(Clone, Debug)]
pub(super) struct Witness {
    /// At each decision.
    pub steps: Vec<WitnessStep>,
    /// The multiplier of the budget, nats per cost.
    pub price: f64,
}

/// One decision.
#[derive(Clone, Debug)]
pub(super) struct WitnessStep {
    /// `E`, n x n_t: `P = E E'`.
    pub basis: Dense,
    /// States that no price sees, n x k.
    pub unseen: Dense,
    /// The multiplier of `P <= Pbar` in these coordinates, n_t x n_t.
    pub multiplier: Dense,
}

impl Witness {
    pub fn new(chain: &Chain, found: &Found, budget: f64) -> Self {
        let step = |t: usize| WitnessStep {
            basis: &chain.stages[t].basis * &found.place.factors[t],
            unseen: chain.stages[t].unseen.clone(),
            multiplier: found.place.multipliers[t].clone(),
        };
        Self { steps: (0..chain.stages.len()).map(step).collect(), price: found.place.price / budget }
    }
}
