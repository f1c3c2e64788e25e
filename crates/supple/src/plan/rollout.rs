use supple_kernels::Scratch;

use super::{ControlBounds, Policy};
use crate::system::System;
use crate::trajectory::Trajectory;

/// Rolls the noise-free system out under `u = ubar + step k + K (x - xbar)` around `reference`; returns its cost.
///
/// The first state of `out` is that of `reference`.
pub fn rollout(
    system: &dyn System,
    phi: &[f64],
    reference: &Trajectory,
    (policy, step): (&Policy, f64),
    out: &mut Trajectory,
    scratch: &mut Scratch,
) -> f64 {
    rollout_within((system, phi, None), reference, (policy, step), out, scratch)
}

/// As [`rollout`], with the controls kept within bounds.
pub(crate) fn rollout_within(
    (system, phi, bounds): (&dyn System, &[f64], Option<&ControlBounds>),
    reference: &Trajectory,
    (policy, step): (&Policy, f64),
    out: &mut Trajectory,
    scratch: &mut Scratch,
) -> f64 {
    let steps = reference.steps();
    let n = reference.states.cols();
    out.states.vector_mut(0).copy_from_slice(reference.states.vector(0));
    let mut cost = 0.0;
    let narrow = policy.feedback.stride();
    for t in 0..steps {
        let (x, next) = out.states.at_and_next_mut(t);
        let x = &x[..n];
        let u = out.controls.vector_mut(t);
        let (xbar, ubar) = (reference.states.vector(t), reference.controls.vector(t));
        let (feedback, feedforward) = (policy.feedback.at(t), policy.feedforward.vector(t));
        for (a, u) in u.iter_mut().enumerate() {
            let gains = &feedback[a * narrow..a * narrow + n];
            *u = ubar[a]
                + step * feedforward[a]
                + gains.iter().zip(x).zip(xbar).map(|((g, x), xbar)| g * (x - xbar)).sum::<f64>();
        }
        if let Some(bounds) = bounds {
            bounds.clamp(u);
        }
        cost += system.advance(x, u, phi, &mut next[..n], scratch);
    }
    cost + system.final_cost(out.states.vector(steps), phi, scratch)
}

/// Rolls the noise-free system out from the first state under the controls of `trajectory`; returns its cost.
pub fn simulate_controls(system: &dyn System, phi: &[f64], trajectory: &mut Trajectory, scratch: &mut Scratch) -> f64 {
    let steps = trajectory.steps();
    let n = trajectory.states.cols();
    let mut cost = 0.0;
    for t in 0..steps {
        let (x, next) = trajectory.states.at_and_next_mut(t);
        let u = trajectory.controls.vector(t);
        cost += system.advance(&x[..n], u, phi, &mut next[..n], scratch);
    }
    cost + system.final_cost(trajectory.states.vector(steps), phi, scratch)
}
