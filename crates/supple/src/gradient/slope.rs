use supple_kernels::{Matrices, Scratch};

use super::Functional;
use super::total::{TotalGradient, add_functional, add_initial_state};
use super::workspace::GradientWorkspace;

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

/// How far a slope by the controls is from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Steepness {
    /// The largest entry of the slope.
    pub residual: f64,
    /// The largest direct slope by a control, `|l_u + h_u|`: the scale of the residual.
    pub scale: f64,
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
    task: &TotalGradient,
    quantity: Quantity,
    feedback: Option<&Matrices>,
    (work, scratch): (&mut GradientWorkspace, &mut Scratch),
    slope: &mut [f64],
    parameters: Option<&mut Vec<f64>>,
) -> Steepness {
    let &TotalGradient { system, phi, initial_state, plan, .. } = task;
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
    let steepness = sweep(&plan.knots.dynamics, &work.hessian, feedback, &mut work.costates, slope);
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
        add_initial_state((initial_state, phi), work.costates.vector(0), &mut direct);
        *out = direct;
    }
    steepness
}

/// The sweep of [`slope_by_controls`] over `[l_zz | q]`.
fn sweep(
    dynamics: &Matrices,
    cost: &Matrices,
    feedback: Option<&Matrices>,
    costates: &mut Matrices,
    slope: &mut [f64],
) -> Steepness {
    let (steps, n, joint) = (dynamics.count(), dynamics.rows(), dynamics.cols());
    let (m, stride, wide) = (joint - n, dynamics.stride(), cost.stride());
    let own = |t: usize, i: usize| cost.at(t)[i * wide + joint];
    let mut result = Steepness::default();
    for (i, costate) in costates.vector_mut(steps).iter_mut().enumerate() {
        *costate = own(steps, i);
    }
    for t in (0..steps).rev() {
        let f = dynamics.at(t);
        let (now, next) = costates.at_mut_and_next(t);
        let through = |j: usize| (0..n).map(|k| f[k * stride + j] * next[k]).sum::<f64>();
        for (i, now) in now[..n].iter_mut().enumerate() {
            *now = own(t, i) + through(i);
        }
        for (a, g) in slope[t * m..(t + 1) * m].iter_mut().enumerate() {
            *g = own(t, n + a) + through(n + a);
            if g.abs() > result.residual || g.is_nan() {
                result.residual = g.abs();
            }
            result.scale = result.scale.max(own(t, n + a).abs());
            if let Some(feedback) = feedback {
                let row = &feedback.at(t)[a * feedback.stride()..];
                now[..n].iter_mut().zip(row).for_each(|(now, gain)| *now += gain * *g);
            }
        }
    }
    result
}
