//! How much rounding changes a law.

use nalgebra::DVector;

use super::Policy;
use crate::dense::{Dense, congruence, dense};
use crate::knots::Knots;
use crate::noise::Noise;

/// About how far the least expected cost of a sweep may be off by the rounding of its steps, in the units of the cost.
///
/// Each step is off by rounding of the terms that it sums, and carries on what the steps after it were off: `A + B K` on
/// both sides. That grows where the optimal law leaves motions that cost nothing to grow, as for controls without a price
/// that act against the motion at first.
#[must_use]
pub fn least_cost_rounding(knots: &Knots, policy: &Policy, noise: &Noise) -> f64 {
    let (n, joint, steps) = (knots.dimensions.states, knots.dimensions.joint(), knots.steps());
    let mut off = Dense::zeros(n, n);
    let mut cost = 0.0;
    for t in (0..steps).rev() {
        cost += off.dot(&dense(&noise.process, t));
        let f = dense(&knots.dynamics, t);
        let stage = dense(&knots.cost, t);
        // What the diagonal of `L + F' S F` is summed from.
        let reached = dense(&policy.curvature, t + 1).abs() * f.abs();
        let sizes = DVector::from_fn(joint, |i, _| stage[(i, i)].abs() + f.column(i).abs().dot(&reached.column(i)));
        let mut law = Dense::identity(joint, n);
        law.rows_mut(n, joint - n).copy_from(&dense(&policy.feedback, t));
        let own = law.transpose() * Dense::from_diagonal(&(sizes * (f64::EPSILON * joint as f64))) * &law;
        off = congruence(&(f * law).transpose(), &off) + own;
    }
    0.5 * (cost + off.dot(&dense(&noise.initial, 0)))
}
