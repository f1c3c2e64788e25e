//! Knots of a system along a trajectory.

use supple_kernels::Scratch;
use supple_lqg::Knots;

use supple_model::system::{Curvature, Points, System};

/// Fills knots from a system at all points of a trajectory.
pub trait Linearise {
    /// Fills the knots at all points of a trajectory: dynamics and cost for the plan.
    fn linearise_plan(
        &mut self,
        system: &dyn System,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        scratch: &mut Scratch,
    );

    /// Fills `C` at all points of a trajectory.
    fn linearise_measurement(&mut self, system: &dyn System, at: Points, phi: &[f64], scratch: &mut Scratch);
}

impl Linearise for Knots {
    fn linearise_plan(
        &mut self,
        system: &dyn System,
        at: Points,
        phi: &[f64],
        curvature: Curvature,
        scratch: &mut Scratch,
    ) {
        system.dynamics_jacobians(at, phi, &mut self.dynamics, scratch);
        system.cost_quadratics(at, phi, curvature, &mut self.cost, scratch);
    }

    fn linearise_measurement(&mut self, system: &dyn System, at: Points, phi: &[f64], scratch: &mut Scratch) {
        system.measurement_jacobians(at, phi, &mut self.measurement, scratch);
        let picks = system.picks();
        if self.picks.as_deref() != picks {
            self.picks = picks.map(<[usize]>::to_vec);
        }
    }
}
