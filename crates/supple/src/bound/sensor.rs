//! The sensors that attain the minimum.

use supple_kernels::Matrices;

use super::solution::{MinimumInformation, StationaryMinimum, VirtualSensor};
use crate::dense::{Dense, cholesky, dense, eigen, semidefinite_root, solve_lower, store, symmetric};

/// Signal-to-noise ratios below this, or below this share of the largest where all are below 1, are not measured: at
/// most 7e-5 bits.
const RANK_TOLERANCE: f64 = 1e-4;

/// The sensor of each decision: what it measures, its noise and its gain (theory, equation L.13).
pub fn virtual_sensors(minimum: &MinimumInformation) -> Vec<VirtualSensor> {
    (0..minimum.posterior.count()).map(|t| sensor(&minimum.predicted, &minimum.posterior, t)).collect()
}

impl StationaryMinimum {
    /// The sensor that attains it.
    pub fn virtual_sensor(&self) -> VirtualSensor {
        sensor(&self.predicted, &self.posterior, 0)
    }
}

/// In coordinates where `Pbar = F F'` is the identity, `F^-1 P F^-T = U diag(1 / (1 + snr)) U'`.
fn sensor(predicted: &Matrices, posterior: &Matrices, t: usize) -> VirtualSensor {
    let n = predicted.rows();
    let (predicted, posterior) = (&dense(predicted, t), &dense(posterior, t));
    let none = || VirtualSensor {
        rank: 0,
        measurement: Matrices::zeros(1, 0, n),
        variances: Vec::new(),
        gain: Matrices::zeros(1, n, 0),
    };
    let Some(root) = semidefinite_root(predicted) else { return none() };
    // F^+ = (F'F)^-1 F', with F scaled rows: exact on the range.
    let Some(gram) = cholesky(&symmetric(root.transpose() * &root)) else { return none() };
    let half = solve_lower(&gram, root.transpose());
    let inverse = solve_upper(&gram, half);
    let Some(found) = eigen(symmetric(&inverse * posterior * inverse.transpose())) else { return none() };
    let ratios: Vec<f64> = found.eigenvalues.iter().map(|v| (1.0 / v.max(f64::MIN_POSITIVE) - 1.0).max(0.0)).collect();
    let largest = ratios.iter().fold(0.0f64, |a, &b| a.max(b));
    let mut kept: Vec<usize> =
        (0..ratios.len()).filter(|&k| ratios[k] > RANK_TOLERANCE * largest.min(1.0) && ratios[k] > 1e-6).collect();
    kept.sort_by(|&a, &b| ratios[b].total_cmp(&ratios[a]));
    let rank = kept.len();
    let (mut measurement, mut gain) = (Matrices::zeros(1, rank, n), Matrices::zeros(1, n, rank));
    let directions = found.eigenvectors.select_columns(&kept);
    store(&mut measurement, 0, &(directions.transpose() * &inverse));
    let shares = Dense::from_diagonal(&nalgebra::DVector::from_iterator(
        rank,
        kept.iter().map(|&k| ratios[k] / (1.0 + ratios[k])),
    ));
    store(&mut gain, 0, &(&root * directions * shares));
    let variances = kept.iter().map(|&k| 1.0 / ratios[k]).collect();
    VirtualSensor { rank, measurement, variances, gain }
}

/// `g'^-1 b`.
fn solve_upper(g: &Dense, mut b: Dense) -> Dense {
    let n = g.nrows();
    for mut column in b.column_iter_mut() {
        for i in (0..n).rev() {
            let mut sum = column[i];
            for k in i + 1..n {
                sum -= g[(k, i)] * column[k];
            }
            column[i] = sum / g[(i, i)];
        }
    }
    b
}
