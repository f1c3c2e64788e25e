use supple_lqg::{ControlBounds, Policy};

use crate::trajectory::Trajectory;

/// What decides the controls of a noise-free roll-out.
#[derive(Clone, Copy, Debug)]
pub enum RollOut<'a> {
    /// The controls that the trajectory has already, from the first state that it has already.
    Controls,
    /// `u = ubar + step k + K (x - xbar)`, kept within bounds, from the first state of the reference.
    Law {
        /// `xbar` and `ubar`, of as many steps as the trajectory.
        reference: &'a Trajectory,
        /// `K` and `k`.
        policy: &'a Policy,
        /// Which part of `k` is added.
        step: f64,
        /// Bounds that the controls are moved into.
        bounds: Option<&'a ControlBounds>,
    },
}

impl RollOut<'_> {
    /// Writes the first state of `out`, where it is not the one that is there.
    pub fn start(&self, out: &mut Trajectory) {
        if let Self::Law { reference, .. } = self {
            out.states.vector_mut(0).copy_from_slice(reference.states.vector(0));
        }
    }

    /// Writes the control at step `t`, length m, given the state `x`, length n; leaves it where it is given already.
    #[inline(always)]
    pub fn control(&self, t: usize, x: &[f64], u: &mut [f64]) {
        let Self::Law { reference, policy, step, bounds } = self else { return };
        policy.control(t, *step, x, [reference.states.vector(t), reference.controls.vector(t)], u);
        if let Some(bounds) = bounds {
            bounds.clamp(u);
        }
    }
}

/// A roll-out by one step after the other: `advance` writes the next state at a step, a state and a control, and returns the
/// cost of the stage. Returns the sum of these. Allocates nothing.
pub(super) fn step_by_step(
    law: RollOut,
    out: &mut Trajectory,
    mut advance: impl FnMut(usize, &[f64], &[f64], &mut [f64]) -> f64,
) -> f64 {
    let (steps, n) = (out.steps(), out.states.cols());
    law.start(out);
    let mut cost = 0.0;
    for t in 0..steps {
        let (x, next) = out.states.at_and_next_mut(t);
        let x = &x[..n];
        let u = out.controls.vector_mut(t);
        law.control(t, x, u);
        cost += advance(t, x, u, &mut next[..n]);
    }
    cost
}
