use serde::{Deserialize, Serialize};
use supple_kernels::{Matrices, rows};

use crate::Error;
use crate::belief::Belief;
use crate::dense::{Dense, dense, symmetric};
use crate::given::{Given, INITIAL, PROCESS};
use crate::knots::Knots;
use crate::noise::Noise;
use crate::riccati::Policy;

/// The expected cost in its four parts (theory, equation J.1).
///
/// Example: [`cost_parts`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct CostParts {
    /// `sum l_t(xbar, ubar) + l_N(xbar_N)`
    pub nominal: f64,
    /// `1/2 sum_{t<N} Tr(Xi_t Sigma_t)`: the cost of estimation errors
    pub belief: f64,
    /// `1/2 sum_{t<N} Tr(S_{t+1} W_t)`: the cost of process noise
    pub process: f64,
    /// `1/2 Tr(S_0 X_0)`: the cost of initial uncertainty
    pub initial: f64,
}

impl CostParts {
    /// The expected cost `J`: the sum of the parts.
    #[must_use]
    pub fn expected(&self) -> f64 {
        self.nominal + self.belief + self.process + self.initial
    }

    /// The amount by which all noise together lowers the cost, if more than rounding: a sign that the cost is not
    /// convex along the plan, so that its second-order expansion is meaningless.
    #[must_use]
    pub fn lowered(&self) -> Option<f64> {
        let noise = self.belief + self.process + self.initial;
        (noise < -1e-9 * (1.0 + self.nominal.abs())).then_some(-noise)
    }
}

/// The expected cost of a plant under its optimal controller, `nominal` without noise.
///
/// # Errors
/// If policy, belief and noise do not fit each other.
///
/// ```
/// use supple_lqg::{Belief, Knots, LinearQuadratic, Noise, Policy, Regularisation};
/// use supple_lqg::{constant, cost_parts, kalman, solve_riccati};
///
/// // x+ = x + u + w with the costs x^2 / 2 and u^2 / 2 per step.
/// let plant = LinearQuadratic { a: &[[1.0]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(100, plant)?;
/// let noise = Noise { initial: constant(&[[0.0]]), process: constant(&[[1.0]]), measurement: constant(&[[1e-9]]) };
/// let (mut policy, mut belief) = (Policy::zeros(knots.dimensions, 100), Belief::zeros(1, 1, 100));
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// kalman(&knots, &noise, &mut belief)?;
/// let cost = cost_parts(0.0, &policy, &belief, &noise)?;
/// // With a sensor that is all but exact, each step costs half the golden ratio.
/// assert!(cost.belief < 1e-6 && (cost.process / 100.0 - 0.809).abs() < 0.01);
/// # Ok::<(), supple_lqg::Error>(())
/// ```
pub fn cost_parts(nominal: f64, policy: &Policy, belief: &Belief, noise: &Noise) -> Result<CostParts, Error> {
    let (xi, s) = (&policy.value_of_information, &policy.curvature);
    let (n, steps) = (xi.rows(), xi.count());
    for (what, array, count) in
        [("the belief", &belief.corrected, steps), (PROCESS, &noise.process, steps), (INITIAL, &noise.initial, 1)]
    {
        Given { what, array, shape: (n, n), count }.check_shape()?;
    }
    Ok(CostParts {
        nominal,
        belief: 0.5 * (0..steps).map(|t| trace_of_product(xi, &belief.corrected, t, t)).sum::<f64>(),
        process: 0.5 * (0..steps).map(|t| trace_of_product(s, &noise.process, t + 1, t)).sum::<f64>(),
        initial: 0.5 * trace_of_product(s, &noise.initial, 0, 0),
    })
}

/// What noise costs in the closed loop of any law: `1/2 sum Tr(H_t Z_t)`, with the covariances `Z_t` of state and control, and
/// second derivatives `H_t`, (n + m) x (n + m + 1) each, N + 1 of them, in place of those of the knots' cost (theory, equation J.4).
///
/// With the knots' own cost and its optimal law it is the sum of the parts of [`cost_parts`] but the nominal one. With the
/// second derivatives of the Lagrangian it is what noise costs to second order, with that of the dynamics.
///
/// # Errors
/// If knots, policy, belief and second derivatives do not fit each other.
///
/// ```
/// use supple_lqg::{Belief, Knots, LinearQuadratic, Noise, Policy, Regularisation};
/// use supple_lqg::{constant, cost_parts, kalman, noise_cost, solve_riccati};
///
/// let (a, b, c) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]], [[1.0, 0.0]]);
/// let plant = LinearQuadratic { a: &a, b: &b, c: &c, q: &[[1.0, 0.0], [0.0, 0.1]], r: &[[0.01]] };
/// let knots = Knots::linear(100, plant)?;
/// let noise = Noise {
///     initial: constant(&[[0.01, 0.0], [0.0, 0.01]]),
///     process: constant(&[[1e-6, 0.0], [0.0, 1e-4]]),
///     measurement: constant(&[[1e-4]]),
/// };
/// let (mut policy, mut belief) = (Policy::zeros(knots.dimensions, 100), Belief::zeros(2, 1, 100));
/// solve_riccati(&knots.dynamics, &knots.cost, Regularisation::default(), &mut policy)?;
/// kalman(&knots, &noise, &mut belief)?;
/// let parts = cost_parts(0.0, &policy, &belief, &noise)?;
/// let whole = noise_cost(&knots, &policy, &belief, &knots.cost)?;
/// assert!((whole / parts.expected() - 1.0).abs() < 1e-12);
/// # Ok::<(), supple_lqg::Error>(())
/// ```
pub fn noise_cost(knots: &Knots, policy: &Policy, belief: &Belief, hessians: &Matrices) -> Result<f64, Error> {
    let (n, joint, steps) = (knots.dimensions.states, knots.dimensions.joint(), knots.steps());
    knots.check_shapes()?;
    policy.check_shapes(knots.dimensions, steps)?;
    belief.check_shapes(knots.dimensions, steps)?;
    let what = "the second derivatives of the cost";
    Given { what, array: hessians, shape: (joint, joint + 1), count: steps + 1 }.check_shape()?;
    let of_estimate = |t: usize| dense(&belief.predicted, t) - dense(&belief.corrected, t);
    // The covariance of the estimate; its error is independent of it.
    let mut estimate = of_estimate(0);
    let mut cost = 0.0;
    for t in 0..steps {
        let (both, feedback) = (dense(&knots.dynamics, t), dense(&policy.feedback, t));
        let (a, b) = (both.columns(0, n), both.columns(n, both.ncols() - n));
        let error = dense(&belief.corrected, t);
        let across = &feedback * &estimate;
        let mut joint = Dense::zeros(both.ncols(), both.ncols());
        joint.view_mut((0, 0), (n, n)).copy_from(&(&estimate + &error));
        joint.view_mut((n, 0), across.shape()).copy_from(&across);
        joint.view_mut((n, n), (b.ncols(), b.ncols())).copy_from(&(&across * feedback.transpose()));
        cost += 0.5 * trace_of_lower(hessians, t, &joint);
        let closed = a + b * &feedback;
        estimate = symmetric(&closed * &estimate * closed.transpose()) + of_estimate(t + 1);
    }
    Ok(cost + 0.5 * trace_of_lower(hessians, steps, &(estimate + dense(&belief.corrected, steps))))
}

/// `Tr(h_t z)` of symmetric matrices, of which the lower triangles are read.
fn trace_of_lower(hessians: &Matrices, t: usize, z: &Dense) -> f64 {
    let entry = |i: usize, j: usize| hessians.get(t, i, j) * z[(i, j)];
    (0..z.nrows()).map(|i| entry(i, i) + 2.0 * (0..i).map(|j| entry(i, j)).sum::<f64>()).sum()
}

/// `Tr(a_i b_j)` of symmetric matrices, by their padded rows.
fn trace_of_product(a: &Matrices, b: &Matrices, i: usize, j: usize) -> f64 {
    rows::dot(a.at(i), b.at(j))
}
