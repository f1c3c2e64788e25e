//! Horizons along linearised plans.

use supple_kernels::{Matrices, rows};

use super::horizon::Horizon;
use super::verify::{Back, Matrix, distance};
use crate::knots::Knots;
use crate::noise::Noise;
use crate::riccati::Policy;

impl Horizon {
    /// That along knots, with the prices of a law and the cost of the plan itself.
    pub fn along(knots: &Knots, policy: &Policy, noise: &Noise, nominal_cost: f64) -> Self {
        let (n, steps) = (knots.dimensions.states, knots.steps());
        let mut dynamics = Matrices::zeros(steps, n, n);
        let mut prices = Matrices::zeros(steps, n, n);
        for t in 0..steps {
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                dynamics.set(t, i, j, knots.dynamics.get(t, i, j));
                prices.set(t, i, j, 0.5 * policy.value_of_information.get(t, i, j));
            }
        }
        let (s, traced) = (&policy.curvature, |a: &Matrices, b: &Matrices, t, k| rows::dot(a.at(t), b.at(k)));
        let known: f64 = (0..steps).map(|t| traced(s, &noise.process, t + 1, t)).sum();
        let base_cost = nominal_cost + 0.5 * (known + traced(s, &noise.initial, 0, 0));
        Self { dynamics, process: noise.process.clone(), initial: noise.initial.clone(), prices, base_cost }
    }
}

/// How far, relatively, the costs along a plan are from those for which the law is exact at every step.
///
/// # Errors
/// Where a number is out of the range of intervals, and at which step.
pub fn law_distance(horizon: &Horizon, knots: &Knots, curvature: &Matrices) -> Result<f64, String> {
    let (n, joint) = (knots.dimensions.states, knots.dimensions.joint());
    let block =
        |from: &Matrices, t: usize, rows: usize, cols: usize| Matrix::from_fn(rows, cols, |i, j| from.get(t, i, j));
    let mut worst = 0.0f64;
    for t in 0..horizon.steps() {
        let found = distance(&Back {
            dynamics: &block(&knots.dynamics, t, n, joint),
            cost: &block(&knots.cost, t, joint, joint),
            next: &block(curvature, t + 1, n, n),
            here: &block(curvature, t, n, n),
            price: &block(&horizon.prices, t, n, n),
        });
        worst = worst.max(found.map_err(|reason| format!("at step {t}, {reason}"))?);
    }
    Ok(worst)
}
