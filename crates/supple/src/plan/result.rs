//! Results of planning.

use supple_kernels::{Matrices, Scratch};
use supple_lqg::{Dimensions, Knots, Policy};
use supple_model::Trajectory;
use supple_model::system::{Curvature, System};

use super::{PlanMode, PlanStatus};

/// A gradient counts as valid when the plan's relative stationarity is at most this.
///
/// Example: [`plan`](crate::plan::plan()).
pub const VALID_STATIONARITY: f64 = 1e-8;

/// A reference trajectory with its control law, and how the search for it ended.
///
/// Example: [`plan`](crate::plan::plan()).
#[derive(Clone, Debug)]
pub struct Plan {
    /// The trajectory.
    pub trajectory: Trajectory,
    /// Its linearisation, with the second derivatives of the cost that [`Plan::curvature`] names.
    pub knots: Knots,
    /// The control law and cost-to-go of the final sweep, without regularisation.
    pub policy: Policy,
    /// Costates `lambda` of the trajectory, length n, N + 1 of them.
    pub costates: Matrices,
    /// Cost of the trajectory without noise.
    pub nominal_cost: f64,
    /// The objective minimised by the plan: nominal cost, or expected cost for belief-space plans.
    pub objective: f64,
    /// Which kind of plan it is.
    pub mode: PlanMode,
    /// Which second derivatives of the cost knots and policy have.
    pub curvature: Curvature,
    /// How the search ended.
    pub status: PlanStatus,
    /// Iterations made.
    pub iterations: usize,
    /// The largest `|l_u + B' lambda|` on the trajectory; for controls at a limit, only the inward component counts.
    pub stationarity: f64,
    /// The same, relative to 1 plus the largest `|l_u|`.
    pub relative_stationarity: f64,
    /// The step and the control where it is largest.
    pub steepest: (usize, usize),
    /// How many iterations had to raise the regularisation.
    pub regularised: usize,
    /// The objective of a discarded cheaper plan that did not converge, if any.
    pub passed_over: Option<f64>,
    /// Multipliers of the limits that it keeps, N + 1 vectors of length q, in the order of
    /// [`Constraints::ends`](supple_model::system::Constraints::ends): the cost of a unit of each. Empty where there
    /// are no such limits.
    pub multipliers: Matrices,
    /// The penalties under which these were found, and how often they had to grow.
    pub(super) penalties: Vec<f64>,
    pub(super) growths: usize,
    /// The slopes `l_u + B' lambda` of the cost by the controls, N vectors of length m, where controls have bounds: where
    /// one holds a control, the price of the bound.
    pub control_slopes: Matrices,
}

impl Plan {
    /// An empty plan over `steps` steps.
    #[must_use]
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        Self {
            trajectory: Trajectory::zeros(dimensions, steps),
            knots: Knots::zeros(dimensions, steps),
            policy: Policy::zeros(dimensions, steps),
            costates: Matrices::vectors(steps + 1, dimensions.states),
            nominal_cost: f64::NAN,
            objective: f64::NAN,
            mode: PlanMode::default(),
            curvature: Curvature::default(),
            status: PlanStatus::default(),
            iterations: 0,
            stationarity: f64::NAN,
            relative_stationarity: f64::NAN,
            steepest: (0, 0),
            regularised: 0,
            passed_over: None,
            multipliers: Matrices::vectors(0, 0),
            penalties: Vec::new(),
            growths: 0,
            control_slopes: Matrices::vectors(steps, dimensions.controls),
        }
    }

    /// The second derivatives of the Lagrangian with these costates, of the cost itself, whichever curvature the control law was
    /// computed with.
    pub(crate) fn lagrangian_hessian(
        &self,
        system: &dyn System,
        phi: &[f64],
        costates: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    ) {
        let at = self.trajectory.points();
        if self.curvature == Curvature::Exact {
            out.copy_from(&self.knots.cost);
            system.add_dynamics_curvature(at, phi, costates, out, scratch);
        } else {
            out.clear();
            system.lagrangian_quadratics(at, phi, costates, out, scratch);
        }
    }

    /// Whether it would cost less without the limits of quantities that it keeps; bounds of controls hold it where
    /// [`Policy::held`] says so.
    #[must_use]
    pub fn is_at_limits(&self) -> bool {
        self.multipliers.as_slice().iter().any(|multiplier| *multiplier > 0.0)
    }
}
