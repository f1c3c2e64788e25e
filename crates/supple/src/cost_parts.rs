use serde::{Deserialize, Serialize};
use supple_kernels::{Matrices, rows};
use supple_lqg::Belief;
use supple_lqg::Noise;

use crate::plan::Plan;

/// The expected cost of a task in its four parts (theory, equation J.1).
///
/// Example: the [module](crate::pipeline).
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
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
    pub fn expected(&self) -> f64 {
        self.nominal + self.belief + self.process + self.initial
    }

    /// The amount by which all noise together lowers the cost, if more than rounding: a sign that the cost is not
    /// convex along the plan, so that its second-order expansion is meaningless.
    pub fn lowered(&self) -> Option<f64> {
        let noise = self.belief + self.process + self.initial;
        (noise < -1e-9 * (1.0 + self.nominal.abs())).then_some(-noise)
    }
}

/// The expected cost of a plan under a belief and its noise.
///
/// Example: the [module](crate::pipeline).
#[must_use]
pub fn cost_parts(plan: &Plan, belief: &Belief, noise: &Noise) -> CostParts {
    let steps = plan.trajectory.steps();
    let (xi, s) = (&plan.policy.value_of_information, &plan.policy.curvature);
    CostParts {
        nominal: plan.nominal_cost,
        belief: 0.5 * (0..steps).map(|t| trace_of_product(xi, &belief.corrected, t, t)).sum::<f64>(),
        process: 0.5 * (0..steps).map(|t| trace_of_product(s, &noise.process, t + 1, t)).sum::<f64>(),
        initial: 0.5 * trace_of_product(s, &noise.initial, 0, 0),
    }
}

/// `Tr(a_i b_j)` of symmetric matrices, by their padded rows.
fn trace_of_product(a: &Matrices, b: &Matrices, i: usize, j: usize) -> f64 {
    rows::dot(a.at(i), b.at(j))
}
