//! A point of the search in its own coordinates, in which every posterior covariance is the identity.

use supple_kernels::halt;

use super::reduce::Chain;
use crate::dense::{Dense, cholesky, congruence, eigen, inverse_lower, log_determinant, solve_lower, symmetric};

/// An iterate of the search: covariances and multipliers.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// Lower factors of `p_t = g_t g_t'`.
    pub factors: Vec<Dense>,
    /// Multipliers `L_t` of `P_t <= Pbar_t` as `g_t' L_t g_t`: positive definite.
    pub multipliers: Vec<Dense>,
    /// The multiplier of the budget, nats per budget: positive.
    pub price: f64,
    /// The weight of the barrier that keeps `p_t` positive definite, nats.
    pub barrier: f64,
}

/// One decision in coordinates where `p_t` is the identity.
#[derive(Clone, Debug)]
pub(super) struct Local {
    /// `g_{t+1}^-1 a g_t`.
    pub dynamics: Dense,
    /// Price as a share of the budget.
    pub price: Dense,
    /// `Pbar_t`.
    pub predicted: Dense,
    /// Lower factor of `Pbar_t`.
    pub predicted_factor: Dense,
    /// `Z_t = Pbar_t - p_t`.
    pub slack: Dense,
    /// Lower factor of `Z_t`.
    pub slack_factor: Dense,
}

impl Place {
    /// In coordinates in which `p_t` is the identity; `None` if the point is not strictly feasible, and once a stop is
    /// requested.
    pub fn localise(&self, chain: &Chain) -> Option<Vec<Local>> {
        let mut out: Vec<Local> = Vec::with_capacity(chain.stages.len());
        let first = &self.factors[0];
        // The initial covariance is the identity in reduced coordinates.
        let mut predicted = (!chain.wraps).then(|| {
            let inverse = inverse_lower(first);
            symmetric(&inverse * inverse.transpose())
        });
        for (t, stage) in chain.stages.iter().enumerate() {
            if halt::is_requested() {
                return None;
            }
            let g = &self.factors[t];
            let (dynamics, after) = match chain.next(t) {
                Some(next) => {
                    let to = &self.factors[next];
                    let dynamics = solve_lower(to, &stage.dynamics * g);
                    let half = solve_lower(to, stage.process.clone());
                    let process = symmetric(solve_lower(to, half.transpose()));
                    let after = symmetric(&dynamics * dynamics.transpose()) + process;
                    (dynamics, Some(after))
                }
                None => (Dense::zeros(0, g.nrows()), None),
            };
            let here = if chain.wraps { after.clone() } else { predicted.take() }?;
            predicted = after;
            let slack = &here - Dense::identity(g.nrows(), g.nrows());
            out.push(Local {
                dynamics,
                price: symmetric(g.transpose() * &stage.price * g),
                predicted_factor: cholesky(&here)?,
                predicted: here,
                slack_factor: cholesky(&slack)?,
                slack,
            });
        }
        Some(out)
    }
}

/// The unused part of the budget, as a share of it.
pub(super) fn slack_of_budget(local: &[Local]) -> f64 {
    1.0 - local.iter().map(|l| l.price.trace()).sum::<f64>()
}

/// `1/2 log |Pbar_t| - 1/2 log |P_t|`, nats.
pub(super) fn nats(local: &Local) -> f64 {
    0.5 * log_determinant(&local.predicted_factor).max(0.0)
}

/// The Nesterov-Todd scaling of `Z_t` and `L_t` (theory, equation L.6).
pub(super) struct Scaling {
    /// `R^-1`, with `R^-1 Z R^-T = R' L R = diag(v)`.
    pub inverse_root: Dense,
    /// `R`.
    pub root: Dense,
    /// `v`.
    pub values: Vec<f64>,
    /// `T = R^-T R^-1`: `T Z T = L`.
    pub metric: Dense,
    /// `Z^-1`.
    pub slack_inverse: Dense,
}

/// The scaling of a slack, given by its lower factor, and its multiplier.
pub(super) fn scaling(factor: &Dense, multiplier: &Dense) -> Option<Scaling> {
    let inverse = inverse_lower(factor);
    let found = eigen(symmetric(factor.transpose() * multiplier * factor))?;
    let floor = found.eigenvalues.iter().fold(0.0f64, |a, v| a.max(v.abs())) * 1e-14;
    let values: Vec<f64> = found.eigenvalues.iter().map(|v| v.max(floor).sqrt()).collect();
    let (mut inverse_root, mut root) = (found.eigenvectors.transpose() * &inverse, factor * &found.eigenvectors);
    for (k, value) in values.iter().enumerate() {
        let scale = value.sqrt();
        if scale.is_nan() || scale <= 0.0 {
            return None;
        }
        inverse_root.row_mut(k).scale_mut(scale);
        root.column_mut(k).scale_mut(1.0 / scale);
    }
    let metric = symmetric(inverse_root.transpose() * &inverse_root);
    let slack_inverse = symmetric(inverse.transpose() * inverse);
    Some(Scaling { inverse_root, root, values, metric, slack_inverse })
}

/// `a d a'` minus `d_next`: the change of a slack.
pub(super) fn slack_change(chain: &Chain, local: &[Local], steps: &[Dense], t: usize) -> Dense {
    let before = if chain.wraps { Some(0) } else { t.checked_sub(1) };
    let carried = before.map(|s| congruence(&local[s].dynamics, &steps[s]));
    carried.unwrap_or_else(|| Dense::zeros(steps[t].nrows(), steps[t].nrows())) - &steps[t]
}
