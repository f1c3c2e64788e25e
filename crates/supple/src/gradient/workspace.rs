//! Memory of gradients, and the linear-quadratic problem that is solved in it.

use supple_kernels::{Matrices, Scratch};
use supple_lqg as lqg;
use supple_lqg::{
    BeliefAdjoint, Dimensions, KnotAdjoints, Lq, Noise, Policy, Regularisation, RiccatiAdjoint, solve_limited, solve_lq,
};
use supple_model::system::{Constraints, System};

use crate::Error;
use crate::plan::Plan;

/// Memory of the gradients.
///
/// Example: [`total_gradient`](crate::gradient::total_gradient).
#[derive(Clone, Debug)]
pub struct GradientWorkspace {
    pub(super) belief: BeliefAdjoint,
    pub(super) adjoints: KnotAdjoints,
    pub(super) noise: Noise,
    /// `[H | h]`: the Hessian of the Lagrangian, and the functional's gradient by the trajectory.
    pub(crate) hessian: Matrices,
    /// Whether `H` is that of the plan, which is the same for every functional.
    known: bool,
    pub(super) riccati: RiccatiAdjoint,
    policy: Policy,
    pub(super) variation: Matrices,
    pub(crate) costates: Matrices,
}

impl GradientWorkspace {
    /// Allocates memory for `steps` steps.
    #[must_use]
    pub fn new(dimensions: Dimensions, steps: usize) -> Self {
        let Dimensions { states, measurements, .. } = dimensions;
        let joint = dimensions.joint();
        Self {
            belief: BeliefAdjoint::new(states, measurements),
            adjoints: KnotAdjoints::zeros(dimensions, steps),
            noise: Noise::zeros(states, measurements),
            hessian: Matrices::zeros(steps + 1, joint, joint + 1),
            known: false,
            riccati: RiccatiAdjoint::new(states, joint),
            policy: Policy::zeros(dimensions, steps),
            variation: Matrices::vectors(steps + 1, joint),
            costates: Matrices::vectors(steps + 1, states),
        }
    }

    /// Discards what was stored for the last plan. Call it when the plan changes.
    pub fn forget(&mut self) {
        self.known = false;
    }

    /// The variation of trajectory and costates that solves the LQ problem of `hessian` along a plan (theory, equation
    /// G.6); controls that the plan holds at a bound stay there.
    ///
    /// # Errors
    /// Where the problem is not convex.
    pub(super) fn vary(&mut self, plan: &Plan) -> Result<(), Error> {
        let (dynamics, cost, limits) = (&plan.knots.dynamics, &self.hessian, plan.policy.held());
        let regularisation = Regularisation::default();
        let lq = Lq { dynamics, cost, regularisation, limits, with_value: false };
        solve_limited(lq, &mut self.policy).map_err(|error| match error {
            lqg::Error::NotPositiveDefinite { step, .. } => Error::NoStrictMinimum { step },
            error => error.into(),
        })?;
        solve_lq(dynamics, &self.policy, &mut self.variation, &mut self.costates);
        Ok(())
    }

    /// The Hessian of the Lagrangian at a plan into `hessian`, with no linear term; `limits` are those that it is at.
    pub(super) fn start_hessian(
        &mut self,
        system: &dyn System,
        phi: &[f64],
        plan: &Plan,
        limits: Option<&dyn Constraints>,
        scratch: &mut Scratch,
    ) {
        let hessian = &mut self.hessian;
        if !self.known {
            // The trajectory is a minimum of the cost itself.
            plan.lagrangian_hessian(system, phi, &plan.costates, hessian, scratch);
            if let Some(limits) = limits {
                limits.add_excess_curvature(plan.trajectory.points(), phi, &plan.multipliers, hessian, scratch);
            }
            self.known = true;
        }
        let (joint, stride) = (hessian.rows(), hessian.stride());
        for row in hessian.as_mut_slice().chunks_exact_mut(stride) {
            row[joint] = 0.0;
        }
    }
}
