use supple_kernels::{Matrices, Scratch};

use super::Functional;
use super::total::{Planned, add_functional, add_initial_state};
use super::workspace::GradientWorkspace;
use crate::plan::{Stationarity, sweep_costates};

/// A number that depends on a trajectory: a weight times its nominal cost, and a functional of its knots.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Quantity<'a> {
    /// Weight of the nominal cost.
    pub nominal: f64,
    /// The functional to be added.
    pub functional: Functional<'a>,
}

impl<'a> Quantity<'a> {
    /// The expected cost `J` (theory, equation J.1).
    pub const EXPECTED_COST: Self = Self { nominal: 1.0, functional: Functional::NOISE };
    /// The nominal cost.
    pub const NOMINAL_COST: Self = Self { nominal: 1.0, functional: Functional { belief: 0.0, ..Functional::BELIEF } };

    /// A functional alone.
    pub const fn of(functional: Functional<'a>) -> Self {
        Self { nominal: 0.0, functional }
    }
}

/// The gradient of a quantity along a trajectory that obeys the dynamics (theory, equation P.13), by changes `v` of the
/// controls under `u = ubar + v + K (x - xbar)`; without feedback by the controls themselves. `task.plan` need not be
/// stationary, but its knots, policy and belief must be those of its trajectory.
///
/// With `h` the functional's gradient by the trajectory and `q = weight l_z + h`,
///
/// ```text
/// g_t = q_u + B' nu_{t+1}      nu_t = q_x + A' nu_{t+1} + K' g_t      nu_N = q_{N,x}
/// ```
///
/// Writes `g`, m numbers of each of N steps, to `slope`, and `nu` to `work.costates`; leaves `[l_zz | q]` in
/// `work.hessian`. Where `parameters` are given, they receive the gradient by the parameters at fixed `v`.
pub(crate) fn slope_by_controls(
    task: &Planned,
    quantity: Quantity,
    feedback: Option<&Matrices>,
    work: &mut GradientWorkspace,
    scratch: &mut Scratch,
    slope: &mut [f64],
    parameters: Option<&mut Vec<f64>>,
) -> Stationarity {
    let &Planned { system, phi, initial_state, plan, .. } = task;
    let mut direct = vec![0.0; phi.len()];
    work.forget();
    work.hessian.copy_from(&plan.knots.cost);
    if quantity.nominal != 1.0 {
        let (joint, stride) = (work.hessian.rows(), work.hessian.stride());
        work.hessian.as_mut_slice().chunks_exact_mut(stride).for_each(|row| row[joint] *= quantity.nominal);
    }
    if quantity.functional != Functional::default() {
        add_functional(task, quantity.functional, work, scratch, &mut direct);
    }
    let m = system.dimensions().controls;
    let stationarity = sweep_costates(&plan.knots.dynamics, &work.hessian, feedback, &mut work.costates, |t, a, g| {
        slope[t * m + a] = g;
        g
    });
    if let Some(out) = parameters {
        let at = plan.trajectory.points();
        // The gradient of the Lagrangian contains that of the cost with weight 1.
        if quantity.nominal != 1.0 {
            let mut own = vec![0.0; phi.len()];
            let none = Matrices::vectors(plan.costates.count(), plan.costates.cols());
            system.add_parameter_gradient(at, phi, &none, None, &mut own, scratch);
            direct.iter_mut().zip(&own).for_each(|(sum, own)| *sum += (quantity.nominal - 1.0) * own);
        }
        system.add_parameter_gradient(at, phi, &work.costates, None, &mut direct, scratch);
        add_initial_state(initial_state, phi, work.costates.vector(0), &mut direct);
        *out = direct;
    }
    stationarity
}
