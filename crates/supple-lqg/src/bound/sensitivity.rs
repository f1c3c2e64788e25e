//! How the minimum changes with the numbers of the problem: by the envelope theorem, from the dual point alone.

use supple_kernels::Matrices;

use super::horizon::{Horizon, Stationary};
use super::interior::Found;
use super::reduce::Chain;
use crate::dense::{Dense, dense, inverse_lower, store, symmetric};

/// Derivatives of the minimum in nats, by the entries of each matrix: `dR = sum Tr(G' dM)`.
///
/// Those by symmetric matrices are symmetric. Where directions were left out of the problem, because they are known or cost
/// nothing, their derivatives are 0.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// By `A_t`, n x n: one for each decision, of which the last is 0, or one where nothing changes over time.
    pub dynamics: Matrices,
    /// By `W_t`, n x n, as many.
    pub process: Matrices,
    /// By `X_0`, n x n; 0 where nothing changes over time.
    pub initial: Matrices,
    /// By `Theta_t`, n x n, as many.
    pub prices: Matrices,
    /// By the expected cost `D`: at most 0. By the least cost it is the negative of this.
    pub cost: f64,
}

/// `1/2 Pbar_t^-1 - L_t` in the states of each decision: what a larger `Pbar_t` is worth, nats.
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

    /// That of `R x` as one of `x`.
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

    /// Where nothing changes over time.
    pub(super) fn per_step(system: &Stationary, worth: &Worth, posterior: &Matrices, slope: f64) -> Self {
        sensitivity(&[(dense(&system.dynamics, 0), worth.0.first())], posterior, slope)
    }
}

/// From `A_t`, and what a larger covariance after it is worth.
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
