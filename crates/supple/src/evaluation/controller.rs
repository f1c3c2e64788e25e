use serde::{Deserialize, Serialize};
use supple_kernels::Matrices;

use crate::plan::Plan;

/// How much a controller changes over time: the paper's measure of its complexity (theory, equations P.8 and P.9).
///
/// The gains of a constant linear controller have zero variance. Entries of different units are added as they are, so the
/// variances compare designs of one task only.
///
/// Example: [`Evaluation`](crate::Evaluation).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ControllerReport {
    /// Temporal variance of the feedback gains: the mean over time of `|K_t - mean K|^2` (Frobenius).
    pub feedback_variance: f64,
    /// Its square root divided by the root mean square of `|K_t|`: from 0 to 1.
    pub feedback_variation: f64,
    /// Temporal variance of the feedforward: the mean over time of `|u_t - mean u|^2`.
    pub feedforward_variance: f64,
    /// Its square root divided by the root mean square of `|u_t|`: from 0 to 1.
    pub feedforward_variation: f64,
}

impl ControllerReport {
    pub(super) fn of(plan: &Plan) -> Self {
        let (feedback_variance, feedback_variation) = variation(&plan.policy.feedback);
        let (feedforward_variance, feedforward_variation) = variation(&plan.trajectory.controls);
        Self { feedback_variance, feedback_variation, feedforward_variance, feedforward_variation }
    }
}

/// The variance of matrices over time, and its root relative to their root mean square.
fn variation(matrices: &Matrices) -> (f64, f64) {
    let count = matrices.count() as f64;
    let (mut spread, mut square) = (0.0, 0.0);
    for i in 0..matrices.rows() {
        for j in 0..matrices.cols() {
            let entries = || (0..matrices.count()).map(|t| matrices.get(t, i, j));
            let mean = entries().sum::<f64>() / count;
            spread += entries().map(|entry| (entry - mean).powi(2)).sum::<f64>() / count;
            square += entries().map(|entry| entry.powi(2)).sum::<f64>() / count;
        }
    }
    (spread, if square > 0.0 { (spread / square).sqrt() } else { 0.0 })
}
