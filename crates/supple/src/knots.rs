//! Knots: the linearisation of a trajectory.

use supple_kernels::{Matrices, Scratch};

use crate::system::{Curvature, Points, System};
use crate::{Dimensions, Error};

/// The hinge of supple: a trajectory's linearisation. All that comes after sees knots and nothing nonlinear.
///
/// Knot `t` has `[A B] = [f_x f_u]`, `C = g_x` and `[l_zz | l_z]` with `z = (x, u)`; the last knot has no dynamics
/// and no control.
#[derive(Clone, Debug)]
pub struct Knots {
    /// Lengths of state, control and measurement.
    pub dimensions: Dimensions,
    /// `[A B]`, n x (n + m), N of them.
    pub dynamics: Matrices,
    /// `C`, p x n, N + 1 of them.
    pub measurement: Matrices,
    /// `[l_zz | l_z]`, (n + m) x (n + m + 1), N + 1 of them.
    pub cost: Matrices,
    /// Which state each measurement is, where every one is just a state, so that `C` picks states.
    pub picks: Option<Vec<usize>>,
}

impl Knots {
    /// Zero knots for `steps` steps.
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        let (n, joint) = (dimensions.states, dimensions.joint());
        Self {
            dimensions,
            dynamics: Matrices::zeros(steps, n, joint),
            measurement: Matrices::zeros(steps + 1, dimensions.measurements, n),
            cost: Matrices::zeros(steps + 1, joint, joint + 1),
            picks: None,
        }
    }

    /// How many steps there are: one less than knots.
    pub fn steps(&self) -> usize {
        self.dynamics.count()
    }

    /// Fills the knots at all points of a trajectory: dynamics and cost for the plan.
    pub fn linearise_plan(
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

    /// Fills `C` at all points of a trajectory.
    pub fn linearise_measurement(&mut self, system: &dyn System, at: Points, phi: &[f64], scratch: &mut Scratch) {
        system.measurement_jacobians(at, phi, &mut self.measurement, scratch);
        let picks = system.picks();
        if self.picks.as_deref() != picks {
            self.picks = picks.map(<[usize]>::to_vec);
        }
    }

    /// The first step with an entry that is not finite, as an error.
    pub fn check_finite(&self) -> Result<(), Error> {
        let parts = [
            (&self.dynamics, "the dynamics' derivative"),
            (&self.measurement, "the measurement's derivative"),
            (&self.cost, "the cost's derivative"),
        ];
        for (matrices, what) in parts {
            let bad = (0..matrices.count()).find(|&t| matrices.at(t).iter().any(|v| !v.is_finite()));
            if let Some(step) = bad {
                return Err(Error::NotFinite { what, step });
            }
        }
        Ok(())
    }
}
