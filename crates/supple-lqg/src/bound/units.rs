//! Units of states in which subspaces of a system are well conditioned.

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use supple_kernels::math;

use super::horizon::Stationary;
use crate::dense::{Dense, congruence, dense};

/// A system scaled so that its subspaces are well conditioned, whatever the units of its states.
pub struct InUnits {
    /// The size of each unit.
    pub d: Vec<f64>,
    /// `A` in these units.
    pub a: Dense,
    /// `Theta` in these units.
    pub price: Dense,
}

impl InUnits {
    /// Those of a system.
    #[must_use]
    pub fn of(system: &Stationary) -> Self {
        let (a, price) = (dense(&system.dynamics, 0), dense(&system.price, 0));
        let d = scales(&a, &dense(&system.process, 0));
        let a = a.map_with_location(|i, j, entry| entry / d[i] * d[j]);
        let price = price.map_with_location(|i, j, entry| entry * d[i] * d[j]);
        Self { d, a, price }
    }
}

/// The scale of each state: its standard deviation after noise has driven a damped system for a while, or their mean.
pub fn scales(a: &Dense, w: &Dense) -> Vec<f64> {
    let n = a.nrows();
    let mut balanced = a.abs();
    let s = balance_parlett_reinsch(&mut balanced);
    let a = Dense::from_fn(n, n, |i, j| a[(i, j)] / s[i] * s[j]);
    let w = Dense::from_fn(n, n, |i, j| w[(i, j)] / s[i] / s[j]);
    let damping = 1.0 / spectral_radius(&a).max(1.0);
    let mut reached = w.clone();
    for _ in 0..2 * n {
        reached = congruence(&a, &reached) * (damping * damping) + &w;
    }
    let deviations: Vec<f64> = (0..n).map(|i| reached[(i, i)].max(0.0).sqrt()).collect();
    let driven: Vec<f64> = deviations.iter().copied().filter(|v| *v > 0.0).collect();
    let mean = if driven.is_empty() {
        1.0
    } else {
        math::exp(driven.iter().map(|v| math::ln(*v)).sum::<f64>() / driven.len() as f64)
    };
    (0..n).map(|i| s[i] * if deviations[i] > 0.0 { deviations[i] } else { mean }).collect()
}

/// An estimate, never too low, of the spectral radius: `|A^64|^(1/64)`.
fn spectral_radius(a: &Dense) -> f64 {
    let (mut power, mut log) = (a.clone(), 0.0);
    for step in 0..=6 {
        let size = power.norm();
        if size == 0.0 || !size.is_finite() {
            return 0.0;
        }
        power /= size;
        log += math::ln(size) / f64::from(1 << step);
        power = &power * &power;
    }
    math::exp(log)
}
