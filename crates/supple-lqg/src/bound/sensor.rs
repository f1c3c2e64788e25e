//! The sensors that correspond to an iterate of the search, first in reduced coordinates.

use supple_kernels::Matrices;

use super::interior::Found;
use super::reduce::Chain;
use super::settle::settled;
use super::virtual_sensor::VirtualSensor;
use crate::belief::Correction;
use crate::dense::{Dense, congruence, eigen, inverse_lower, store, symmetric};

/// Signal-to-noise ratios below this, or below this share of the largest where all are below 1, are not measured: at
/// most 7e-5 bits.
const RANK_TOLERANCE: f64 = 1e-4;

/// Directions below this ratio are not measured, unless it is at least this share of the largest ratio at any decision.
const LEAST_RATIO: f64 = 1e-6;
const FAINT: f64 = 0.1;

/// The largest factor by which precision may be raised to make up for the directions that sensors leave out.
const MOST_PRECISION: f64 = 1e3;

/// The measurement at one decision, in reduced coordinates.
struct Reduced {
    /// `C`, rank x n_t.
    measurement: Dense,
    /// The diagonal of `V`.
    variances: Vec<f64>,
}

/// The sensors of the final iterate, made precise enough to keep the budget.
pub(super) fn sensors(chain: &Chain, found: &Found) -> Vec<VirtualSensor> {
    // If hardly anything is measured at any decision, the directions measured most are kept.
    let largest =
        found.local.iter().filter_map(|local| eigen(local.slack.clone())).map(|found| found.eigenvalues.max());
    let faint = f64::min(LEAST_RATIO, FAINT * largest.fold(0.0, f64::max));
    let mut reduced: Vec<Reduced> = (0..chain.stages.len()).map(|t| one(found, t, faint)).collect();
    let cost = |precision: f64| filter(chain, &reduced, precision).map(|(cost, _)| cost);
    let precision = enough(cost);
    for one in &mut reduced {
        one.variances.iter_mut().for_each(|variance| *variance /= precision);
    }
    let corrected = filter(chain, &reduced, 1.0).map(|(_, steps)| steps);
    let sensors = reduced.into_iter().enumerate().map(|(t, one)| {
        let stage = &chain.stages[t];
        let (n, rank) = (stage.basis.nrows(), one.variances.len());
        let (mut measurement, mut gain) = (Matrices::zeros(1, rank, n), Matrices::zeros(1, n, rank));
        store(&mut measurement, 0, &(&one.measurement * &stage.reader));
        if let Some(steps) = &corrected {
            store(&mut gain, 0, &(&stage.basis * &steps[t].gain));
        }
        VirtualSensor { rank, measurement, variances: one.variances, gain }
    });
    sensors.collect()
}

/// The measurement at decision `t`, from `Pbar = U diag(1 + snr) U'` in coordinates where `P` is the identity.
fn one(found: &Found, t: usize, faint: f64) -> Reduced {
    let (local, factor) = (&found.local[t], &found.place.factors[t]);
    let n = factor.nrows();
    let Some(found) = eigen(local.slack.clone()) else {
        return Reduced { measurement: Dense::zeros(0, n), variances: Vec::new() };
    };
    let ratios: Vec<f64> = found.eigenvalues.iter().map(|v| v.max(0.0)).collect();
    let largest = ratios.iter().fold(0.0f64, |a, &b| a.max(b));
    let least = f64::max(RANK_TOLERANCE * largest.min(1.0), faint);
    let mut kept: Vec<usize> = (0..n).filter(|&k| ratios[k] > least).collect();
    kept.sort_by(|&a, &b| ratios[b].total_cmp(&ratios[a]));
    let mut measurement = found.eigenvectors.select_columns(&kept).transpose() * inverse_lower(factor);
    for (mut row, &k) in measurement.row_iter_mut().zip(&kept) {
        row /= (1.0 + ratios[k]).sqrt();
    }
    Reduced { measurement, variances: kept.iter().map(|&k| 1.0 / ratios[k]).collect() }
}

/// The least factor on the precision that keeps the budget; the cost falls as the factor grows.
fn enough(cost: impl Fn(f64) -> Option<f64>) -> f64 {
    let (mut low, mut high) = (1.0, 1.0);
    while cost(high).is_none_or(|cost| cost > 1.0) {
        low = high;
        high = 1.0 + 4.0 * f64::max(high - 1.0, 1e-7);
        if high > MOST_PRECISION {
            return 1.0;
        }
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if high - low <= 1e-13 * high {
            break;
        }
        if cost(middle).is_some_and(|cost| cost <= 1.0) { high = middle } else { low = middle }
    }
    high
}

/// The Kalman filter of these sensors: its cost as a share of the budget, and its steps; in steady state if the only
/// decision is its own successor. `None` if there is no such filter.
fn filter(chain: &Chain, sensors: &[Reduced], precision: f64) -> Option<(f64, Vec<Correction>)> {
    let mut predicted = Dense::identity(chain.order(0), chain.order(0));
    if chain.wraps {
        predicted = steady(chain, &sensors[0], precision)?;
    }
    let (mut cost, mut steps) = (0.0, Vec::with_capacity(sensors.len()));
    for (stage, sensor) in chain.stages.iter().zip(sensors) {
        let step = correct(&predicted, sensor, precision)?;
        cost += stage.price.dot(&step.corrected);
        predicted = congruence(&stage.dynamics, &step.corrected) + &stage.process;
        steps.push(step);
    }
    cost.is_finite().then_some((cost, steps))
}

fn correct(predicted: &Dense, sensor: &Reduced, precision: f64) -> Option<Correction> {
    let noise = Dense::from_diagonal(&nalgebra::DVector::from_iterator(
        sensor.variances.len(),
        sensor.variances.iter().map(|variance| variance / precision),
    ));
    Correction::of(predicted, &sensor.measurement, &noise)
}

/// The predicted covariance of the filter in steady state.
fn steady(chain: &Chain, sensor: &Reduced, precision: f64) -> Option<Dense> {
    let stage = &chain.stages[0];
    let n = stage.price.nrows();
    let c = &sensor.measurement;
    let weighted = Dense::from_fn(c.nrows(), n, |i, k| c[(i, k)] / sensor.variances[i] * precision);
    settled(&stage.dynamics, &symmetric(c.transpose() * weighted), &stage.process, &Dense::identity(n, n))
}
