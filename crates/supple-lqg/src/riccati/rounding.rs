//! The effect of rounding on a control law.

use nalgebra::DVector;

use super::Policy;
use crate::dense::{Dense, congruence, dense};
use crate::knots::Knots;
use crate::noise::Noise;

/// Estimate of the error by rounding of the least expected cost of a sweep, in the units of the cost.
///
/// Each step adds the rounding of the terms it sums, and propagates the error of later steps through `A + B K` on
/// both sides. The error grows if the optimal law lets motions grow that cost nothing, as for controls without a price
/// with an initial inverse response.
///
/// ```
/// use supple_lqg::{Knots, LinearQuadratic, Noise, Policy, Regularisation, constant, least_cost_rounding, solve_riccati};
///
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(50, plant)?;
/// let mut policy = Policy::zeros(knots.dimensions, knots.steps());
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// let one = constant(&[[1.0]]);
/// let noise = Noise { initial: one.clone(), process: one.clone(), measurement: one };
/// assert!(least_cost_rounding(&knots, &policy, &noise) < 1e-9, "the least cost is about 41");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn least_cost_rounding(knots: &Knots, policy: &Policy, noise: &Noise) -> f64 {
    let (n, joint, steps) = (knots.dimensions.states, knots.dimensions.joint(), knots.steps());
    let mut off = Dense::zeros(n, n);
    let mut cost = 0.0;
    for t in (0..steps).rev() {
        cost += off.dot(&dense(&noise.process, t));
        let f = dense(&knots.dynamics, t);
        let stage = dense(&knots.cost, t);
        // The absolute terms of the diagonal entries of `L + F' S F`.
        let reached = dense(&policy.curvature, t + 1).abs() * f.abs();
        let sizes = DVector::from_fn(joint, |i, _| stage[(i, i)].abs() + f.column(i).abs().dot(&reached.column(i)));
        let mut law = Dense::identity(joint, n);
        law.rows_mut(n, joint - n).copy_from(&dense(&policy.feedback, t));
        let own = law.transpose() * Dense::from_diagonal(&(sizes * (f64::EPSILON * joint as f64))) * &law;
        off = congruence(&(f * law).transpose(), &off) + own;
    }
    0.5 * (cost + off.dot(&dense(&noise.initial, 0)))
}
