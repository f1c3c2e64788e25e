//! Sensitivity of the minimum to the data of the problem: by the envelope theorem, from the dual point alone.

use supple_kernels::Matrices;

use super::horizon::{Horizon, Stationary};
use super::interior::Found;
use super::reduce::Chain;
use crate::dense::{Dense, dense, inverse_lower, store, symmetric};

/// Derivatives of the minimum, nats, with respect to the entries of each matrix: `dR = sum Tr(G' dM)`.
///
/// Derivatives with respect to symmetric matrices are symmetric. For directions left out of the problem because they are
/// known or cost nothing, the derivatives are 0.
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Sensitivity {
    /// With respect to `A_t`, n x n: one for each decision (the last is 0), or a single one in the time-invariant case.
    pub dynamics: Matrices,
    /// With respect to `W_t`, n x n, the same number of them.
    pub process: Matrices,
    /// With respect to `X_0`, n x n; 0 in the time-invariant case.
    pub initial: Matrices,
    /// With respect to `Theta_t`, n x n, the same number of them.
    pub prices: Matrices,
    /// With respect to the expected cost `D`: never positive. The derivative with respect to the least cost is its negative.
    pub cost: f64,
}

/// `1/2 Pbar_t^-1 - L_t` in the states of each decision: the sensitivity to `Pbar_t`, nats.
#[derive(Clone, Debug, Default)]
pub(super) struct Worth(Vec<Dense>);

impl Worth {
    pub fn of(chain: &Chain, found: &Found) -> Self {
        let one = |t: usize| {
            let local = &found.local[t];
            let inverse = inverse_lower(&local.predicted_factor);
            let worth = inverse.transpose() * inverse * 0.5 - &found.place.multipliers[t];
            let reader = inverse_lower(&found.place.factors[t]) * &chain.stages[t].reader;
            symmetric(reader.transpose() * worth * reader)
        };
        Self((0..chain.stages.len()).map(one).collect())
    }

    /// The worth for `R x`, expressed in `x`.
    pub fn among_all(&self, rows: &Dense) -> Self {
        Self(self.0.iter().map(|worth| symmetric(rows.transpose() * worth * rows)).collect())
    }
}

impl Sensitivity {
    pub(super) fn over_horizon(horizon: &Horizon, worth: &Worth, posterior: &Matrices, slope: f64) -> Self {
        let steps: Vec<(Dense, Option<&Dense>)> = (0..horizon.steps())
            .map(|t| (dense(&horizon.dynamics, t.min(horizon.steps().saturating_sub(2))), worth.0.get(t + 1)))
            .collect();
        let mut out = sensitivity(&steps, posterior, slope);
        if let Some(first) = worth.0.first() {
            store(&mut out.initial, 0, first);
        }
        out
    }

    /// In the time-invariant case.
    pub(super) fn per_step(system: &Stationary, worth: &Worth, posterior: &Matrices, slope: f64) -> Self {
        sensitivity(&[(dense(&system.dynamics, 0), worth.0.first())], posterior, slope)
    }
}

/// From `A_t` and the sensitivity to the covariance that follows it, for each decision.
fn sensitivity(steps: &[(Dense, Option<&Dense>)], posterior: &Matrices, slope: f64) -> Sensitivity {
    let (n, count) = (posterior.rows(), steps.len());
    let zeros = || Matrices::zeros(count, n, n);
    let (mut dynamics, mut process, mut prices) = (zeros(), zeros(), zeros());
    for (t, (a, worth)) in steps.iter().enumerate() {
        let p = dense(posterior, t);
        if let Some(worth) = worth {
            store(&mut dynamics, t, &(*worth * a * &p * 2.0));
            store(&mut process, t, worth);
        }
        store(&mut prices, t, &(p * -slope));
    }
    Sensitivity { dynamics, process, initial: Matrices::zeros(1, n, n), prices, cost: slope }
}
