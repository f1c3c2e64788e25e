use supple_kernels::Scratch;
use supple_lqg::{ControlBounds, Policy};
use supple_model::Trajectory;
use supple_model::system::{RollOut, System};

/// Rolls the noise-free system out under `u = ubar + step k + K (x - xbar)` around `reference`; returns its cost.
///
/// The first state of `out` is that of `reference`.
///
/// Example: [`plan`](crate::plan::plan()).
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
    system.roll_out(RollOut::Law { reference, policy, step, bounds }, phi, out, scratch)
}

/// Rolls the noise-free system out from the first state under the controls of `trajectory`; returns its cost.
///
/// Example: [`plan`](crate::plan::plan()).
pub fn simulate_controls(system: &dyn System, phi: &[f64], trajectory: &mut Trajectory, scratch: &mut Scratch) -> f64 {
    system.roll_out(RollOut::Controls, phi, trajectory, scratch)
}
