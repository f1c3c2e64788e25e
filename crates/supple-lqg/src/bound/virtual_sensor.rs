//! A sensor that attains the minimum.

use supple_kernels::Matrices;

use crate::belief::Correction;
use crate::dense::{Dense, dense, store};

/// A sensor that attains the minimum information with the Kalman filter and the optimal regulator:
/// `y = C x + v`, one at each step (theory, equation L.13).
///
/// Example: the [module](crate::bound).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct VirtualSensor {
    /// How many numbers it measures: the rank of `P^-1 - (A P A' + W)^-1 = C' V^-1 C`.
    pub rank: usize,
    /// `C`, rank x n.
    pub measurement: Matrices,
    /// The variances of `v`, the diagonal of `V`, rank.
    pub variances: Vec<f64>,
    /// The Kalman gain `L`, n x rank.
    pub gain: Matrices,
}

impl VirtualSensor {
    /// A sensor that measures nothing, for `n` states.
    pub(super) fn none(n: usize) -> Self {
        Self { rank: 0, measurement: Matrices::zeros(1, 0, n), variances: Vec::new(), gain: Matrices::zeros(1, n, 0) }
    }

    /// The Kalman gain from the covariance before the measurement; `None` if the innovation's is not positive definite.
    pub(super) fn gain_from(&self, predicted: &Dense) -> Option<Matrices> {
        let c = dense(&self.measurement, 0);
        let noise = Dense::from_diagonal(&nalgebra::DVector::from_column_slice(&self.variances));
        let mut gain = Matrices::zeros(1, predicted.nrows(), self.rank);
        store(&mut gain, 0, &Correction::of(predicted, &c, &noise)?.gain);
        Some(gain)
    }
}
