//! Warm start of a search from a nearby problem.

use super::interior::Found;
use super::local::{Place, slack_of_budget};
use super::reduce::Chain;
use crate::dense::{Dense, cholesky, congruence, inverse_lower, symmetric};

/// An iterate of the search for one minimum, from which the search of a nearby problem can be warm-started.
///
/// Example: [`Needed`](crate::bound::Needed).
#[derive(Clone, Debug)]
pub struct Nearby {
    /// Covariances and multipliers of each decision in the states' coordinates, n x n.
    decisions: Vec<(Dense, Dense)>,
    /// Nats per unit of cost.
    price: f64,
    /// The barrier weight at this iterate.
    barrier: f64,
}

/// Shares of the covariances to try if the iterate is infeasible for the nearby problem.
const SHARES: [f64; 4] = [1.0, 0.99, 0.9, 0.7];

impl Nearby {
    pub(super) fn of(chain: &Chain, found: &Found, budget: f64) -> Option<Self> {
        let early = found.early.as_ref()?;
        let one = |t: usize| {
            let (stage, factor) = (&chain.stages[t], &early.factors[t]);
            let root = &stage.basis * factor;
            let reader = inverse_lower(factor) * &stage.reader;
            let multiplier = reader.transpose() * &early.multipliers[t] * reader;
            (symmetric(&root * root.transpose()), symmetric(multiplier))
        };
        let decisions = (0..chain.stages.len()).map(one).collect();
        Some(Self { decisions, price: early.price / budget, barrier: early.barrier })
    }

    /// The same iterate in the coordinates of another problem; `None` if it is not strictly feasible there.
    pub(super) fn place(&self, chain: &Chain, budget: f64) -> Option<Place> {
        if self.decisions.len() != chain.stages.len() {
            return None;
        }
        let inside = |share: f64| {
            let mut place = Place {
                factors: Vec::with_capacity(chain.stages.len()),
                multipliers: Vec::with_capacity(chain.stages.len()),
                price: self.price * budget,
                barrier: self.barrier,
            };
            for (stage, (covariance, multiplier)) in chain.stages.iter().zip(&self.decisions) {
                let factor = cholesky(&(congruence(&stage.reader, covariance) * share))?;
                let root = &stage.basis * &factor;
                let multiplier = symmetric(root.transpose() * multiplier * root);
                cholesky(&multiplier)?;
                place.multipliers.push(multiplier);
                place.factors.push(factor);
            }
            let local = place.localise(chain)?;
            (slack_of_budget(&local) > 0.0).then_some(place)
        };
        SHARES.into_iter().find_map(inside)
    }
}
