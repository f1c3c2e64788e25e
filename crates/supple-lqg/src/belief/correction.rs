//! One correction of a filter over small dense matrices.

use crate::dense::{Dense, cholesky, inverse_lower, joseph, solve_lower, symmetric};

/// The Kalman filter's step from `P` to `Sigma` with measurements `C x + v`.
pub struct Correction {
    /// The lower Cholesky factor of the innovation covariance `S^y = C P C' + V`.
    pub innovation_factor: Dense,
    /// `L = P C' S^-1`, n x p.
    pub gain: Dense,
    /// `Sigma`, in Joseph's form.
    pub corrected: Dense,
}

impl Correction {
    /// From `P` with `C` and `V`; `None` if the innovation covariance is not positive definite.
    pub fn of(predicted: &Dense, c: &Dense, v: &Dense) -> Option<Self> {
        let innovation_factor = cholesky(&symmetric(c * predicted * c.transpose() + v))?;
        let half = solve_lower(&innovation_factor, c * predicted);
        let gain = half.transpose() * inverse_lower(&innovation_factor);
        let corrected = joseph(predicted, c, v, &gain);
        Some(Self { innovation_factor, gain, corrected })
    }
}
